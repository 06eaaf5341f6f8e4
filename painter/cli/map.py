"""`painter map`: a recorded RGB-D sequence to poses and a map."""

import dataclasses
import json
import math
from collections.abc import Iterable
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated, Any

import typer

from painter.cli.common import (
    JsonOption,
    OutOption,
    output_folder,
    print_result,
    progress,
)
from painter.errors import InputError
from perception.depth_camera.depth import CameraIntrinsics
from perception.io.bag_frames import unpack_bag
from perception.io.bags import BAG_SUFFIXES
from perception.io.frames import Frame, open_recording, write_poses
from perception.mapping.config import MapperConfig
from perception.mapping.fusion.fusion import write_map, write_mesh, write_voxels
from perception.mapping.sessions.mapper import Mapper
from perception.mapping.sessions.report import session_report
from perception.mapping.sessions.session import join_map, run_session
from perception.mapping.sessions.store import MapStore

MAP_SUFFIX = ".db"


def map(
    frames: Annotated[
        Path,
        typer.Argument(
            metavar="FRAMES",
            help="Folder in TUM RGB-D form or of numbered frames, a RealSense "
            "recording (.bag, .db3), or a map file (.db) that is mapped again.",
        ),
    ],
    out: OutOption,
    poses: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Poses of the arm in TUM form, camera in world.  [default: arm.txt or "
            "the numbered pose files]",
        ),
    ] = None,
    use_poses: Annotated[
        bool, typer.Option(help="Use the poses of the recording, if it has any.")
    ] = True,
    store: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.db",
            help="Keep the session in this file; one that was broken off goes on.",
        ),
    ] = None,
    onto: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.db",
            help="Find by their looks where the frames lie in this map, after the base "
            "was moved, and map both as one. The file stays as it is.",
        ),
    ] = None,
    mesh: Annotated[bool, typer.Option(help="Write mesh.ply as well.")] = False,
    voxels: Annotated[
        float | None,
        typer.Option(
            metavar="EDGE", help="Write voxels.npz as well: cubes of this edge, m."
        ),
    ] = None,
    overrides: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="KEY=VALUE",
            help="Set a mapping value in SI units, e.g. mapping.cell=0.01; repeatable.",
        ),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Map a recorded RGB-D sequence: correct its poses and fuse one surface.

    Writes poses.txt (TUM form), map.ply (normals, colours, counts, variances), map.json
    (frames, links, corrections, observed directions, timings), and what else is wanted.
    """
    config = mapper_config(overrides)
    if voxels is not None and not 0.0 < voxels < math.inf:
        raise InputError(f"--voxels must be > 0 m, got {voxels!r}.", code="PNT-USE-025")
    with ExitStack() as stack:
        intrinsics, source, total = _source(stack, frames, poses, use_poses)
        session = None
        if store is not None:
            if store.resolve() == frames.resolve():
                raise InputError(
                    f"--store {store}: is the map file to be replayed.",
                    code="PNT-USE-026",
                )
            session = stack.enter_context(MapStore(store))
            session.start(intrinsics, config)
        mapper = Mapper(intrinsics, config)
        show = stack.enter_context(progress("mapping"))
        result = run_session(
            mapper,
            source,
            session,
            lambda number: show(number / total, f"frame {number + 1} of {total}"),
        )
        if onto is not None:
            known = stack.enter_context(open_map(onto))
            if known.intrinsics != intrinsics:
                raise InputError(
                    f"{onto}: was made with another camera.", code="PNT-USE-027"
                )
            result, found = join_map(mapper, known)
        report = session_report(mapper, result)
        if onto is not None:
            report["joined"] = {
                "X_MN": found.X_MN.GetAsMatrix4().round(6).tolist(),
                "keyframes_agreeing": found.agreeing,
                "keyframes_recognised": found.found,
            }
        folder = stack.enter_context(output_folder(out))
        write_poses(folder / "poses.txt", result.poses)
        write_map(folder / "map.ply", result.fused)
        if mesh:
            report["triangles"] = write_mesh(folder / "mesh.ply", result.fused)
        if voxels is not None:
            report["voxels"] = write_voxels(folder / "voxels.npz", result.fused, voxels)
        text = json.dumps(report, indent=2, allow_nan=False)
        (folder / "map.json").write_text(text + "\n")
    print_result(report, as_json=as_json)
    if not as_json:
        typer.echo(f"written to {out}")


def mapper_config(overrides: list[str] | None) -> MapperConfig:
    """Makes the settings.

    Args:
        overrides: Words of the form mapping.KEY=VALUE.

    Raises:
        InputError: A word has another form, an unknown key or a value out of bounds.
    """
    defaults = dataclasses.asdict(MapperConfig())
    kinds = {name: type(value) for name, value in defaults.items()}
    values: dict[str, Any] = {}
    for word in overrides or ():
        key, equals, text = word.partition("=")
        name = key.removeprefix("mapping.")
        if not equals or name not in kinds:
            known = ", ".join(kinds)
            raise InputError(
                f"--set {word}: expected mapping.KEY=VALUE, KEY of {known}.",
                code="PNT-USE-028",
            )
        try:
            values[name] = kinds[name](text)
        except ValueError:
            raise InputError(
                f"--set {word}: {text!r} is no number.", code="PNT-USE-029"
            ) from None
    config = MapperConfig(**values)
    try:
        config.validate()
    except ValueError as error:
        raise InputError(f"--set: {error}", code="PNT-USE-030") from error
    return config


def open_map(path: Path) -> MapStore:
    """Opens a map file that is there.

    Raises:
        InputError: There is none, or it holds no keyframes.
    """
    if not path.is_file():
        raise InputError(f"{path}: no such file.", code="PNT-USE-031")
    store = MapStore(path)
    if store.intrinsics is None or not len(store):
        store.close()
        raise InputError(f"{path}: holds no keyframes.", code="PNT-USE-032")
    return store


def _source(
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
