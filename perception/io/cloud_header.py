"""Headers of PLY and PCD files: which numbers the data hold, and where."""

import re
from dataclasses import dataclass
from typing import Any

import numpy as np

MAX_POINTS = 50_000_000  # 1.2 GB as float64; a wall at 1 mm has 4 million.
_MAX_HEADER = 65536
_MAX_POINT_BYTES = 4096
# Source: Turk, "The PLY polygon file format", 1994, and the names with bit sizes that
# newer writers use.
_PLY_TYPES = {
    **dict.fromkeys(("char", "int8"), "i1"),
    **dict.fromkeys(("uchar", "uint8"), "u1"),
    **dict.fromkeys(("short", "int16"), "i2"),
    **dict.fromkeys(("ushort", "uint16"), "u2"),
    **dict.fromkeys(("int", "int32"), "i4"),
    **dict.fromkeys(("uint", "uint32"), "u4"),
    **dict.fromkeys(("float", "float32"), "f4"),
    **dict.fromkeys(("double", "float64"), "f8"),
    "int64": "i8",
    "uint64": "u8",
}
_PLY_FORMS = {"ascii": "<", "binary_little_endian": "<", "binary_big_endian": ">"}
# Source: Point Cloud Library, "The PCD file format", version 0.7.
_PCD_TYPES = {
    **{("I", size): f"<i{size}" for size in (1, 2, 4, 8)},
    **{("U", size): f"<u{size}" for size in (1, 2, 4, 8)},
    **{("F", size): f"<f{size}" for size in (4, 8)},
}
_PCD_FORMS = ("ascii", "binary", "binary_compressed")


@dataclass(frozen=True)
class CloudHeader:
    """What a header promises.

    Attributes:
        count: Points.
        point: NumPy type of one point, with a field for each of the file's; fields may
            hold several numbers.
        form: "ascii", "binary" or "binary_compressed" (field after field, by LZF).
        size: Bytes of the header itself.
        viewpoint: Where the sensor was, in the cloud's frame and unit, if it says so.
    """

    count: int
    point: "np.dtype[Any]"
    form: str
    size: int
    viewpoint: tuple[float, float, float] | None = None


def parse_ply(data: bytes) -> CloudHeader:
    """Reads the header of a PLY file.

    Args:
        data: The file.

    Returns:
        The header; what follows the vertices is not looked at.

    Raises:
        ValueError: The header is damaged or not of points with x, y and z; also
            KeyError and IndexError, with what was looked for.
    """
    if not re.match(rb"ply\s", data):
        raise ValueError("a PLY file begins with 'ply'")
    lines, size = _header_lines(data, "end_header")
    form = ""
    elements: list[tuple[str, int, list[list[str]]]] = []
    for words in lines:
        if words[:1] == ["format"]:
            form = words[1]
        elif words[:1] == ["element"]:
            elements.append((words[1], _count(words[2]), []))
        elif words[:1] == ["property"]:
            elements[-1][2].append(words[1:])
    if not elements or elements[0][0] != "vertex":
        raise ValueError("the first element is not 'vertex'")
    if form not in _PLY_FORMS:
        raise ValueError(f"format {form!r} is unknown")
    _, count, properties = elements[0]
    if any(words[0] == "list" for words in properties):
        raise ValueError("a vertex has a list property")
    names = [words[1] for words in properties]
    types = [_PLY_FORMS[form] + _PLY_TYPES[words[0]] for words in properties]
    point = _point_type(names, types, [1] * len(names))
    return CloudHeader(count, point, "ascii" if form == "ascii" else "binary", size)


def parse_pcd(data: bytes) -> CloudHeader:
    """Reads the header of a PCD file.

    Args:
        data: The file.

    Returns:
        The header. A VIEWPOINT at the origin, which writers put there when they know
        none, counts as none.

    Raises:
        ValueError: As by `parse_ply`.
    """
    lines, size = _header_lines(data, "DATA")
    fields = {words[0]: words[1:] for words in lines if words}
    sizes = [int(word) for word in fields["SIZE"]]
    counts = [_count(word) for word in fields.get("COUNT", ["1"] * len(sizes))]
    kinds = zip(fields["TYPE"], sizes, strict=True)
    types = [_PCD_TYPES[kind, bytes_] for kind, bytes_ in kinds]
    form = fields["DATA"][0]
    if form not in _PCD_FORMS:
        raise ValueError(f"DATA {form!r} is unknown")
    place = [float(word) for word in fields.get("VIEWPOINT", ["0"] * 3)[:3]]
    known = len(place) == 3 and np.isfinite(place).all() and any(place)
    return CloudHeader(
        _count(fields["POINTS"][0]),
        _point_type(fields["FIELDS"], types, counts),
        form,
        size,
        (place[0], place[1], place[2]) if known else None,
    )


def _header_lines(data: bytes, last: str) -> tuple[list[list[str]], int]:
    """Returns the words of the header's lines up to one that begins with `last`."""
    lines, position = [], 0
    while (end := data.find(b"\n", position, _MAX_HEADER)) >= 0:
        # A comment may be in any code; what matters is ASCII.
        words = data[position:end].decode("ascii", "replace").split()
        position = end + 1
        lines.append(words)
        if words and words[0] == last:
            return lines, position
    raise ValueError(f"there is no line {last!r}")


def _count(word: str) -> int:
    count = int(word)
    if not 0 <= count <= MAX_POINTS:
        raise ValueError(f"a count of {count} is not from 0 to {MAX_POINTS}")
    return count


def _point_type(
    names: list[str], types: list[str], counts: list[int]
) -> "np.dtype[Any]":
    """Makes the type of a point; fields of no name of their own get numbers."""
    missing = [name for name in ("x", "y", "z") if name not in names]
    if missing:
        raise ValueError(f"points have no {', '.join(missing)}")
    fields: list[Any] = []
    for number, (name, kind, count) in enumerate(
        zip(names, types, counts, strict=True)
    ):
        if name in ("x", "y", "z"):
            if names.count(name) > 1 or count != 1:
                raise ValueError(f"{name} is there more than once")
            fields.append((name, kind))
        elif names.count(name) > 1 or name == "_":  # PCL's padding.
            fields.append((f"_{number}", kind, (count,)))
        else:
            fields.append((name, kind, (count,)))
    if sum(counts) > _MAX_POINT_BYTES:
        raise ValueError(f"a point of over {_MAX_POINT_BYTES} numbers")
    return np.dtype(fields)
