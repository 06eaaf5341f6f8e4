"""Runs one simulated paint cycle and keeps what it leaves."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from pydrake.geometry import Meshcat
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, DiagramBuilder
from pydrake.systems.primitives import LogVectorOutput, VectorLogSink

from painter.config import Scenario
from painter.diagrams.arm_model import GetArmKinematics, MakeArmPlant
from painter.diagrams.paint_cycle import MakePaintCycle, PaintCycleDiagram
from painter.planning.kinematics import ArmKinematics
from painter.planning.remainder import Remainder
from painter.planning.spray_path import PaintProgram
from painter.systems.paint_film import FilmState
from painter.systems.values import (
    CycleStatus,
    FollowerStatus,
    OperatorCommand,
    Phase,
    StageResult,
)
from perception.values import FloatArray, FrozenValue, SurfaceMap, WallSegmentation

NQ = 5
LOG_PERIOD = 0.01
CLEARANCE_PERIOD = 0.05
# Robot time between looks at the cycle from outside, s.
WATCH_PERIOD = 0.1

# Sees the robot's time, s, and both statuses; may return a word of the operator's.
Watch = Callable[[float, CycleStatus, FollowerStatus], str | None]


@dataclass(frozen=True, eq=False)
class CycleLog(FrozenValue):
    """What a cycle leaves; parts it did not come to are None.

    Attributes:
        status: The cycle's last status, with all events.
        end_time: Robot time at which the simulation stopped, s.
        time: (n,) s, of the samples below.
        q: (n, 5) rad, measured.
        v: (n, 5) rad/s, measured.
        trigger: (n,) as the gun received it.
        X_WG: (n, 4, 4) nozzle poses in W: true ones, or measured where nobody knows.
        X_WG_desired: (n, 4, 4) nozzle poses of the desired joint state.
        clearance_time: (k,) s; nothing where nobody knows clearances.
        clearance: (k,) m, least distance of the robot from the scene.
        floor_clearance: (k,) m, the same from the floor and the robot's own frame.
        surface_map: The fused map.
        segmentation: The wall's segmentation, or None.
        program: The paint program, or None.
        film: The paint film at the end; None where nobody knows it.
        look_image: (H, W, 4) uint8, colour picture of first sight, or None.
    """

    status: CycleStatus
    end_time: float
    time: FloatArray
    q: FloatArray
    v: FloatArray
    trigger: FloatArray
    X_WG: FloatArray
    X_WG_desired: FloatArray
    clearance_time: FloatArray
    clearance: FloatArray
    floor_clearance: FloatArray
    surface_map: SurfaceMap
    segmentation: WallSegmentation | None
    program: PaintProgram | None
    film: FilmState | None
    look_image: npt.NDArray[np.uint8] | None


def SimulateCycle(
    scenario: Scenario,
    *,
    remainder: Remainder | None = None,
    film: FilmState | None = None,
    meshcat: Meshcat | None = None,
    watch: Watch | None = None,
) -> CycleLog:
    """Simulates a paint cycle until it is finished.

    Args:
        scenario: The job.
        remainder: What is left to do on a wall that was seen before; None = look at
            the wall and paint all of it.
        film: What is on the wall already; None = nothing.
        meshcat: Where to show it, or None.
        watch: Called every WATCH_PERIOD of robot time with the time, s, and the
            cycle's and the follower's status; a word that it returns is the operator's.

    Returns:
        What the cycle left, whether it came to DONE or not.
    """
    cycle = MakePaintCycle(scenario, remainder=remainder, film=film, meshcat=meshcat)
    builder = DiagramBuilder()
    builder.AddNamedSystem("paint_cycle", cycle.diagram)
    sinks = {
        name: LogVectorOutput(cycle.diagram.GetOutputPort(port), builder, period)
        for name, port, period in (
            ("state", "cheat.state", LOG_PERIOD),
            ("measured", "arm.state_estimated", LOG_PERIOD),
            ("desired", "arm.desired_state", LOG_PERIOD),
            ("trigger", "gun.trigger", LOG_PERIOD),
            ("clearance", "cheat.clearance", CLEARANCE_PERIOD),
            ("floor_clearance", "cheat.floor_clearance", CLEARANCE_PERIOD),
        )
    }
    builder.ExportInput(cycle.diagram.GetInputPort("operator"), "operator")
    root = builder.Build()
    simulator = Simulator(root)
    context = simulator.get_mutable_context()
    said = OperatorCommand()
    root.GetInputPort("operator").FixValue(context, said)
    simulator.Initialize()
    look_image = None
    while True:
        simulator.AdvanceTo(context.get_time() + WATCH_PERIOD)
        status: CycleStatus = Evaluate(cycle, context, "cycle_status")
        if watch is not None:
            follower = Evaluate(cycle, context, "follower_status")
            word = watch(context.get_time(), status, follower)
            if word is not None:
                said = OperatorCommand(number=said.number + 1, word=word)
                root.GetInputPort("operator").FixValue(context, said)
        if look_image is None and status.phase == Phase.SCAN:
            look_image = _ColorImage(cycle, context)
        if status.finished:
            break
    return _MakeLog(scenario, cycle, context, sinks, status, look_image)


def Evaluate(cycle: PaintCycleDiagram, context: Context, port: str) -> Any:
    """Returns an output of the cycle's diagram, in a context of its root."""
    own = cycle.diagram.GetMyContextFromRoot(context)
    return cycle.diagram.GetOutputPort(port).Eval(own)


