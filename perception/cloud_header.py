"""Headers of PLY and PCD files, and whether the data they promise are there."""

from dataclasses import dataclass
from pathlib import Path

from perception.errors import CloudReadError

_MAX_HEADER = 65536
# Source: Turk, "The PLY polygon file format", 1994, and the names with bit sizes that
# newer writers use.
_PLY_SIZES = {
    **dict.fromkeys(("char", "uchar", "int8", "uint8"), 1),
    **dict.fromkeys(("short", "ushort", "int16", "uint16"), 2),
    **dict.fromkeys(("int", "uint", "int32", "uint32", "float", "float32"), 4),
    **dict.fromkeys(("double", "float64", "int64", "uint64"), 8),
}


@dataclass(frozen=True)
class CloudHeader:
    """What a header promises.

    Attributes:
        count: Points.
        stride: Bytes of a point; 0 = text, a line a point.
        compressed: The data begin with their compressed size (PCD).
        size: Bytes of the header itself.
    """

    count: int
    stride: int
    compressed: bool
    size: int


def read_header(path: Path) -> CloudHeader:
    """Reads the header of a PLY or PCD file and checks the file's length against it.

    Args:
        path: The file; its suffix tells which.

    Returns:
        The header.

    Raises:
        CloudReadError: The header is damaged, has no x, y and z, or promises more than
            the file holds; names the file and the numbers.
    """
    data = path.read_bytes()
    try:
        parse = _parse_ply if path.suffix.lower() == ".ply" else _parse_pcd
        header = parse(data)
    except (KeyError, ValueError, IndexError) as error:
        raise CloudReadError(f"{path}: damaged header: {error}.") from error
    body = data[header.size :]
    if header.compressed:
        promised = 8 + int.from_bytes(body[:4], "little")
    elif header.stride:
        promised = header.count * header.stride
    else:
        lines = sum(1 for line in body.splitlines() if line.strip())
        if lines < header.count:
            raise CloudReadError(
                f"{path}: truncated: the header promises {header.count} points, the "
                f"file has {lines} lines of data."
            )
        return header
    if len(body) < promised:
        raise CloudReadError(
            f"{path}: truncated: the header promises {header.count} points in "
            f"{promised} bytes, the file has {len(body)}."
        )
    return header


def _header_lines(data: bytes, last: str) -> tuple[list[list[str]], int]:
    """Returns the words of the header's lines up to one that begins with `last`."""
    lines, position = [], 0
    while (end := data.find(b"\n", position, _MAX_HEADER)) >= 0:
        words = data[position:end].decode("ascii").split()
        position = end + 1
        lines.append(words)
        if words and words[0] == last:
            return lines, position
    raise ValueError(f"there is no line {last!r}")


def _parse_ply(data: bytes) -> CloudHeader:
    if not data.startswith(b"ply"):
        raise ValueError("a PLY file begins with 'ply'")
    lines, size = _header_lines(data, "end_header")
    form = ""
    elements: list[tuple[str, int, list[list[str]]]] = []
    for words in lines:
        if words[:1] == ["format"]:
            form = words[1]
        elif words[:1] == ["element"]:
            elements.append((words[1], int(words[2]), []))
        elif words[:1] == ["property"]:
            elements[-1][2].append(words[1:])
    if not elements or elements[0][0] != "vertex":
        raise ValueError("the first element is not 'vertex'")
    _, count, properties = elements[0]
    _check_names(names=[words[-1] for words in properties])
    if any(words[0] == "list" for words in properties):
        raise ValueError("a vertex has a list property")
    stride = 0
    if form != "ascii":
        stride = sum(_PLY_SIZES[words[0]] for words in properties)
    return CloudHeader(count, stride, False, size)


def _parse_pcd(data: bytes) -> CloudHeader:
    # Source: Point Cloud Library, "The PCD file format", version 0.7.
    lines, size = _header_lines(data, "DATA")
    fields = {words[0]: words[1:] for words in lines if words}
    _check_names(names=fields["FIELDS"])
    sizes = [int(word) for word in fields["SIZE"]]
    counts = [int(word) for word in fields.get("COUNT", ["1"] * len(sizes))]
    stride = sum(a * b for a, b in zip(sizes, counts, strict=True))
    form = fields["DATA"][0]
    if form not in ("ascii", "binary", "binary_compressed"):
        raise ValueError(f"DATA {form} is unknown")
    count = int(fields["POINTS"][0])
    return CloudHeader(
        count, stride if form == "binary" else 0, form == "binary_compressed", size
    )


def _check_names(names: list[str]) -> None:
    missing = [name for name in ("x", "y", "z") if name not in names]
    if missing:
        raise ValueError(f"points have no {', '.join(missing)}")
