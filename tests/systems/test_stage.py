"""Stages: requests, failures, and the check of the ports of one's own."""

import numpy as np
import pytest
from pydrake.common.value import Value
from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import LeafSystem
from pydrake.systems.primitives import Adder

from painter.config import load_scenario
from painter.cycle.true_wall import true_segmentation
from painter.diagrams.brain import MakeBrain
from painter.errors import PortTypeError, ReachError
from painter.planning.program.remainder import Remainder
from painter.robot.robot_model import MakeRobotModel
from painter.systems.ports import CheckPorts
from painter.systems.stage import STAGES, Stage
from painter.systems.values import StageRequest, StageResult
from perception.values import SurfaceMap, Wall

WALL = Wall(X_WT=RigidTransform(), rms=0.001, inlier_count=1, inlier_share=1.0)


class Counting(Stage):
    """A finder that counts its requests and fails at the third."""

    def __init__(self):
        super().__init__(stage="wall_finder", period=0.1)
        self.count = 0

    def Work(self, context, goal):
        self.count += 1
        if self.count == 3:
            raise ReachError("too far", code="PNT-TEST-001")
        return self.count

    def Warning(self, context):
        return "look twice" if self.count == 2 else None


class Foreign(LeafSystem):
    """A segmenter that derives from no stage; each test spoils one port."""

    def __init__(self, wall=None, result="result", more=()):
        super().__init__()
        self.DeclareAbstractInputPort("request", Value(StageRequest()))
        self.DeclareAbstractInputPort("surface_map", Value(SurfaceMap.empty()))
        if isinstance(wall, int):
            self.DeclareVectorInputPort("wall", wall)
        else:
            self.DeclareAbstractInputPort("wall", Value(wall or StageResult()))
        for name in more:
            self.DeclareVectorInputPort(name, 1)
        index = self.DeclareAbstractState(Value(StageResult()))
        self.DeclareStateOutputPort(result, index)


def test_each_request_is_answered_once_and_failures_carry_their_code():
    dut = Counting()
    simulator = Simulator(dut)
    context = simulator.get_mutable_context()
    surface = SurfaceMap.empty()
    dut.GetInputPort("surface_map").FixValue(context, Value(surface))
    results = []
    for number, stage in ((0, ""), (1, "wall_finder"), (2, "wall_finder")):
        request = StageRequest(number, stage)
        dut.GetInputPort("request").FixValue(context, Value(request))
        simulator.AdvanceTo(context.get_time() + 0.25)
        results.append(dut.GetOutputPort("result").Eval(context))
    assert [result.number for result in results] == [0, 1, 2]
    assert [result.value for result in results] == [None, 1, 2]
    assert [result.warning for result in results] == [None, None, "look twice"]
    # Not for this stage, and then the request at which it fails.
    for number, stage in ((3, "wall_segmenter"), (4, "wall_finder")):
        request = StageRequest(number, stage)
        dut.GetInputPort("request").FixValue(context, Value(request))
        simulator.AdvanceTo(context.get_time() + 0.25)
    assert dut.count == 3
    result = dut.GetOutputPort("result").Eval(context)
    assert (result.number, result.value) == (4, None)
    assert (result.error, result.code) == ("ReachError: too far", "PNT-TEST-001")


def test_inputs_are_read_with_their_kind():
    class Reading(Stage):
        def __init__(self):
            super().__init__(stage="motion_planner")

        def Work(self, context, goal):
            wall = self.ReadAnswer(context, "wall", Wall)
            return self.Read(context, "state")[9], wall, goal

    dut = Reading()
    simulator = Simulator(dut)
    context = simulator.get_mutable_context()
    request = StageRequest(1, "motion_planner", "home")
    dut.GetInputPort("request").FixValue(context, Value(request))
    dut.GetInputPort("state").FixValue(context, np.arange(10.0))
    dut.GetInputPort("wall").FixValue(context, Value(StageResult(1, WALL)))
    simulator.AdvanceTo(0.01)
    assert dut.GetOutputPort("result").Eval(context).value == (9.0, WALL, "home")


CONTRACT = {"request": StageRequest(), **STAGES["wall_segmenter"].inputs}


def check(system):
    CheckPorts("segmenter", system, CONTRACT, {"result": StageResult()})


def test_a_system_with_the_ports_is_taken_whatever_its_base():
    check(Foreign())


@pytest.mark.parametrize(
    ("system", "problem"),
    [
        (
            Foreign(wall=3),
            r"missing ports: input wall \(painter.systems.values.StageResult\); "
            r"wrong ports: input wall \(vector of 3\)\.",
        ),
        (Foreign(wall=WALL), r"wrong ports: input wall \(perception.values.Wall\)\."),
        (
            Foreign(result="answer"),
            r"missing ports: output result .*; wrong ports: output answer ",
        ),
        (
            Foreign(more=["speed"]),
            r"segmenter Foreign: missing ports: none; wrong ports: input speed ",
        ),
        (
            Counting(),
            r"Counting: missing ports: input wall .*; wrong ports: none\. Expected",
        ),
    ],
)
def test_each_wrong_port_is_named_with_what_is_expected(system, problem):
    with pytest.raises(PortTypeError, match=problem) as caught:
        check(system)
    assert caught.value.code == "PNT-CYCLE-012"
    assert "output result (painter.systems.values.StageResult)" in str(caught.value)


@pytest.fixture(scope="module")
def job():
    """A scenario and its robot."""
    scenario = load_scenario("blank")
    return scenario, MakeRobotModel(scenario)


@pytest.mark.parametrize(
    ("own", "name"),
    [
        ({"finder": Foreign()}, "wall_finder Foreign"),
        ({"planner": Foreign()}, "spray_path_planner Foreign"),
        ({"mover": Foreign()}, "motion_planner Foreign"),
        ({"accumulator": Adder(2, 1)}, "map_accumulator Adder"),
    ],
)
def test_the_brain_refuses_other_ports(job, own, name):
    with pytest.raises(PortTypeError, match=name):
        MakeBrain(*job, **own)


def test_the_brain_takes_a_system_of_ones_own(job):
    own = Foreign()
    brain = MakeBrain(*job, segmenter=own)
    assert brain.GetSubsystemByName("wall_segmenter") is own
    assert own.get_name() == "wall_segmenter"


def test_an_unknown_keyword_is_refused(job):
    with pytest.raises(TypeError, match="segmentor: replace finder, segmenter, "):
        MakeBrain(*job, segmentor=Foreign())


def test_a_known_wall_takes_no_segmenter(job):
    known = Remainder(segmentation=true_segmentation(job[0]), strokes=())
    with pytest.raises(ValueError, match="wall and strokes are known"):
        MakeBrain(*job, remainder=known, segmenter=Foreign())
