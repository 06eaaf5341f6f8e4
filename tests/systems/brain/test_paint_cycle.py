"""PaintCycle: the phases in their order; pause, abort, refusals and faults."""

import numpy as np
import pytest
from pydrake.common.value import Value
from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from painter.errors import ReachError
from painter.planning.spray_path import Motion, PaintProgram
from painter.systems.brain.paint_cycle import PaintCycle
from painter.systems.brain.path_follower import PathFollower
from painter.systems.cycle_state import KNOWN_WALL_SEQUENCE, SEQUENCE
from painter.systems.stage import STAGES, Stage
from painter.systems.values import (
    ArmStatus,
    DriveStatus,
    Fault,
    FollowerStatus,
    OperatorCommand,
    Phase,
    StageResult,
)
from perception.values import Wall, WallSegmentation

DURATION = 1.0
SPRAY = (0.3, 0.6)
WALL = Wall(X_WT=RigidTransform(), rms=0.001, inlier_count=1, inlier_share=1.0)
SEGMENTATION = WallSegmentation(
    labels=np.ones((2, 2), dtype=np.uint16),
    depth=np.zeros((2, 2), dtype=np.float32),
    wall_mask=np.ones((2, 2), dtype=bool),
    X_WT=RigidTransform(),
    cell=0.01,
)


def still_motion(spray_on=()) -> Motion:
    """A motion that stays where the arm is, so that any may follow any."""
    return Motion(
        time=np.array([0.0, DURATION]),
        q=np.zeros((2, 5)),
        v=np.zeros((2, 5)),
        spray_on=np.array(spray_on, dtype=float).reshape(-1, 2),
    )


class ScriptedStage(Stage):
    """Answers with a value, by the goal if it has several, or fails."""

    def __init__(self, stage: str, answer) -> None:
        super().__init__(stage=stage, inputs={})
        self._answer = answer

    def Work(self, context, goal):
        answer = self._answer
        if isinstance(answer, dict):
            answer = answer.get(goal, answer["else"])
        if isinstance(answer, Exception):
            raise answer
        return answer


class Rig:
    """Cycle, follower and scripted stages; the test plays operator and drives."""

    def __init__(
        self, *, unattended=True, time_limit=60.0, sequence=SEQUENCE, **answers
    ) -> None:
        program = PaintProgram(
            strokes=(),
            motion=still_motion([SPRAY]),
            X_WT=RigidTransform(),
            standoff=0.3,
            nominal_thickness=1e-4,
        )
        values = {
            "motion_planner": still_motion(),
            "wall_finder": WALL,
            "wall_segmenter": SEGMENTATION,
            "spray_path_planner": program,
        } | answers
        builder = DiagramBuilder()
        self.cycle = builder.AddNamedSystem(
            "cycle",
            PaintCycle(
                unattended=unattended,
                period=0.02,
                look_time=0.5,
                time_limit=time_limit,
                sequence=sequence,
            ),
        )
        self.follower = builder.AddNamedSystem("follower", PathFollower(period=0.02))
        for name in STAGES:
            stage = builder.AddNamedSystem(name, ScriptedStage(name, values[name]))
            builder.Connect(
                self.cycle.GetOutputPort("request"), stage.GetInputPort("request")
            )
            builder.Connect(
                stage.GetOutputPort("result"), self.cycle.GetInputPort(name)
            )
        builder.Connect(
            self.cycle.GetOutputPort("motion_command"),
            self.follower.GetInputPort("motion_command"),
        )
        builder.Connect(
            self.follower.GetOutputPort("status"),
            self.cycle.GetInputPort("follower_status"),
        )
        for port in ("arm_status", "operator"):
            builder.ExportInput(self.cycle.GetInputPort(port), port)
        builder.ExportInput(self.follower.GetInputPort("state"), "state")
        self.diagram = builder.Build()
        self.simulator = Simulator(self.diagram)
        self.context = self.simulator.get_mutable_context()
        self.diagram.GetInputPort("state").FixValue(self.context, np.zeros(10))
        self.set("arm_status", ArmStatus())
        self.set("operator", OperatorCommand())
        self.commands = 0

    def set(self, port: str, value) -> None:
        self.diagram.GetInputPort(port).FixValue(self.context, Value(value))

    def say(self, command: str) -> None:
        self.commands += 1
        self.set("operator", OperatorCommand(self.commands, command))

    def output(self, system, port: str):
        return system.GetOutputPort(port).Eval(
            system.GetMyContextFromRoot(self.context)
        )

    @property
    def status(self):
        return self.output(self.cycle, "cycle_status")

    @property
    def phases(self) -> list[str]:
        return [
            data["phase"] for _, name, data in self.status.events if name == "phase"
        ]

    @property
    def trigger(self) -> float:
        return self.output(self.follower, "trigger")[0]

    def advance_until(self, condition, limit: float = 40.0) -> None:
        while not condition():
            assert self.context.get_time() < limit, self.phases
            self.simulator.AdvanceTo(self.context.get_time() + 0.02)

    def advance_to_end(self) -> None:
        self.advance_until(lambda: self.status.finished)


