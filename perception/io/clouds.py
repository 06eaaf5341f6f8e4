"""Recorded clouds: read whole, or refused with the reason."""

import io
import math
import zipfile
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from perception.errors import CloudReadError
from perception.ground import FloatArray, FrozenValue
from perception.io.cloud_header import MAX_POINTS, CloudHeader, parse_pcd
from perception.io.lzf import lzf_decompress
from perception.io.ply import parse_ply

CLOUD_SUFFIXES = (".ply", ".pcd", ".xyz", ".npy", ".npz")
_NAMES = ("points", "xyz", "p_WQs")  # Of the array in an NPZ file, if it has several.
_LZF_MOST = 90  # Three bytes give at most 264.


@dataclass(frozen=True, eq=False)
class RecordedCloud(FrozenValue):
    """Points as a file holds them.

    Attributes:
        p_WQs: (3, N) float64, in the file's frame and unit; some may be non-finite.
        p_WC: (3,) where the sensor was, if the file says so.
    """

    p_WQs: FloatArray
    p_WC: FloatArray | None = None


def read_cloud(path: Path) -> RecordedCloud:
    """Reads the points of a cloud.

    NumPy reads PLY (ascii, binary) and PCD (ascii, binary, compressed), after checking
    the header against the length of the file. Open3D's readers return part of a
    truncated file, allocate whatever a damaged header asks for, and print.
    XYZ is text with x, y and z first in each line, separated by blanks, commas or
    semicolons; a first line of words is a heading. NPY is an array (N, 3) or (3, N),
    read as (N, 3) when it is 3 x 3; NPZ holds one such array, alone or named "points",
    "xyz" or "p_WQs".

    Args:
        path: The file; its suffix tells the form.

    Returns:
        The cloud; not all of its points are non-finite.

    Raises:
        CloudReadError: The file is missing, truncated, empty, of an unknown form or has
            no finite point; names the file and the reason.
    """
    suffix = path.suffix.lower()
    if suffix not in CLOUD_SUFFIXES:
        known = ", ".join(CLOUD_SUFFIXES)
        raise CloudReadError(
            f"{path}: unknown cloud format {suffix!r}; known: {known}.",
            code="PNT-CLOUD-001",
        )
    check_file(path)
    place = None
    if suffix in (".ply", ".pcd"):
        fields, header = _read_fields(path)
        xyz = [fields[name].astype(np.float64) for name in "xyz"]
        points = np.stack(xyz) if fields.size else np.zeros((3, 0))
        place = header.viewpoint
    elif suffix == ".xyz":
        points = _read_xyz(path)
    else:
        points = _read_array(path)
    return RecordedCloud(
        p_WQs=checked_points(path, points),
        p_WC=None if place is None else np.array(place),
    )


def read_fields(path: Path) -> npt.NDArray[Any]:
    """Reads all fields of a PLY or PCD file, such as labels.

    Args:
        path: The file.

    Returns:
        (N,) structured array; the fields x, y and z are numbers, the others rows of
        them.

    Raises:
        CloudReadError: As by `read_cloud`.
    """
    check_file(path)
    return _read_fields(path)[0]


def check_file(path: Path) -> None:
    """Raises CloudReadError if a file is missing, unreadable or empty.

    Args:
        path: The file.
    """
    if not path.is_file():
        reason = "is a folder" if path.is_dir() else "no such file"
        raise CloudReadError(f"{path}: {reason}.", code="PNT-CLOUD-002")
    try:
        with path.open("rb") as file:
            empty = not file.read(1)
    except OSError as error:
        raise CloudReadError(
            f"{path}: {error.strerror}.", code="PNT-CLOUD-003"
        ) from error
    if empty:
        raise CloudReadError(f"{path}: the file is empty.", code="PNT-CLOUD-004")


