"""NMT commands and states.

Source: CiA 301 v4.2.0, 7.2.8.2.1 (commands) and 7.2.8.3.2.2 (states in heartbeats).
"""

import enum


class NmtCommand(enum.IntEnum):
    """First byte of an NMT frame."""

    START = 1
    STOP = 2
    ENTER_PRE_OPERATIONAL = 128
    RESET_NODE = 129
    RESET_COMMUNICATION = 130


class NmtState(enum.IntEnum):
    """State in a heartbeat; INITIALISING is the boot-up message."""

    INITIALISING = 0
    STOPPED = 4
    OPERATIONAL = 5
    PRE_OPERATIONAL = 127