ALL = [step.value for step in Phase][: list(Phase).index(Phase.DONE) + 1]


def test_unattended_cycle_goes_through_all_phases():
    rig = Rig()
    rig.advance_to_end()
    assert rig.phases == ALL
    times = [time for time, name, _ in rig.status.events if name == "phase"]
    look = times[ALL.index("SCAN")] - times[ALL.index("LOOK")]
    # A move, the look, and a few decisions of 20 ms.
    assert look == pytest.approx(DURATION + 0.5, abs=0.2)


def test_a_known_wall_is_painted_without_a_look_at_it():
    rig = Rig(sequence=KNOWN_WALL_SEQUENCE)
    looked = set()
    rig.advance_until(
        lambda: (
            looked.add(float(rig.output(rig.cycle, "camera_enabled")[0]))
            or rig.status.finished
        )
    )
    assert rig.status.phase == Phase.DONE
    assert looked == {0.0}
    # Home, the program and the retreat.
    assert rig.output(rig.follower, "status").number == 3


def test_more_looks_that_nobody_needs_are_left_out():
    for motion, looks in ((still_motion(), 1), (None, 0)):
        planner = {"more looks": motion, "else": still_motion()}
        rig = Rig(motion_planner=planner)
        rig.advance_to_end()
        assert rig.phases == ALL
        times = [time for time, name, _ in rig.status.events if name == "phase"]
        scan = times[ALL.index("SEGMENT")] - times[ALL.index("SCAN")]
        # A few decisions of 20 ms come on top.
        assert scan == pytest.approx((1 + looks) * DURATION, abs=0.2)


def test_camera_is_wanted_in_look_and_scan_alone():
    rig = Rig()
    wanted = set()

    def note() -> bool:
        if rig.output(rig.cycle, "camera_enabled")[0]:
            wanted.add(rig.status.phase)
        return rig.status.finished

    rig.advance_until(note)
    assert wanted == {Phase.LOOK, Phase.SCAN}


def test_review_waits_for_approval():
    rig = Rig(unattended=False)
    rig.advance_until(lambda: rig.status.phase == Phase.REVIEW)
    rig.simulator.AdvanceTo(rig.context.get_time() + 5.0)
    assert rig.status.phase == Phase.REVIEW
    rig.say("approve")
    rig.advance_to_end()
    assert rig.phases == ALL


def test_pause_lets_the_stroke_end_and_resume_goes_on():
    rig = Rig()
    rig.advance_until(lambda: rig.trigger == 1.0)
    rig.say("pause")
    rig.simulator.AdvanceTo(rig.context.get_time() + 0.1)
    assert rig.trigger == 1.0
    rig.advance_until(lambda: rig.status.phase == Phase.PAUSED)
    rig.simulator.AdvanceTo(rig.context.get_time() + 3.0)
    assert rig.trigger == 0.0
    assert rig.output(rig.follower, "status").rate == 0.0
    rig.say("resume")
    rig.advance_to_end()
    assert rig.phases == [*ALL[:7], "PAUSED", "PAINT", "RETRACT", "DONE"]


def test_abort_closes_the_gun_stands_and_retracts():
    rig = Rig()
    rig.advance_until(lambda: rig.trigger == 1.0)
    rig.say("abort")
    rig.simulator.AdvanceTo(rig.context.get_time() + 0.05)
    assert rig.trigger == 0.0
    rig.advance_to_end()
    assert rig.phases[-1] == "ABORTED"
    assert "operator" in rig.status.cause
    assert rig.status.code == "PNT-CYCLE-016"
    # The retract motion ran: HOME, LOOK, SCAN, more looks, PAINT and then the sixth.
    assert rig.output(rig.follower, "status").number == 6


