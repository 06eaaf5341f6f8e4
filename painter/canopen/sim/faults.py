"""Names of the faults of simulated drives."""

import enum


class Fault(enum.StrEnum):
    """Faults that can be injected."""

    EMCY = "emcy"  # The drive reports DC link under-voltage.
    FOLLOWING_ERROR = "following_error"  # Something blocks the axis.
    HEARTBEAT_LOST = "heartbeat_lost"  # The node goes silent.
    NODE_RESET = "node_reset"  # The node reboots.
    TPDO_SILENT = "tpdo_silent"  # The node sends heartbeats but no TPDOs.
    SDO_ABORT = "sdo_abort"  # The limits cannot be written.
    WRONG_IDENTITY = "wrong_identity"  # Another product is on the node-ID.
    WRONG_UNIT = "wrong_unit"  # The encoder has twice the counts.
    BRAKE_STUCK = "brake_stuck"  # The brake does not open.
    ESTOP = "estop"  # The e-stop chain opens; the axis is ignored.
    PRESSURE_LOW = "pressure_low"  # The pump stops; the axis is ignored.
    BUS_OFF = "bus_off"  # The master's controller goes bus-off.
    INTERFACE_DOWN = "interface_down"  # The master's adapter is unplugged.
