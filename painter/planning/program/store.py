"""Paint programs on disk: `program.json` and `trajectory.npz` of a folder."""

import json
import os
import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from pydrake.math import RigidTransform

from painter.errors import InputError
from painter.planning.film.preview import FilmPreview
from painter.planning.spray_path import Motion, PaintProgram, SkippedStroke, Stroke
from perception.ground import FloatArray

PROGRAM_FILE = "program.json"
TRAJECTORY_FILE = "trajectory.npz"
_LITRES = 1000.0  # In a cubic metre.


def program_summary(program: PaintProgram) -> dict[str, Any]:
    """Returns a program's figures: JSON values, SI unless the name has the unit."""
    return {
        "strokes": len(program.strokes),
        "stroke_length": float(sum(stroke.length for stroke in program.strokes)),
        "paint_litres": _LITRES * program.paint_volume,
        "duration": program.motion.duration,
        "standoff": program.standoff,
        "nominal_thickness": program.nominal_thickness,
        "skipped_strokes": len(program.skipped),
        "skipped_length": float(sum(item.stroke.length for item in program.skipped)),
    }


def save_program(
    folder: Path, program: PaintProgram, preview: FilmPreview | None = None
) -> None:
    """Writes a program; each of the two files is written whole or not at all.

    Args:
        folder: Existing folder to write to.
        program: The program.
        preview: The film that it will leave; its figures and map are written too.
    """
    motion = program.motion
    strokes = [
        _stroke_fields(stroke) | {"trigger_on": float(on), "trigger_off": float(off)}
        for stroke, (on, off) in zip(program.strokes, motion.spray_on, strict=True)
    ]
    document = {
        "units": "m, s; strokes in T; trigger times from the start of the motion",
        "summary": program_summary(program),
        "X_WT": program.X_WT.GetAsMatrix4().tolist(),
        "standoff": program.standoff,
        "nominal_thickness": program.nominal_thickness,
        "paint_volume": program.paint_volume,
        "predicted": None if preview is None else preview.figures._asdict(),
        "strokes": strokes,
        "skipped": [
            _stroke_fields(item.stroke) | {"reason": item.reason}
            for item in program.skipped
        ],
    }
    trigger = np.array([motion.trigger(time) for time in motion.time])
    arrays = {"time": motion.time, "q": motion.q, "v": motion.v, "trigger": trigger}
    if preview is not None:
        arrays["predicted_film"] = preview.film.astype(np.float32)
    draft = folder / f".{TRAJECTORY_FILE}"  # savez would append .npz to another suffix.
    np.savez_compressed(draft, **arrays)  # type: ignore[arg-type]
    os.replace(draft, folder / TRAJECTORY_FILE)
    draft = folder / f".{PROGRAM_FILE}"
    draft.write_text(json.dumps(document, indent=1, allow_nan=False) + "\n")
    os.replace(draft, folder / PROGRAM_FILE)


def load_program(folder: Path) -> PaintProgram:
    """Reads what `save_program` wrote.

    Args:
        folder: With both files.

    Raises:
        InputError: A file is missing, cut short or lacks a field; names it.
    """
    path = folder / PROGRAM_FILE
    try:
        document = json.loads(path.read_text())
        strokes = tuple(_stroke(item) for item in document["strokes"])
        spray_on = [[s["trigger_on"], s["trigger_off"]] for s in document["strokes"]]
        skipped = tuple(
            SkippedStroke(_stroke(item), str(item["reason"]))
            for item in document["skipped"]
        )
        motion = _load_motion(
            folder / TRAJECTORY_FILE,
            np.reshape(spray_on, (-1, 2)),
            np.array([stroke.flow for stroke in strokes]),
        )
        return PaintProgram(
            strokes=strokes,
            motion=motion,
            X_WT=RigidTransform(np.array(document["X_WT"], dtype=float)),
            standoff=float(document["standoff"]),
            nominal_thickness=float(document["nominal_thickness"]),
            paint_volume=float(document["paint_volume"]),
            skipped=skipped,
        )
    except OSError as error:
        raise InputError(
            f"{path}: {error.strerror}.", code="PNT-PROGRAM-002"
        ) from error
    except KeyError as error:
        raise InputError(
            f"{path}: field {error.args[0]!r} is missing.", code="PNT-PROGRAM-003"
        ) from error
    except (ValueError, TypeError) as error:
        raise InputError(
            f"{path}: is not a paint program ({error}).", code="PNT-PROGRAM-004"
        ) from error


def _load_motion(path: Path, spray_on: FloatArray, flow: FloatArray) -> Motion:
    try:
        with np.load(path, allow_pickle=False) as file:
            return Motion(
                time=file["time"],
                q=file["q"],
                v=file["v"],
                spray_on=np.asarray(spray_on, dtype=float),
                flow=flow,
            )
    except KeyError as error:
        raise InputError(f"{path}: {error.args[0]}", code="PNT-PROGRAM-005") from error
    except (OSError, ValueError, EOFError, zipfile.BadZipFile, zlib.error) as error:
        raise InputError(
            f"{path}: not a readable .npz file ({error}).", code="PNT-PROGRAM-006"
        ) from error


def _stroke_fields(stroke: Stroke) -> dict[str, Any]:
    return {
        "start": stroke.start_T.tolist(),
        "end": stroke.end_T.tolist(),
        "speed": stroke.speed,
        "kind": stroke.kind,
        "column": stroke.column,
        "standoff": stroke.standoff,
        "flow": stroke.flow,
        "coat": stroke.coat,
    }


def _stroke(fields: dict[str, Any]) -> Stroke:
    return Stroke(
        start_T=np.array(fields["start"], dtype=float),
        end_T=np.array(fields["end"], dtype=float),
        speed=float(fields["speed"]),
        kind=str(fields["kind"]),
        column=int(fields["column"]),
        standoff=float(fields["standoff"]),
        flow=float(fields["flow"]),
        coat=int(fields["coat"]),
    )