def test_a_stopped_job_knows_with_which_stroke_it_goes_on():
    rig = Rig()
    assert rig.status.next_stroke == 0.0
    rig.advance_until(lambda: rig.trigger == 1.0)
    opened = rig.context.get_time()
    rig.advance_until(lambda: rig.context.get_time() > opened + 0.1)
    rig.say("abort")
    rig.advance_until(lambda: rig.trigger == 0.0)
    closed = rig.context.get_time()
    rig.advance_to_end()
    expected = 1.0 + (closed - opened) / (SPRAY[1] - SPRAY[0])
    # Decisions and looks at them are a period of 0.02 s apart each.
    assert rig.status.next_stroke == pytest.approx(expected, abs=0.04 / 0.3)
    assert 1.0 < rig.status.next_stroke < 2.0
    (data,) = (data for _, name, data in rig.status.events if name == "stopped")
    assert data["next_stroke"] == rig.status.next_stroke


def test_a_command_out_of_place_is_logged_as_refused():
    rig = Rig()
    rig.advance_until(lambda: rig.status.phase == Phase.LOOK)
    rig.say("approve")
    rig.advance_to_end()
    refused = [data for _, name, data in rig.status.events if name == "refused"]
    assert refused == [{"command": "approve"}]
    assert rig.phases == ALL


def test_failed_stage_ends_in_fault_with_its_cause():
    rig = Rig(
        spray_path_planner=ReachError("row 3 is out of reach", code="PNT-TEST-001")
    )
    rig.advance_to_end()
    assert rig.phases == [*ALL[:5], "FAULT"]
    assert rig.status.cause == "spray_path_planner: ReachError: row 3 is out of reach"
    assert rig.status.code == "PNT-TEST-001"
    (data,) = (data for _, name, data in rig.status.events if name == "stopped")
    assert data == {"cause": rig.status.cause, "code": "PNT-TEST-001"}


def test_an_answer_of_another_type_ends_in_fault_and_names_both_types():
    rig = Rig(wall_segmenter=WALL)
    rig.advance_to_end()
    assert rig.phases == [*ALL[:4], "FAULT"]
    assert rig.status.cause == "wall_segmenter returned Wall, expected WallSegmentation"
    assert rig.status.code == "PNT-CYCLE-018"


def test_a_failure_without_a_code_gets_one():
    dut = PaintCycle(unattended=True, period=0.02, look_time=0.5, time_limit=60.0)
    simulator = Simulator(dut)
    context = simulator.get_mutable_context()
    failed = StageResult(number=1, error="no way home")
    for port in ("wall_finder", "wall_segmenter", "spray_path_planner"):
        dut.GetInputPort(port).FixValue(context, Value(StageResult()))
    dut.GetInputPort("motion_planner").FixValue(context, Value(failed))
    dut.GetInputPort("arm_status").FixValue(context, Value(ArmStatus()))
    dut.GetInputPort("follower_status").FixValue(context, Value(FollowerStatus()))
    simulator.AdvanceTo(0.1)
    status = dut.GetOutputPort("cycle_status").Eval(context)
    assert (status.cause, status.code) == (
        "motion_planner: no way home",
        "PNT-CYCLE-017",
    )


def test_why_the_body_stopped_comes_before_its_drives():
    drives = (DriveStatus("FAULT", 0x7500), *(DriveStatus(),) * 4)
    stopped = Fault("SYNC is late", code="PNT-TEST-002")
    assert ArmStatus(drives=drives).fault.code == "PNT-CYCLE-014"
    assert ArmStatus(drives=drives, stopped=stopped).fault is stopped
    assert ArmStatus().fault is None


def test_drive_fault_closes_the_gun_and_stops_the_arm():
    rig = Rig()
    rig.advance_until(lambda: rig.trigger == 1.0)
    drives = (DriveStatus(), DriveStatus("FAULT", 0x7500), *(DriveStatus(),) * 3)
    rig.set("arm_status", ArmStatus(drives=drives))
    rig.simulator.AdvanceTo(rig.context.get_time() + 0.05)
    assert rig.trigger == 0.0
    rig.advance_to_end()
    assert rig.status.phase == Phase.FAULT
    assert rig.status.cause == "drive 2: FAULT, fault code 0x7500"
    assert rig.status.code == "PNT-CYCLE-014"
    assert rig.output(rig.follower, "status").rate == 0.0


def test_a_cycle_over_its_time_limit_is_a_fault():
    rig = Rig(unattended=False, time_limit=8.0)
    rig.advance_to_end()
    assert rig.status.phase == Phase.FAULT
    assert "8 s" in rig.status.cause
    assert rig.status.code == "PNT-CYCLE-015"