def _ColorImage(cycle: PaintCycleDiagram, context: Context) -> npt.NDArray[np.uint8]:
    return Evaluate(cycle, context, "wall_camera.color_image").data.copy()


def _MakeLog(
    scenario: Scenario,
    cycle: PaintCycleDiagram,
    context: Context,
    sinks: dict[str, VectorLogSink],
    status: CycleStatus,
    look_image: npt.NDArray[np.uint8] | None,
) -> CycleLog:
    logs = {name: sink.FindLog(context) for name, sink in sinks.items()}
    data = {name: log.data().copy() for name, log in logs.items()}
    kinematics = GetArmKinematics(MakeArmPlant(scenario.directives))
    segmentation: StageResult = Evaluate(cycle, context, "segmentation")
    program: StageResult = Evaluate(cycle, context, "program")
    return CycleLog(
        status=status,
        end_time=context.get_time(),
        time=logs["state"].sample_times().copy(),
        q=data["measured"][:NQ].T.copy(),
        v=data["measured"][NQ:].T.copy(),
        trigger=data["trigger"][0].copy(),
        X_WG=GunPoses(kinematics, data["state"][:NQ].T),
        X_WG_desired=GunPoses(kinematics, data["desired"][:NQ].T),
        clearance_time=logs["clearance"].sample_times().copy(),
        clearance=data["clearance"][0].copy(),
        floor_clearance=data["floor_clearance"][0].copy(),
        surface_map=Evaluate(cycle, context, "surface_map"),
        segmentation=segmentation.value,
        program=program.value,
        film=Evaluate(cycle, context, "cheat.film"),
        look_image=look_image,
    )


def GunPoses(kinematics: ArmKinematics, q: FloatArray) -> FloatArray:
    """Returns (n, 4, 4) nozzle poses in W of joint positions (n, 5), rad."""
    R_WG, p_WG = kinematics.gun_poses(q)
    poses = np.tile(np.eye(4), (len(q), 1, 1))
    poses[:, :3, :3] = R_WG
    poses[:, :3, 3] = p_WG
    return poses


def clearance_violations(
    time: FloatArray, clearance: FloatArray, bound: float
) -> list[tuple[float, float]]:
    """Finds the episodes in which the robot came too close to something.

    Args:
        time: (k,) s.
        clearance: (k,) m.
        bound: Least distance allowed, m.

    Returns:
        (time of the least distance, that distance) of each unbroken episode below the
        bound, in order.
    """
    below = np.concatenate([[False], clearance < bound, [False]])
    starts = np.flatnonzero(below[1:] & ~below[:-1])
    ends = np.flatnonzero(~below[1:] & below[:-1])
    worst = [
        start + int(np.argmin(clearance[start:end]))
        for start, end in zip(starts, ends, strict=True)
    ]
    return [(float(time[index]), float(clearance[index])) for index in worst]
