"""A hand-made log of a cycle in a run folder; the truth of a scene with a window."""

import json

import numpy as np
import pytest
from pydrake.math import RigidTransform

from painter.config import Scenario, dump_scenario
from painter.cycle.cycle_log import clearance_violations
from painter.cycle.write_run import event_watch, write_collisions, write_log
from painter.planning.config import ZoneConfig
from painter.planning.tile import nominal_tile_pose
from painter.run.folder.folder import FILM, SEGMENTATION, TRUTH, RunFolder
from painter.scene.config import OpeningConfig, Scene
from painter.scene.load import dump_scene
from painter.systems.simulated.paint_film import FilmState
from painter.systems.values import CycleStatus, FollowerStatus, Phase
from perception.values import WallSegmentation
from tests.cycle.hand_made_log import cycle_log

# x0, x1, y0, y1 in S, m.
WINDOW = (0.6, 1.4, 0.7, 1.6)
CELL = 0.01
MARGIN = 0.3


@pytest.fixture
def scenario(tmp_path):
    """A wall with a window, exactly where the job expects it."""
    x0, x1, y0, y1 = WINDOW
    window = OpeningConfig(x=x0, y=y0, width=x1 - x0, height=y1 - y0)
    file = tmp_path / "window.scene.yaml"
    file.write_text(dump_scene(Scene(openings=[window])))
    return Scenario(scene=str(file))


@pytest.fixture
def folder(scenario, tmp_path):
    return RunFolder.create(tmp_path / "run", dump_scenario(scenario))


def segmentation(X_WT):
    """A tile without anything on it, at a pose."""
    return WallSegmentation(
        labels=np.ones((200, 200), dtype=np.uint16),
        depth=np.zeros((200, 200), dtype=np.float32),
        wall_mask=np.ones((200, 200), dtype=bool),
        X_WT=X_WT,
        cell=CELL,
    )


def film():
    """100 µm on a grid 0.3 m larger than the tile on each side."""
    shape = (260, 260)
    return FilmState(
        np.full(shape, 100e-6 * CELL**2),
        cell=CELL,
        origin=np.array([-MARGIN, -MARGIN]),
        sprayed=2e-3,
        missed=1e-4,
    )


def in_window(x, y):
    return (x > WINDOW[0]) & (x < WINDOW[1]) & (y > WINDOW[2]) & (y < WINDOW[3])


def centres(count, start=0.0):
    edge = start + CELL * (np.arange(count) + 0.5)
    return np.meshgrid(edge, edge)


def test_a_log_without_a_wall_leaves_map_motion_and_picture(folder, scenario):
    picture = np.zeros((4, 6, 4), dtype=np.uint8)
    picture[:, :, 0] = 200
    write_log(folder, scenario, cycle_log(look_image=picture))
    np.testing.assert_allclose(folder.map_points(), [[1.0], [2.0], [3.0]])
    executed = folder.executed()
    np.testing.assert_array_equal(executed.time, [0.0, 1.0])
    np.testing.assert_array_equal(executed.trigger, [0.0, 1.0])
    assert (folder.path / "look.png").exists()
    for name in (SEGMENTATION, TRUTH, FILM):
        assert not (folder.path / name).exists()


def test_truth_is_the_scene_on_the_robots_own_cells(folder, scenario):
    # The robot believes its tile 0.1 m to the right of the true one.
    X_WT = nominal_tile_pose(scenario.tile) @ RigidTransform([0.1, 0.0, 0.0])
    write_log(folder, scenario, cycle_log(segmentation=segmentation(X_WT)))
    assert folder.truth() is None  # No film: nobody knows the truth.
    log = cycle_log(segmentation=segmentation(X_WT), film=film())
    write_log(folder, scenario, log)
    x, y = centres(200)
    on_wall = x + 0.1 < 2.0
    expected = ~in_window(x + 0.1, y)
    np.testing.assert_array_equal(folder.truth().wall_mask[on_wall], expected[on_wall])


