import itertools

import numpy as np
import pytest

from perception.errors import CloudReadError
from perception.mapping.config import MapperConfig
from perception.mapping.sessions.mapper import Mapper
from perception.mapping.sessions.session import run_session
from perception.mapping.sessions.store import MapStore

CONFIG = MapperConfig()


def breaking(frames, count):
    yield from itertools.islice(frames, count)
    raise KeyboardInterrupt


def test_a_broken_session_goes_on_to_the_same_map(blank_scan, intrinsics, tmp_path):
    frames = [frame for frame, _ in blank_scan]
    whole = run_session(Mapper(intrinsics, CONFIG), frames)
    with MapStore(tmp_path / "map.db") as store:
        store.start(intrinsics, CONFIG)
        with pytest.raises(KeyboardInterrupt):
            run_session(Mapper(intrinsics, CONFIG), breaking(frames, 11), store)
    shown = []
    with MapStore(tmp_path / "map.db") as store:
        kept = len(store)
        dut = Mapper(intrinsics, CONFIG)
        result = run_session(dut, frames, store, shown.append)
        assert len(store) == len(dut.graph.keyframes) > kept > 2
    assert len(result.poses) == len(whole.poses) == len(frames)
    assert sum(dut.outcomes.values()) == len(frames)
    for (time, X), (time_2, X_2) in zip(result.poses, whole.poses, strict=True):
        assert time == time_2
        # The order in which the graph was solved differs, not what it knows.
        np.testing.assert_allclose(X.GetAsMatrix34(), X_2.GetAsMatrix34(), atol=2e-4)


def test_pictures_and_links_come_back_as_they_were(textured_scan, intrinsics, tmp_path):
    frames = [frame for frame, _ in textured_scan[:6]]
    dut = Mapper(intrinsics, CONFIG)
    with MapStore(tmp_path / "map.db") as store:
        store.start(intrinsics, CONFIG)
        run_session(dut, frames, store)
    by_time = {frame.time: frame for frame in frames}
    with MapStore(tmp_path / "map.db") as store:
        assert (store.intrinsics, store.config) == (intrinsics, CONFIG)
        rows = list(store.keyframes())
    constraints = [constraint for row in rows for constraint in row[3]]
    assert len(constraints) == len(dut.graph.constraints) > 0
    for old, new in zip(dut.graph.constraints, constraints, strict=True):
        assert (new.i, new.j, new.kind, new.inliers) == (
            old.i,
            old.j,
            old.kind,
            old.inliers,
        )
        np.testing.assert_array_equal(new.information, old.information)
    for _, frame, X_WC, _ in rows:
        np.testing.assert_array_equal(frame.depth_mm, by_time[frame.time].depth_mm)
        np.testing.assert_array_equal(frame.color, by_time[frame.time].color)
        assert X_WC.rotation().IsValid()


def test_files_that_are_none_of_ours_are_refused(intrinsics, tmp_path):
    (tmp_path / "text.db").write_text("no database, but long enough to be read as one")
    with pytest.raises(CloudReadError, match=r"text\.db: is not a map file"):
        MapStore(tmp_path / "text.db")
    with MapStore(tmp_path / "map.db") as store:
        store.start(intrinsics, CONFIG)
        other = type(intrinsics)(fx=1, fy=1, cx=1, cy=1, width=2, height=2)
        with pytest.raises(CloudReadError, match="another camera"):
            store.start(other, CONFIG)
