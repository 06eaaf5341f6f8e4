"""A recorded RGB-D sequence from its folder to the files of a map."""

import json
from collections.abc import Callable, Iterable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from perception.depth_camera.depth import CameraIntrinsics
from perception.errors import CloudReadError
from perception.io.bag_frames import unpack_bag
from perception.io.bags import BAG_SUFFIXES
from perception.io.frames import Frame, open_recording, write_poses
from perception.mapping.config import MapperConfig
from perception.mapping.fusion.fusion import write_map, write_mesh, write_voxels
from perception.mapping.sessions.mapper import Mapper, MappingResult
from perception.mapping.sessions.report import session_report
from perception.mapping.sessions.session import join_map, run_session
from perception.mapping.sessions.store import MapStore

MAP_SUFFIX = ".db"


@dataclass(frozen=True, eq=False)
class MappedSequence:
    """The map of a sequence.

    Attributes:
        result: Poses of the frames, keyframes and the fused surface.
        report: Figures as JSON values: frames, constraints, corrections, observed
            directions, timings.
    """

    result: MappingResult
    report: dict[str, Any]

    def save(
        self, folder: Path, *, mesh: bool = False, voxels: float | None = None
    ) -> None:
        """Writes poses.txt, map.ply and map.json.

        Args:
            folder: Where to write; exists.
            mesh: Whether mesh.ply is written too.
            voxels: Edge of the cubes of voxels.npz, m; None = it is not written.
        """
        fused = self.result.fused
        write_poses(folder / "poses.txt", self.result.poses)
        write_map(folder / "map.ply", fused)
        if mesh:
            self.report["triangles"] = write_mesh(folder / "mesh.ply", fused)
        if voxels is not None:
            count = write_voxels(folder / "voxels.npz", fused, voxels)
            self.report["voxels"] = count
        text = json.dumps(self.report, indent=2, allow_nan=False)
        (folder / "map.json").write_text(text + "\n")


def map_sequence(
    frames: Path | str,
    *,
    config: MapperConfig | None = None,
    poses: Path | None = None,
    use_poses: bool = True,
    store: Path | None = None,
    onto: Path | None = None,
    show: Callable[[float, str], None] = lambda share, text: None,
) -> MappedSequence:
    """Maps a recorded RGB-D sequence: corrects its poses and fuses one surface.

    Example: `map_sequence("frames").result.fused.p_WQs`.

    Args:
        frames: Folder in TUM RGB-D form or of numbered frames, RealSense recording
            (.bag, .db3), or map file (.db) that is mapped again.
        config: Settings of the mapper; None = the defaults.
        poses: Poses of the arm in TUM form, X_WC; None = those of the recording.
        use_poses: Whether the poses of the recording are used, if it has any.
        store: Map file in which the session is kept; an interrupted one continues.
        onto: Map file in which the sequence is localised by appearance, after the base
            was moved; both are mapped as one. The file does not change.
        show: Called with the share of the frames that is done, 0 to 1, and the frame.

    Raises:
        CloudReadError: A file is unusable.
        NoMapError: No valid map can be made.
        NotLocalisedError: The sequence is not recognised in the map `onto`.
    """
    frames = Path(frames)
    config = MapperConfig() if config is None else config
    with ExitStack() as stack:
        intrinsics, source, total = _open_source(stack, frames, poses, use_poses)
        session = None
        if store is not None:
            if store.resolve() == frames.resolve():
                raise CloudReadError(
                    f"{store}: cannot be mapped into itself; give another store.",
                    code="PNT-USE-026",
                )
            session = stack.enter_context(MapStore(store))
            session.start(intrinsics, config)
        mapper = Mapper(intrinsics, config)
        result = run_session(
            mapper,
            source,
            session,
            lambda number: show(number / total, f"frame {number + 1} of {total}"),
        )
        joined: dict[str, Any] = {}
        if onto is not None:
            result, joined = _join(stack, mapper, onto)
        report = session_report(mapper, result) | joined
    return MappedSequence(result, report)


def open_map(path: Path) -> MapStore:
    """Opens an existing map file.

    Raises:
        CloudReadError: There is none, or it holds no keyframes.
    """
    if not path.is_file():
        raise CloudReadError(f"{path}: no such file.", code="PNT-USE-031")
    store = MapStore(path)
    if store.intrinsics is None or not len(store):
        store.close()
        raise CloudReadError(f"{path}: holds no keyframes.", code="PNT-USE-032")
    return store


def _open_source(
    stack: ExitStack, path: Path, poses: Path | None, use_poses: bool
) -> tuple[CameraIntrinsics, Iterable[Frame], int]:
    """Returns the camera, the frames and their number."""
    if path.suffix in BAG_SUFFIXES:
        folder = Path(stack.enter_context(TemporaryDirectory()))
        unpack_bag(path, folder)
        path = folder
    if path.suffix != MAP_SUFFIX:
        recording = open_recording(path, poses=poses, use_poses=use_poses)
        return recording.intrinsics, recording.frames(), len(recording.entries)
    old = stack.enter_context(open_map(path))
    assert old.intrinsics is not None  # A map that is opened has a camera.
    frames = (frame for _, frame, _, _ in old.keyframes())
    if not use_poses:
        frames = (frame.replace(X_WC=None) for frame in frames)
    return old.intrinsics, frames, len(old)


def _join(
    stack: ExitStack, mapper: Mapper, onto: Path
) -> tuple[MappingResult, dict[str, Any]]:
    """Joins the session to a stored map; returns the result and its figures."""
    known = stack.enter_context(open_map(onto))
    if known.intrinsics != mapper.graph.intrinsics:
        raise CloudReadError(
            f"{onto}: was made with another camera.", code="PNT-USE-027"
        )
    result, found = join_map(mapper, known)
    figures = {
        "X_MN": found.X_MW.GetAsMatrix4().round(6).tolist(),
        "keyframes_agreeing": found.agreeing,
        "keyframes_recognised": found.found,
    }
    return result, {"joined": figures}