def checked_points(path: Path, points: FloatArray) -> FloatArray:
    """Returns points as contiguous float64.

    Args:
        path: Where they are from, for the message.
        points: (3, N).

    Returns:
        (3, N).

    Raises:
        CloudReadError: There are none, too many, or none is finite.
    """
    count = points.shape[1]
    if count == 0:
        raise CloudReadError(f"{path}: the cloud has no points.", code="PNT-CLOUD-005")
    if count > MAX_POINTS:
        raise CloudReadError(
            f"{path}: {count} points, at most {MAX_POINTS} are read.",
            code="PNT-CLOUD-006",
        )
    if not np.any(np.all(np.isfinite(points), axis=0)):
        raise CloudReadError(
            f"{path}: none of the {count} points is finite (NaN or infinite).",
            code="PNT-CLOUD-007",
        )
    return np.ascontiguousarray(points, dtype=np.float64)


def _read_fields(path: Path) -> tuple[npt.NDArray[Any], CloudHeader]:
    data = path.read_bytes()
    parse = parse_ply if path.suffix.lower() == ".ply" else parse_pcd
    try:
        header = parse(data)
    except (KeyError, ValueError, IndexError) as error:
        reason: object = error
        if isinstance(error, LookupError):
            short = isinstance(error, IndexError)
            reason = (
                "a line is too short" if short else f"{error} is missing or unknown"
            )
        raise CloudReadError(
            f"{path}: damaged header: {reason}.",
            code="PNT-CLOUD-008",
        ) from error
    if header.form == "ascii":
        return _text_fields(path, data[header.size :], header), header
    body = memoryview(data)[header.size :]
    if header.form == "binary_compressed":
        body = memoryview(_decompressed(path, body, header))
    size = header.count * header.point.itemsize
    if len(body) < size:
        raise CloudReadError(
            f"{path}: truncated: {header.count} points take {size} bytes, "
            f"the file has {len(body)}.",
            code="PNT-CLOUD-009",
        )
    if header.form == "binary":
        return np.frombuffer(body[:size], dtype=header.point), header
    fields = np.empty(header.count, dtype=header.point)
    start = 0
    for name in header.point.names or ():
        column = header.point[name]
        end = start + header.count * column.itemsize
        fields[name] = np.frombuffer(body[start:end], dtype=column)
        start = end
    return fields, header


def _decompressed(path: Path, body: memoryview, header: CloudHeader) -> bytes:
    packed = int.from_bytes(body[:4], "little")
    size = int.from_bytes(body[4:8], "little")
    if len(body) < 8 + packed:
        raise CloudReadError(
            f"{path}: truncated: {header.count} points take {8 + packed} bytes, "
            f"the file has {len(body)}.",
            code="PNT-CLOUD-010",
        )
    expected = header.count * header.point.itemsize
    if size != expected or size > _LZF_MOST * packed:
        raise CloudReadError(
            f"{path}: damaged: {packed} bytes cannot unpack to {size} bytes; "
            f"{header.count} points take {expected}.",
            code="PNT-CLOUD-011",
        )
    try:
        return lzf_decompress(bytes(body[8 : 8 + packed]), size)
    except ValueError as error:
        raise CloudReadError(
            f"{path}: damaged LZF data: {error}.", code="PNT-CLOUD-012"
        ) from error


def _text_fields(path: Path, body: bytes, header: CloudHeader) -> npt.NDArray[Any]:
    lines = [line for line in body.splitlines() if line.strip()]
    if len(lines) < header.count:
        raise CloudReadError(
            f"{path}: truncated: {header.count} points take as many lines, "
            f"the file has {len(lines)}.",
            code="PNT-CLOUD-013",
        )
    fields = np.zeros(header.count, dtype=header.point)
    if header.count == 0:
        return fields
    numbers = _numbers(path, lines[: header.count], columns=None)
    column = 0
    for name in header.point.names or ():
        kind = header.point[name]
        width = kind.shape[0] if kind.shape else 1
        block = numbers[:, column : column + width]
        column += width
        if block.shape[1] < width:
            raise CloudReadError(
                f"{path}: a line has {numbers.shape[1]} numbers, too few for {name}.",
                code="PNT-CLOUD-014",
            )
        if kind.base.kind in "iu":  # A colour may be written as -1 or NaN.
            block = np.nan_to_num(block, nan=0.0, posinf=0.0, neginf=0.0)
            block = np.clip(block, -(2.0**62), 2.0**62).astype(np.int64)
        with np.errstate(over="ignore"):  # Beyond float32: infinite, and dropped.
            fields[name] = block.astype(kind.base).reshape(fields[name].shape)
    return fields