def test_film_is_parted_into_paintable_and_keep_out(folder, scenario):
    corners = [[0.0, 0.0], [0.3, 0.0], [0.3, 2.0], [0.0, 2.0]]
    scenario.raster.zones = [ZoneConfig(kind="exclude", corners=corners)]
    X_WT = nominal_tile_pose(scenario.tile)
    before = film()
    log = cycle_log(segmentation=segmentation(X_WT), film=film())
    write_log(folder, scenario, log, before=before)
    found = folder.film()
    x, y = centres(260, -MARGIN)
    tile = (x > 0.0) & (x < 2.0) & (y > 0.0) & (y < 2.0)
    keep_out = in_window(x, y) | (x < 0.3)
    np.testing.assert_array_equal(found.truth_paintable, tile & ~keep_out)
    np.testing.assert_array_equal(found.truth_keepout, tile & keep_out)
    np.testing.assert_allclose(found.thickness, 100e-6)
    np.testing.assert_allclose(found.before, 100e-6)
    assert (found.x0, found.y0) == pytest.approx((-MARGIN, -MARGIN))
    assert (found.sprayed, found.missed) == pytest.approx((2e-3, 1e-4))
    # 2.6 m x 2.6 m of 100 µm.
    assert found.landed == pytest.approx(2.6**2 * 100e-6)


def test_each_episode_below_the_bound_is_one_violation_at_its_worst():
    time = np.arange(8.0)
    distance = np.array([0.02, 0.09, 0.05, 0.03, 0.04, 0.09, 0.09, 0.01])
    assert clearance_violations(time, distance, 0.06) == [
        (0.0, 0.02),
        (3.0, 0.03),
        (7.0, 0.01),
    ]
    assert clearance_violations(time, distance, 0.01) == []


def test_collisions_are_logged_against_each_planned_clearance(folder, scenario):
    scenario.motion.clearance, scenario.motion.floor_clearance = 0.05, 0.03
    time = np.array([1.0, 2.0, 3.0])
    # Bounds are 0.02 m less: 0.03 m from the scene and 0.01 m from the floor.
    scene = np.array([0.031, 0.029, 0.031])
    floor = np.array([0.011, 0.011, 0.009])
    write_collisions(folder, scenario, time, scene, floor)
    events = [event for event in folder.events() if event.get("event") == "collision"]
    assert [event["time"] for event in events] == [2.0, 3.0]
    assert [event["distance_m"] for event in events] == pytest.approx([0.029, 0.009])
    assert [event["bound_m"] for event in events] == pytest.approx([0.03, 0.01])


def test_a_touching_robot_is_a_collision_however_small_the_clearance(folder, scenario):
    scenario.motion.clearance = 0.01
    far = np.array([0.3, 0.3])
    write_collisions(folder, scenario, np.arange(2.0), np.array([0.0, -0.001]), far)
    (event,) = folder.events()
    assert (event["distance_m"], event["bound_m"]) == (-0.001, 0.0)


def test_the_watch_logs_each_event_once_and_never_goes_back(folder):
    shown = []
    dut = event_watch(folder, lambda share, text: shown.append((share, text)))
    follower = FollowerStatus(number=1, position=5.0, duration=10.0)
    status = CycleStatus()
    phases = (Phase.HOME, Phase.SCAN, Phase.PAUSED, Phase.PAINT, Phase.DONE)
    for time, phase in enumerate(phases):
        status = status.replace(phase=phase)
        status = status.logged(float(time), "phase", phase=phase.value)
        for _ in range(2):
            assert dut(float(time), status, follower) is None
    lines = (folder.path / "events.jsonl").read_text().splitlines()
    assert [json.loads(line)["phase"] for line in lines] == [
        "HOME",
        "SCAN",
        "PAUSED",
        "PAINT",
        "DONE",
    ]
    shares = [share for share, _ in shown]
    assert shares == sorted(shares)
    assert (shares[0], shares[-1]) == (0.0, 1.0)
    assert max(shares[4:6]) < 0.5  # Paused in the scan.
    assert shown[-1][1] == "done, robot time 4 s"
