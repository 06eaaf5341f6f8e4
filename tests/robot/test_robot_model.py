import pytest
from pydrake.multibody.parsing import Parser

from painter.config import Scenario
from painter.cycle.simulate import SimulateCycle
from painter.robot.robot_model import MakeRobotModel
from painter.robot.true_scene import true_scene
from painter.scene import Scene, dump_scene
from painter.scene.config import BaseErrorConfig


@pytest.fixture
def parsed(monkeypatch):
    """Collects the directives of the robot's models, once each time they are parsed."""
    found = []
    parse = Parser.AddModelsFromUrl

    def counted(parser, url):
        found.append(url)
        return parse(parser, url)

    monkeypatch.setattr(Parser, "AddModelsFromUrl", counted)
    return found


def test_limits_hold_the_scenarios_nozzle_speed(parsed):
    scenario = Scenario()
    dut = MakeRobotModel(scenario)
    assert parsed == [scenario.directives]
    assert dut.limits.nozzle_speed == scenario.motion.nozzle_speed
    assert dut.limits.nozzle == dut.kinematics.nozzle


def test_cycle_parses_the_robot_once_for_all_that_plans_and_logs(parsed):
    scenario = Scenario()
    log = SimulateCycle(scenario, watch=lambda *_: "abort")
    # The station has its own plant with the scene, and its drives' controller one.
    assert parsed == 3 * [scenario.directives]
    assert len(log.X_WG) == len(log.time) > 0


def test_scene_stands_off_its_nominal_pose_by_the_base_error(tmp_path):
    file = tmp_path / "moved.scene.yaml"
    moved = Scene(base_error=BaseErrorConfig(x=0.02, y=-0.01))
    file.write_text(dump_scene(moved))
    scenario = Scenario(scene=str(file))
    scene, X_WS = true_scene(scenario)
    tile = scenario.tile
    assert scene.base_error == moved.base_error
    assert X_WS.translation() == pytest.approx(
        [tile.distance + 0.02, tile.width / 2.0 - 0.01, tile.bottom]
    )
