"""LZF blocks written by hand after the format's description."""

import pytest

from perception.io.lzf import lzf_decompress


def test_literals_and_references():
    # "abc", then 4 bytes from 3 back (length 4 - 2 = 2, distance 3 - 1 = 2).
    assert lzf_decompress(b"\x02abc" + bytes([2 << 5, 2]), 7) == b"abcabca"


def test_run_of_one_byte_and_long_length():
    # "z", then 7 + 91 + 2 = 100 bytes from 1 back.
    assert lzf_decompress(b"\x00z" + bytes([7 << 5, 91, 0]), 101) == b"z" * 101


def test_far_distance():
    data = bytes(range(256)) * 2
    packed = b"".join(bytes([31]) + data[i : i + 32] for i in range(0, 512, 32))
    # Three bytes from 512 back: 511 = 1 * 256 + 255.
    assert lzf_decompress(packed + bytes([(1 << 5) | 1, 255]), 515)[-3:] == data[:3]


@pytest.mark.parametrize(
    ("data", "size", "message"),
    [
        (b"\x02ab", 3, "not 3"),
        (b"\x00a" + bytes([1 << 5, 5]), 4, "points before the data"),
        (b"\x00a" + bytes([7 << 5]), 4, "end within"),
        (b"\x00a", 9, "unpack to 1 bytes, not 9"),
        (b"\x02abc", 2, "unpack to 3 bytes, not 2"),
    ],
)
def test_damaged_blocks_are_refused(data, size, message):
    with pytest.raises(ValueError, match=message):
        lzf_decompress(data, size)
