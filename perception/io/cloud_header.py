"""Headers of cloud files: what numbers a point has; those of PCD.

The headers of PLY are parsed in `ply.py`.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

MAX_POINTS = 50_000_000  # 1.2 GB as float64; a wall at 1 mm has 4 million.
_MAX_HEADER = 65536
_MAX_POINT_BYTES = 4096
# Source: Point Cloud Library, "The PCD file format", version 0.7.
_PCD_TYPES = {
    **{("I", size): f"<i{size}" for size in (1, 2, 4, 8)},
    **{("U", size): f"<u{size}" for size in (1, 2, 4, 8)},
    **{("F", size): f"<f{size}" for size in (4, 8)},
}
_PCD_FORMS = ("ascii", "binary", "binary_compressed")


@dataclass(frozen=True)
class CloudHeader:
    """What a header says of the data.

    Attributes:
        count: Points.
        point: NumPy type of one point, with a field for each of the file's; fields may
            hold several numbers.
        form: "ascii", "binary" or "binary_compressed" (field after field, by LZF).
        size: Bytes of the header itself.
        viewpoint: Position of the sensor in the cloud's frame and unit, if given.
    """

    count: int
    point: "np.dtype[Any]"
    form: str
    size: int
    viewpoint: tuple[float, float, float] | None = None


def parse_pcd(data: bytes) -> CloudHeader:
    """Reads the header of a PCD file.

    Args:
        data: The file.

    Returns:
        The header. A VIEWPOINT at the origin, which writers put there when they know
        none, counts as none.

    Raises:
        ValueError: The header is damaged or not of points with x, y and z; also
            KeyError and IndexError, for what is missing.
    """
    lines, size = header_lines(data, "DATA")
    fields = {words[0]: words[1:] for words in lines if words}
    sizes = [int(word) for word in fields["SIZE"]]
    counts = [parse_count(word) for word in fields.get("COUNT", ["1"] * len(sizes))]
    kinds = zip(fields["TYPE"], sizes, strict=True)
    types = [_PCD_TYPES[kind, bytes_] for kind, bytes_ in kinds]
    form = fields["DATA"][0]
    if form not in _PCD_FORMS:
        raise ValueError(f"DATA {form!r} is unknown")
    place = [float(word) for word in fields.get("VIEWPOINT", ["0"] * 3)[:3]]
    known = len(place) == 3 and np.isfinite(place).all() and any(place)
    return CloudHeader(
        parse_count(fields["POINTS"][0]),
        point_type(fields["FIELDS"], types, counts),
        form,
        size,
        (place[0], place[1], place[2]) if known else None,
    )


def header_lines(data: bytes, last: str) -> tuple[list[list[str]], int]:
    """Returns the words of the lines up to one that begins with `last`, and their size.

    Raises:
        ValueError: There is no such line.
    """
    lines, position = [], 0
    while (end := data.find(b"\n", position, _MAX_HEADER)) >= 0:
        # A comment may be in any code; what matters is ASCII.
        words = data[position:end].decode("ascii", "replace").split()
        position = end + 1
        lines.append(words)
        if words and words[0] == last:
            return lines, position
    raise ValueError(f"there is no line {last!r}")


def parse_count(word: str) -> int:
    """Reads a number of points or values; ValueError = not from 0 to MAX_POINTS."""
    count = int(word)
    if not 0 <= count <= MAX_POINTS:
        raise ValueError(f"a count must be 0 to {MAX_POINTS}, got {count}")
    return count


def point_type(
    names: list[str], types: list[str], counts: list[int]
) -> "np.dtype[Any]":
    """Makes the NumPy type of a point.

    Args:
        names: Of the fields; those that repeat and PCL's padding get numbers instead.
        types: NumPy's name of each.
        counts: Values of each.

    Raises:
        ValueError: x, y or z is missing or there twice, or a point is too large.
    """
    missing = [name for name in ("x", "y", "z") if name not in names]
    if missing:
        raise ValueError(f"points have no {', '.join(missing)}")
    fields: list[Any] = []
    for number, (name, kind, count) in enumerate(
        zip(names, types, counts, strict=True)
    ):
        if name in ("x", "y", "z"):
            if names.count(name) > 1 or count != 1:
                raise ValueError(f"field {name} occurs more than once")
            fields.append((name, kind))
        elif names.count(name) > 1 or name == "_":  # PCL's padding.
            fields.append((f"_{number}", kind, (count,)))
        else:
            fields.append((name, kind, (count,)))
    if sum(counts) > _MAX_POINT_BYTES:
        raise ValueError(f"a point has more than {_MAX_POINT_BYTES} values")
    return np.dtype(fields)
