"""Texts of emergency codes and SDO abort codes."""

# Source: CiA 301 v4.2.0, table 26 (0000h to 90FFh) and CiA 402-2 v4.0.0, table of
# error codes (the rest). Longest matching prefix counts: code & mask.
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

# Source: CiA 301 v4.2.0, table 22 (SDO abort codes).
SDO_ABORTS = {
    0x05030000: "toggle bit not alternated",
    0x05040000: "SDO protocol timed out",
    0x05040001: "command specifier not valid or unknown",
    0x05040002: "invalid block size",
    0x05040003: "invalid sequence number",
    0x05040004: "CRC error",
    0x05040005: "out of memory",
    0x06010000: "unsupported access to an object",
    0x06010001: "attempt to read a write only object",
    0x06010002: "attempt to write a read only object",
    0x06020000: "object does not exist",
    0x06040041: "object cannot be mapped to the PDO",
    0x06040042: "mapped objects would exceed the PDO length",
    0x06040043: "general parameter incompatibility",
    0x06040047: "general internal incompatibility",
    0x06060000: "access failed due to a hardware error",
    0x06070010: "length of service parameter does not match",
    0x06070012: "length of service parameter too high",
    0x06070013: "length of service parameter too low",
    0x06090011: "sub-index does not exist",
    0x06090030: "invalid value for parameter",
    0x06090031: "value of parameter written too high",
    0x06090032: "value of parameter written too low",
    0x06090036: "maximum value is less than minimum value",
    0x060A0023: "resource not available",
    0x08000000: "general error",
    0x08000020: "data cannot be transferred or stored",
    0x08000021: "data cannot be transferred or stored because of local control",
    0x08000022: "data cannot be transferred or stored in the present device state",
    0x08000023: "object dictionary generation failed",
    0x08000024: "no data available",
}


def emcy_text(code: int) -> str:
    """Returns what an emergency code says; an unknown one by the class it is in."""
    for mask in (0xFFFF, 0xFFF0, 0xFF00, 0xF000):
        text = _EMCY.get(code & mask)
        if text is not None:
            return text
    return "unknown error"


def abort_text(code: int) -> str:
    """Returns what an SDO abort code says."""
    return SDO_ABORTS.get(code, "unknown abort code")
