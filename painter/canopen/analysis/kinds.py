"""Kinds of frames on the bus."""

import enum


class Kind(enum.StrEnum):
    """Kinds of frames."""

    NMT = "nmt"
    SYNC = "sync"
    EMCY = "emcy"
    TPDO = "tpdo"
    RPDO = "rpdo"
    SDO = "sdo"
    HEARTBEAT = "heartbeat"
    ERROR = "error"
    OTHER = "other"
