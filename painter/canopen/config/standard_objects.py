"""Built-in object dictionaries: a full CiA 402 drive, a CiA 401 I/O node."""

import functools
from pathlib import Path

from painter.canopen.config.device import DeviceDescription, read_device


def standard_drive() -> DeviceDescription:
    """Returns the objects of a drive with PP, HM, IP and CSP and all options."""
    objects = _read("standard_drive.eds").objects.values()
    return DeviceDescription("the built-in drive", objects)


def standard_io() -> DeviceDescription:
    """Returns the objects of an I/O node: 8 digital in and out, one analogue each."""
    objects = _read("standard_io.eds").objects.values()
    return DeviceDescription("the built-in I/O node", objects)


@functools.cache
def _read(name: str) -> DeviceDescription:
    return read_device(Path(__file__).with_name(name), node_id=1)
