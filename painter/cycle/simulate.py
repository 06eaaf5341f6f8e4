"""Runs one simulated paint cycle and keeps its log."""

from typing import Unpack

from pydrake.geometry import Meshcat

from painter.config import Scenario
from painter.cycle.cycle_log import CycleLog, GunPoses
from painter.cycle.running_cycle import RunningCycle, Watch
from painter.diagrams.brain import OwnSystems
from painter.diagrams.paint_cycle import MakePaintCycle
from painter.planning.arm.kinematics import NQ
from painter.planning.program.remainder import Remainder
from painter.systems.simulated.paint_film import FilmState

LOG_PERIOD = 0.01
CLEARANCE_PERIOD = 0.05
# Robot time between observations of the cycle, s.
WATCH_PERIOD = 0.1


def SimulateCycle(
    scenario: Scenario,
    *,
    remainder: Remainder | None = None,
    film: FilmState | None = None,
    meshcat: Meshcat | None = None,
    watch: Watch | None = None,
    **own: Unpack[OwnSystems],
) -> CycleLog:
    """Simulates a paint cycle until it is finished.

    Args:
        scenario: The job.
        remainder: Strokes left to paint on a wall known from an earlier run; None =
            scan the wall and paint all of it.
        film: Film that is on the wall already; None = none.
        meshcat: Where to show it, or None.
        watch: Called every WATCH_PERIOD of robot time with the time, s, and the status
            of cycle and follower; may return a command of the operator.
        own: Systems of one's own; see `MakePaintCycle`.

    Returns:
        The log of the cycle, whether it reached DONE or not.
    """
    cycle = MakePaintCycle(
        scenario, remainder=remainder, film=film, meshcat=meshcat, **own
    )
    run = RunningCycle(
        cycle,
        logged={
            "cheat.state": LOG_PERIOD,
            "arm.state_estimated": LOG_PERIOD,
            "arm.desired_state": LOG_PERIOD,
            "gun.trigger": LOG_PERIOD,
            "cheat.clearance": CLEARANCE_PERIOD,
            "cheat.floor_clearance": CLEARANCE_PERIOD,
        },
        watch=watch,
    )
    run.simulator.Initialize()
    while True:
        run.simulator.AdvanceTo(run.time + WATCH_PERIOD)
        if run.observe().finished:
            return _Log(run)


def _Log(run: RunningCycle) -> CycleLog:
    kinematics = run.cycle.robot.kinematics
    measured = run.vector_log("arm.state_estimated").data()
    desired = run.vector_log("arm.desired_state").data()
    true = run.vector_log("cheat.state")
    clearance = run.vector_log("cheat.clearance")
    return run.cycle_log(
        time=true.sample_times().copy(),
        q=measured[:NQ].T.copy(),
        v=measured[NQ:].T.copy(),
        trigger=run.vector_log("gun.trigger").data()[0].copy(),
        X_WG=GunPoses(kinematics, true.data()[:NQ].T),
        X_WG_desired=GunPoses(kinematics, desired[:NQ].T),
        clearance_time=clearance.sample_times().copy(),
        clearance=clearance.data()[0].copy(),
        floor_clearance=run.vector_log("cheat.floor_clearance").data()[0].copy(),
        film=run.evaluate("cheat.film"),
    )
