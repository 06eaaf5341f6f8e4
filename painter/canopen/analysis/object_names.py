"""Texts of decoded logs and names of objects in them, from texts.yaml."""

from pathlib import Path
from typing import Any

import yaml

TEXTS: dict[str, Any] = yaml.safe_load(
    Path(__file__).with_name("texts.yaml").read_text(encoding="utf-8")
)
_RANGES = (
    (0x1400, 0x1600, "RPDO{} parameters"),
    (0x1600, 0x1800, "RPDO{} mapping"),
    (0x1800, 0x1A00, "TPDO{} parameters"),
    (0x1A00, 0x1C00, "TPDO{} mapping"),
)


def object_text(index: int, sub: int) -> str:
    """Returns an object as "6040h controlword" or "607Dh:1 software position limit"."""
    address = f"{index:04X}h:{sub}" if sub else f"{index:04X}h"
    name = TEXTS["objects"].get(index)
    for first, end, text in _RANGES:
        if first <= index < end:
            name = text.format(index - first + 1)
    return f"{address} {name}" if name else address


def object_value(index: int, data: bytes) -> int:
    """Returns the integer value of an object's bytes."""
    return int.from_bytes(data, "little", signed=index in TEXTS["signed"])