def _read_xyz(path: Path) -> FloatArray:
    text = path.read_bytes().translate(bytes.maketrans(b",;", b"  "))
    lines = [line for line in text.splitlines() if line.strip()]
    if (
        len(lines) > 1
        and lines[0].strip()[:1].isalpha()
        and lines[0][:3].lower() != b"nan"
    ):
        del lines[0]
    lines = [line for line in lines if not line.lstrip().startswith((b"#", b"//"))]
    if not lines:
        raise CloudReadError(f"{path}: the cloud has no points.", code="PNT-CLOUD-015")
    return _numbers(path, lines, columns=(0, 1, 2)).T


def _numbers(
    path: Path, lines: list[bytes], *, columns: tuple[int, ...] | None
) -> FloatArray:
    try:
        words = [line.decode("ascii") for line in lines]
        return np.loadtxt(words, usecols=columns, ndmin=2, comments=None)
    except (ValueError, IndexError, OverflowError) as error:
        raise CloudReadError(
            f"{path}: expected lines of x, y and z: {error}.", code="PNT-CLOUD-016"
        ) from error


def _read_array(path: Path) -> FloatArray:
    try:
        if path.suffix.lower() == ".npz":
            content = _lone_member(path)
        else:
            content = _parse_npy(path.read_bytes())
    except (
        OSError,
        ValueError,
        EOFError,
        NotImplementedError,
        RuntimeError,  # An encrypted archive.
        zipfile.BadZipFile,
        zlib.error,
    ) as error:
        raise CloudReadError(
            f"{path}: cannot read the array: {error}.", code="PNT-CLOUD-017"
        ) from error
    if content.ndim == 2 and content.dtype.kind in "fiu":
        if content.shape[1] == 3:
            return np.asarray(content.T, dtype=np.float64)
        if content.shape[0] == 3:
            return np.asarray(content, dtype=np.float64)
    raise CloudReadError(
        f"{path}: expected numbers of shape (N, 3) or (3, N), "
        f"got {content.dtype} of shape {content.shape}.",
        code="PNT-CLOUD-018",
    )


def _lone_member(path: Path) -> npt.NDArray[Any]:
    with zipfile.ZipFile(path) as archive:
        members = {Path(info.filename).stem: info for info in archive.infolist()}
        names = [name for name in _NAMES if name in members] or list(members)
        if len(names) != 1:
            raise CloudReadError(
                f'{path}: expected one array, or one named "points", "xyz" or '
                f'"p_WQs", found {", ".join(names) or "none"}.',
                code="PNT-CLOUD-019",
            )
        info = members[names[0]]
        if info.file_size > 24 * MAX_POINTS:
            raise ValueError(
                f"it takes {info.file_size} bytes, at most {24 * MAX_POINTS} are read"
            )
        with archive.open(info) as file:
            # One byte more than announced reveals a wrong size.
            return _parse_npy(file.read(info.file_size + 1))


def _parse_npy(data: bytes) -> npt.NDArray[Any]:
    """Reads an array after checking its size; NumPy would allocate first."""
    file = io.BytesIO(data)
    version = np.lib.format.read_magic(file)
    read = {
        (1, 0): np.lib.format.read_array_header_1_0,
        (2, 0): np.lib.format.read_array_header_2_0,
    }.get(version)
    if read is None:
        raise ValueError(f"NPY version {version} is unknown")
    shape, fortran, dtype = read(file)
    if dtype.hasobject or any(length < 0 for length in shape):
        raise ValueError(f"{dtype} of shape {shape} is not a cloud")
    size = math.prod(shape) * dtype.itemsize
    rest = len(data) - file.tell()
    if rest < size:
        raise ValueError(f"truncated: it takes {size} bytes, the file has {rest}")
    values: npt.NDArray[Any] = np.frombuffer(
        data, dtype=dtype, count=math.prod(shape), offset=file.tell()
    )
    return values.reshape(shape[::-1]).T if fortran else values.reshape(shape)
