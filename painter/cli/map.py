"""`painter map`: a recorded RGB-D sequence to camera poses and a map."""

import dataclasses
import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from painter.cli import common
from painter.cli.common import output_folder, print_result, progress
from painter.errors import InputError
from perception.settings import validate

if TYPE_CHECKING:
    from perception.mapping.config import MapperConfig

FramesArgument = Annotated[
    Path,
    typer.Argument(
        metavar="FRAMES",
        help="Folder in TUM RGB-D form or of numbered frames, RealSense recording "
        "(.bag, .db3), or map file (.db) to map again.",
    ),
]
PosesOption = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE",
        help="Poses of the camera in the world, from the arm, in TUM form.  [default: "
        "arm.txt or the numbered pose files]",
    ),
]
UsePosesOption = Annotated[
    bool, typer.Option(help="Use the poses of the recording, if it has any.")
]
StoreOption = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE.db",
        help="Keep the session in this file; an interrupted session continues.",
    ),
]
OntoOption = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE.db",
        help="Localise the frames in this map by appearance, after the base was moved, "
        "and map both as one. The file does not change.",
    ),
]
MeshOption = Annotated[bool, typer.Option(help="Write mesh.ply too.")]
VoxelsOption = Annotated[
    float | None,
    typer.Option(metavar="EDGE", help="Write voxels.npz too: cubes of this edge, m."),
]
MapSetOption = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help="Override a mapping value, in SI units, e.g. mapping.cell=0.01; "
        "repeatable.",
    ),
]


def map(
    frames: FramesArgument,
    out: common.Out,
    poses: PosesOption = None,
    use_poses: UsePosesOption = True,
    store: StoreOption = None,
    onto: OntoOption = None,
    mesh: MeshOption = False,
    voxels: VoxelsOption = None,
    overrides: MapSetOption = None,
    as_json: common.Json = False,
) -> None:
    """Map a recorded RGB-D sequence: correct its poses and fuse one surface.

    Writes poses.txt (TUM form), map.ply (normals, colours, counts, variances) and
    map.json (frames, links, corrections, observed directions, timings).
    """
    if voxels is not None and not 0.0 < voxels < math.inf:
        raise InputError(f"--voxels must be > 0 m, got {voxels!r}.", code="PNT-USE-025")
    from perception.mapping.sessions.map_sequence import map_sequence

    config = _mapper_config(overrides)
    with progress("Mapping") as show:
        mapped = map_sequence(
            frames,
            config=config,
            poses=poses,
            use_poses=use_poses,
            store=store,
            onto=onto,
            show=show,
        )
    with output_folder(out) as folder:
        mapped.save(folder, mesh=mesh, voxels=voxels)
    print_result(mapped.report, as_json=as_json)
    if not as_json:
        typer.echo(f"written to {out}")


def _mapper_config(overrides: list[str] | None) -> "MapperConfig":
    """Makes the mapper's settings.

    Args:
        overrides: Arguments of the form mapping.KEY=VALUE.

    Raises:
        InputError: An argument has another form, an unknown key or a value out of
            bounds.
    """
    from perception.mapping.config import MapperConfig

    defaults = dataclasses.asdict(MapperConfig())
    kinds = {name: type(value) for name, value in defaults.items()}
    values: dict[str, Any] = {}
    for override in overrides or ():
        key, equals, text = override.partition("=")
        name = key.removeprefix("mapping.")
        if not equals or name not in kinds:
            known = ", ".join(kinds)
            raise InputError(
                f"--set {override}: expected mapping.KEY=VALUE, KEY one of {known}.",
                code="PNT-USE-028",
            )
        try:
            values[name] = kinds[name](text)
        except ValueError:
            raise InputError(
                f"--set {override}: {text!r} is not a number.", code="PNT-USE-029"
            ) from None
    config = MapperConfig(**values)
    try:
        validate(config, "mapping")
    except ValueError as error:
        raise InputError(f"--set: {error}", code="PNT-USE-030") from error
    return config
