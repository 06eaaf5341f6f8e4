"""Texts of emergency codes and SDO abort codes."""

from pathlib import Path

import yaml
from canopen.sdo.exceptions import SdoAbortedError

_EMCY: dict[int, str] = yaml.safe_load(
    Path(__file__).with_name("emcy.yaml").read_text(encoding="utf-8")
)

# Texts of CiA 301 v4.2.0, table 22, as python-canopen has them.
SDO_ABORTS: dict[int, str] = SdoAbortedError.CODES


def emcy_text(code: int) -> str:
    """Returns the text of an emergency code; of its class if the code is unknown."""
    for mask in (0xFFFF, 0xFFF0, 0xFF00, 0xF000):
        text = _EMCY.get(code & mask)
        if text is not None:
            return text
    return "unknown error"


def abort_text(code: int) -> str:
    """Returns the text of an SDO abort code."""
    return SDO_ABORTS.get(code, "unknown abort code")
