import itertools

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw

from perception.config import StereoConfig
from perception.mapping.config import MapperConfig
from perception.mapping.pose_graph.poses import angle_deg
from perception.mapping.sessions.mapper import Mapper
from perception.mapping.sessions.places import (
    NotLocalisedError,
    Places,
    joined,
    localise,
)
from perception.synthetic.sequences import SequenceConfig, WallKind, render_sequence

# Where the base was put afterwards, seen from where it was.
X_MW = RigidTransform(RollPitchYaw(0.1, -0.05, 0.6), [0.8, -0.3, 0.2])


def graph_of(frames, intrinsics, X=None):
    """A session's graph; its arm stands at `X` in the first one's world."""
    mapper = Mapper(intrinsics, MapperConfig())
    for frame in frames:
        X_WC = frame.X_WC if X is None else X.inverse() @ frame.X_WC
        mapper.add(frame.replace(X_WC=X_WC))
    return mapper.graph.solved().graph


@pytest.fixture(scope="module")
def frames(textured_scan):
    return [frame for frame, _ in textured_scan]


@pytest.fixture(scope="module")
def known(frames, intrinsics):
    return graph_of(frames[:11], intrinsics)


@pytest.fixture(scope="module")
def moved(frames, intrinsics):
    return graph_of(frames[7:], intrinsics, X_MW)


def test_a_keyframe_is_likeliest_where_it_was_taken(known):
    places = Places(known.keyframes)
    for number, keyframe in enumerate(known.keyframes):
        assert places.likely(keyframe.features, 3)[0] == number


def test_a_moved_base_is_found_again(known, moved):
    found = localise(known, moved)
    off = X_MW.inverse() @ found.X_MW
    # A quarter of the D435's pixels: PnP at 0.7 m is good to some mm.
    assert np.linalg.norm(off.translation()) < 0.015
    assert angle_deg(off.rotation()) < 0.6
    assert found.agreeing >= 3


def test_joined_sessions_are_one_map(known, moved, textured_scan):
    found = localise(known, moved)
    graph = joined(known, moved, found.X_MW).solved().graph
    count = len(known.keyframes)
    assert len(graph.keyframes) == count + len(moved.keyframes)
    assert any(constraint.i < count <= constraint.j for constraint in graph.constraints)
    truth = {frame.time: X for frame, X in textured_scan}
    first, last = graph.keyframes[0], graph.keyframes[-1]
    X_true = truth[first.time].inverse() @ truth[last.time]
    off = X_true.inverse() @ graph.poses[0].inverse() @ graph.poses[-1]
    assert np.linalg.norm(off.translation()) < 0.006


def test_another_wall_is_not_taken_for_this_one(known, intrinsics):
    config = SequenceConfig(
        wall=WallKind.TEXTURED,
        rate=2.5,
        stereo=StereoConfig(width=424, height=240, fattening=5),
    )
    other = [frame for frame, _ in itertools.islice(render_sequence(config, 8), 8)]
    with pytest.raises(NotLocalisedError, match="is not joined"):
        localise(known, graph_of(other, intrinsics))


def test_bare_walls_cannot_be_told_apart(known, blank_scan, intrinsics):
    bare = graph_of([frame for frame, _ in blank_scan[:6]], intrinsics)
    with pytest.raises(NotLocalisedError, match=r"^0 of \d+ keyframes are recognised"):
        localise(known, bare)
