"""PLY files of points: parses their header and writes them.

Source: Turk, "The PLY polygon file format", 1994, and the type names with bit sizes
that newer writers use.
"""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from perception.io.cloud_header import (
    CloudHeader,
    header_lines,
    parse_count,
    point_type,
)

_TYPES = {
    "char": "i1",
    "uchar": "u1",
    "short": "i2",
    "ushort": "u2",
    "int": "i4",
    "uint": "u4",
    "float": "f4",
    "double": "f8",
}
_SIZED_TYPES = {np.dtype(kind).name: kind for kind in (*_TYPES.values(), "i8", "u8")}
_FORMS = {"ascii": "<", "binary_little_endian": "<", "binary_big_endian": ">"}


def parse_ply(data: bytes) -> CloudHeader:
    """Reads the header of a PLY file.

    Args:
        data: The file.

    Returns:
        The header; elements after the vertices are ignored.

    Raises:
        ValueError: The header is damaged or not of points with x, y and z; also
            KeyError and IndexError, for what is missing.
    """
    if not re.match(rb"ply\s", data):
        raise ValueError("a PLY file begins with 'ply'")
    lines, size = header_lines(data, "end_header")
    form = ""
    elements: list[tuple[str, int, list[list[str]]]] = []
    for words in lines:
        if words[:1] == ["format"]:
            form = words[1]
        elif words[:1] == ["element"]:
            elements.append((words[1], parse_count(words[2]), []))
        elif words[:1] == ["property"]:
            elements[-1][2].append(words[1:])
    if not elements or elements[0][0] != "vertex":
        raise ValueError("the first element is not 'vertex'")
    if form not in _FORMS:
        raise ValueError(f"format {form!r} is unknown")
    _, count, properties = elements[0]
    if any(words[0] == "list" for words in properties):
        raise ValueError("vertices have a list property")
    names = [words[1] for words in properties]
    kinds = _TYPES | _SIZED_TYPES
    types = [_FORMS[form] + kinds[words[0]] for words in properties]
    point = point_type(names, types, [1] * len(names))
    return CloudHeader(count, point, "ascii" if form == "ascii" else "binary", size)


def write_ply(
    path: Path, fields: Mapping[str, npt.NDArray[Any]], *, comment: str
) -> None:
    """Writes points as binary PLY.

    Args:
        path: The file.
        fields: (N,) each, by name, with x, y and z among them; of the number types that
            PLY knows, at most 4 bytes long if integer.
        comment: One line of ASCII: what the points are, their frame and unit.
    """
    types = {name: field.dtype.newbyteorder("<") for name, field in fields.items()}
    points = np.empty(len(fields["x"]), dtype=list(types.items()))
    for name, field in fields.items():
        points[name] = field
    words = {kind: word for word, kind in _TYPES.items()}
    header = [
        "ply",
        "format binary_little_endian 1.0",
        f"comment {comment}",
        f"element vertex {len(points)}",
        *(f"property {words[kind.str[1:]]} {name}" for name, kind in types.items()),
        "end_header",
    ]
    path.write_bytes(("\n".join(header) + "\n").encode() + points.tobytes())
