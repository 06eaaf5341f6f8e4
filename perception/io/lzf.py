"""LZF, the compression of PCD files."""


def lzf_decompress(data: bytes, size: int) -> bytes:
    """Decompresses a block of LZF.

    A control byte below 32 is followed by that many plus one bytes to copy. Any other
    says: repeat what came out some bytes ago; its upper three bits are the length less
    two (7: the next byte adds to it), the lower five and the next byte the distance
    less one.

    Source: Lehmann, LibLZF, file format as in lzf_d.c.

    Args:
        data: The block.
        size: Bytes that it holds when decompressed.

    Returns:
        `size` bytes.

    Raises:
        ValueError: The block is damaged or of another size.
    """
    out = bytearray()
    position, end = 0, len(data)
    try:
        while position < end and len(out) <= size:
            control = data[position]
            position += 1
            if control < 32:
                out += data[position : position + control + 1]
                position += control + 1
                continue
            length = control >> 5
            if length == 7:
                length += data[position]
                position += 1
            length += 2
            start = len(out) - ((control & 31) << 8) - data[position] - 1
            position += 1
            if start < 0:
                raise ValueError("a reference points before the data")
            piece = out[start : start + length]
            if len(piece) < length:  # It repeats itself.
                piece = (piece * (length // len(piece) + 1))[:length]
            out += piece
    except IndexError:
        raise ValueError("the data end within a reference") from None
    if position > end or len(out) != size:
        raise ValueError(f"the data unpack to {len(out)} bytes, not {size}")
    return bytes(out)
