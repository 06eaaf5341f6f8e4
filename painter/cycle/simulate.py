"""Runs one simulated paint cycle and keeps what it leaves."""

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt
from pydrake.geometry import Meshcat
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, DiagramBuilder
from pydrake.systems.primitives import LogVectorOutput, VectorLogSink

from painter.config import Scenario
from painter.cycle.cycle_log import CycleLog, GunPoses
from painter.diagrams.paint_cycle import MakePaintCycle, PaintCycleDiagram
from painter.planning.arm.kinematics import NQ
from painter.planning.program.remainder import Remainder
from painter.systems.simulated.paint_film import FilmState
from painter.systems.values import (
    CycleStatus,
    FollowerStatus,
    OperatorCommand,
    Phase,
    StageResult,
)

LOG_PERIOD = 0.01
CLEARANCE_PERIOD = 0.05
# Robot time between looks at the cycle from outside, s.
WATCH_PERIOD = 0.1

# Sees the robot's time, s, and both statuses; may return a word of the operator's.
Watch = Callable[[float, CycleStatus, FollowerStatus], str | None]


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
    return _MakeLog(cycle, context, sinks, status, look_image)


def Evaluate(cycle: PaintCycleDiagram, context: Context, port: str) -> Any:
    """Returns an output of the cycle's diagram, in a context of its root."""
    own = cycle.diagram.GetMyContextFromRoot(context)
    return cycle.diagram.GetOutputPort(port).Eval(own)


def _ColorImage(cycle: PaintCycleDiagram, context: Context) -> npt.NDArray[np.uint8]:
    return Evaluate(cycle, context, "wall_camera.color_image").data.copy()


def _MakeLog(
    cycle: PaintCycleDiagram,
    context: Context,
    sinks: dict[str, VectorLogSink],
    status: CycleStatus,
    look_image: npt.NDArray[np.uint8] | None,
) -> CycleLog:
    logs = {name: sink.FindLog(context) for name, sink in sinks.items()}
    data = {name: log.data().copy() for name, log in logs.items()}
    segmentation: StageResult = Evaluate(cycle, context, "segmentation")
    program: StageResult = Evaluate(cycle, context, "program")
    return CycleLog(
        status=status,
        end_time=context.get_time(),
        time=logs["state"].sample_times().copy(),
        q=data["measured"][:NQ].T.copy(),
        v=data["measured"][NQ:].T.copy(),
        trigger=data["trigger"][0].copy(),
        X_WG=GunPoses(cycle.robot.kinematics, data["state"][:NQ].T),
        X_WG_desired=GunPoses(cycle.robot.kinematics, data["desired"][:NQ].T),
        clearance_time=logs["clearance"].sample_times().copy(),
        clearance=data["clearance"][0].copy(),
        floor_clearance=data["floor_clearance"][0].copy(),
        surface_map=Evaluate(cycle, context, "surface_map"),
        segmentation=segmentation.value,
        program=program.value,
        film=Evaluate(cycle, context, "cheat.film"),
        look_image=look_image,
    )
