"""What the mapper keeps in memory and solves for is bounded, however long it runs."""

import gc
import tracemalloc

import numpy as np
import pytest
from pydrake.math import RigidTransform, RotationMatrix

from perception.depth_camera.depth import CameraIntrinsics
from perception.io.frames import Frame
from perception.mapping.config import MapperConfig
from perception.mapping.keyframes.keyframe import find_features, make_keyframe
from perception.mapping.keyframes.view import View
from perception.mapping.keyframes.working_set import WorkingSet
from perception.mapping.pose_graph import keyframe_graph
from perception.mapping.sessions.mapper import Mapper

CAMERA = CameraIntrinsics(fx=130.0, fy=130.0, cx=119.5, cy=71.5, width=240, height=144)
LOOKING = RotationMatrix(np.diag([1.0, -1.0, -1.0]))
SIZE = 8
CONFIG = MapperConfig(working_set=SIZE)


def frame_at(number, x):
    """A wall 0.7 m ahead, seen square, with a pattern that differs from each place."""
    rng = np.random.default_rng(number)
    depth_mm = np.full((CAMERA.height, CAMERA.width), 700, np.uint16)
    color = rng.integers(0, 255, (*depth_mm.shape, 3), dtype=np.uint8)
    return Frame(float(number), depth_mm, color, RigidTransform(LOOKING, [x, 0, 0.7]))


def to_and_fro(count):
    """Frames 0.15 m apart, along ten places and back again: each is a keyframe."""
    places = 0.15 * np.abs((np.arange(count) + 9) % 18 - 9)
    return [frame_at(number, x) for number, x in enumerate(places)]


def keyframe_of(frame):
    features = find_features(frame, CAMERA, CONFIG)
    return make_keyframe(frame, int(frame.time), features, CAMERA, CONFIG)


def views_alive():
    gc.collect()
    return sum(type(thing) is View for thing in gc.get_objects())


def assert_equal(view, other):
    np.testing.assert_array_equal(view.z, other.z)
    for name, array in vars(other.features).items():
        np.testing.assert_array_equal(getattr(view.features, name), array)
    assert (view.picture is None) == (other.picture is None)
    if other.picture is not None:
        assert vars(view.picture) == vars(other.picture)


@pytest.fixture
def sizes(monkeypatch):
    """Unknown poses, keyframes and constraints of everything that is solved."""
    seen = []

    class Spy(keyframe_graph.Graph):
        def __init__(self, problem, config):
            held = 0 if problem.settled is None else problem.settled.keyframes.sum()
            count = len(problem.X_WC)
            seen.append((count - held, count, len(problem.constraints)))
            super().__init__(problem, config)

    monkeypatch.setattr(keyframe_graph, "Graph", Spy)
    return seen


def test_views_come_back_from_the_file_as_they_were():
    dut = WorkingSet(2)
    keyframes = [keyframe_of(frame) for frame in to_and_fro(6)]
    keyframes[1] = keyframes[1].replace(source=View(keyframes[1].z))
    taken = [dut.take(k, keyframe) for k, keyframe in enumerate(keyframes)]
    assert dut.members == [4, 5]
    for keyframe, other in zip(taken, keyframes, strict=True):
        assert_equal(keyframe.source.view(), other.source.view())


def test_what_was_used_last_stays():
    dut = WorkingSet(3)
    taken = [dut.take(k, keyframe_of(f)) for k, f in enumerate(to_and_fro(3))]
    assert taken[0].z.any()
    dut.take(3, keyframe_of(frame_at(3, 0.0)))
    assert dut.members == [0, 2, 3]


def test_a_working_set_of_nothing_is_refused():
    with pytest.raises(ValueError, match="got 0"):
        WorkingSet(0)


def test_five_times_the_frames_take_no_more_memory_and_unknowns(sizes):
    before = views_alive()
    dut = Mapper(CAMERA, CONFIG)
    frames = to_and_fro(6 * SIZE)
    tracemalloc.start()
    traced = []
    for frame in frames:
        dut.add(frame)
        if len(dut.graph.keyframes) % SIZE == 0:
            assert views_alive() - before <= SIZE
            traced.append(tracemalloc.get_traced_memory()[0])
    tracemalloc.stop()
    assert len(dut.graph.keyframes) == 6 * SIZE
    assert len(dut.graph.constraints) > 3 * SIZE
    # Poses, planes and constraints stay: some 7 kB a keyframe of this camera.
    view = dut.graph.keyframes[-1].source.view()
    assert (traced[-1] - traced[1]) / (4 * SIZE) < 10e3 < 0.5 * len(view.packed())
    members, keyframes, constraints = np.max(sizes, axis=0)
    assert members <= SIZE
    assert constraints <= SIZE * CONFIG.max_links
    assert keyframes <= SIZE * (1 + CONFIG.max_links)
    # The last answer is of all.
    dut.finish()
    assert max(sizes)[0] == 6 * SIZE


def test_short_sequences_are_solved_as_without_a_bound(blank_scan, intrinsics):
    poses = []
    for size in (3, 100):
        dut = Mapper(intrinsics, MapperConfig(working_set=size))
        for frame, _ in blank_scan:
            dut.add(frame)
        poses.append([X.GetAsMatrix34() for _, X in dut.finish().poses])
        assert len(dut.graph.keyframes) > 3 * 3
    # Constraints are looked for from slightly other guesses; the last answer is of all.
    np.testing.assert_allclose(poses[0], poses[1], atol=1e-4)
