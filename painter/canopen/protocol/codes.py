"""Texts of emergency codes and SDO abort codes."""

from canopen.sdo.exceptions import SdoAbortedError

# Source: CiA 301 v4.2.0, table 26 (0000h to 90FFh) and CiA 402-2 v4.0.0, table of
# error codes (the rest). The longest matching prefix counts: code & mask.
_EMCY = {
    0x0000: "error reset or no error",
    0x1000: "generic error",
    0x2000: "current",
    0x2310: "continuous over-current",
    0x2320: "short circuit or earth leakage",
    0x3000: "voltage",
    0x3110: "mains over-voltage",
    0x3210: "DC link over-voltage",
    0x3220: "DC link under-voltage",
    0x4000: "temperature",
    0x4210: "device too hot",
    0x4310: "drive too hot",
    0x5000: "device hardware",
    0x5440: "contacts (brake)",
    0x6000: "device software",
    0x6320: "parameter error",
    0x7000: "additional modules",
    0x7120: "motor blocked or erroneous",
    0x7121: "motor blocked",
    0x7300: "sensor",
    0x7305: "incremental encoder 1",
    0x7500: "communication of modules",
    0x8000: "monitoring",
    0x8110: "CAN overrun, objects lost",
    0x8120: "CAN in error passive mode",
    0x8130: "life guard or heartbeat error",
    0x8140: "recovered from bus off",
    0x8150: "CAN-ID collision",
    0x8200: "protocol error",
    0x8210: "PDO not processed, length error",
    0x8220: "PDO length exceeded",
    0x8240: "unexpected SYNC data length",
    0x8250: "RPDO time-out",
    0x8400: "velocity monitoring",
    0x8500: "positioning",
    0x8600: "positioning",
    0x8611: "following error",
    0x8612: "reference limit",
    0x8700: "sync controller",
    0x9000: "external error",
    0xF000: "additional functions",
    0xFF00: "device specific",
}

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
