"""SDO client: frames of CiA 301 v4.2.0, 7.2.4.3, byte by byte."""

import pytest

from painter.canopen.protocol.sdo import (
    SdoClient,
    SdoError,
    address_of,
    expedited_data,
    segment_data,
)

NODE = 5
TIMEOUT = 0.1


class Bench:
    """A client, the frames it sends, and answers by hand."""

    def __init__(self, retries=0):
        self.sent = []
        self.dut = SdoClient(
            "drive", NODE, self.sent.append, timeout=TIMEOUT, retries=retries
        )

    def request(self, index, sub, data=None):
        request = self.dut.submit(index, sub, data)
        self.dut.poll(0.0)
        return request

    def answer(self, text, now=0.0):
        return self.dut.take(bytes.fromhex(text), now)

    def take_sent(self):
        frames = [frame.data.hex(" ") for frame in self.sent]
        assert all(frame.cob_id == 0x600 + NODE for frame in self.sent)
        self.sent.clear()
        return frames


@pytest.mark.parametrize(
    ("answer", "value"),
    [
        ("4f 41 60 00 37 00 00 00", b"\x37"),
        ("4b 41 60 00 37 02 00 00", b"\x37\x02"),
        ("47 41 60 00 01 02 03 00", b"\x01\x02\x03"),
        ("43 41 60 00 01 02 03 04", b"\x01\x02\x03\x04"),
        ("42 41 60 00 01 02 03 04", b"\x01\x02\x03\x04"),  # Size not indicated.
    ],
)
def test_an_expedited_upload_has_the_bytes_that_its_answer_counts(answer, value):
    bench = Bench()
    request = bench.request(0x6041, 0)
    assert bench.take_sent() == ["40 41 60 00 00 00 00 00"]
    assert bench.answer(answer)
    assert request.is_done
    assert request.error is None
    assert request.result == value


@pytest.mark.parametrize(
    ("data", "frame"),
    [
        (b"\x08", "2f 60 60 00 08 00 00 00"),
        (b"\x0f\x00", "2b 60 60 00 0f 00 00 00"),
        (b"\x01\x02\x03", "27 60 60 00 01 02 03 00"),
        (b"\x01\x02\x03\x04", "23 60 60 00 01 02 03 04"),
    ],
)
def test_an_expedited_download_counts_its_bytes(data, frame):
    bench = Bench()
    request = bench.request(0x6060, 0, data)
    assert bench.take_sent() == [frame]
    assert bench.answer("60 60 60 00 00 00 00 00")
    assert request.is_done
    assert request.error is None


def test_a_segmented_upload_toggles_and_joins_its_segments():
    bench = Bench()
    request = bench.request(0x1008, 0)
    assert bench.take_sent() == ["40 08 10 00 00 00 00 00"]
    assert bench.answer("41 08 10 00 09 00 00 00")
    assert bench.take_sent() == ["60 00 00 00 00 00 00 00"]
    assert not bench.answer("10" + b"painter".hex())  # The wrong toggle bit.
    assert bench.answer("00" + b"painter".hex())
    assert bench.take_sent() == ["70 00 00 00 00 00 00 00"]
    # Toggled, 5 of 7 bytes unused, last segment.
    assert bench.answer("1b" + b"!?".hex() + "00" * 5)
    assert request.result == b"painter!?"


def test_an_abort_fails_the_request_with_its_code():
    bench = Bench()
    request = bench.request(0x607D, 1, bytes(4))
    assert bench.answer("80 7d 60 01 22 00 00 08")
    assert isinstance(request.error, SdoError)
    assert request.error.abort_code == 0x08000022
    assert str(request.error).startswith("drive: SDO write of 607Dh:1 failed: ")
    assert "(08000022h)" in str(request.error)


def test_an_unanswered_request_is_aborted_repeated_and_then_failed():
    bench = Bench(retries=1)
    request = bench.request(0x1000, 0)
    bench.dut.poll(0.99 * TIMEOUT)
    assert bench.take_sent() == ["40 00 10 00 00 00 00 00"]
    bench.dut.poll(TIMEOUT)
    # 0504 0000h: SDO protocol timed out.
    abort = "80 00 10 00 00 00 04 05"
    assert bench.take_sent() == [abort, "40 00 10 00 00 00 00 00"]
    assert bench.dut.retry_count == 1
    assert not request.is_done
    bench.dut.poll(2 * TIMEOUT)
    assert bench.take_sent() == [abort]
    assert request.error.abort_code == 0x05040000


@pytest.mark.parametrize(
    "late",
    [
        "60 83 60 00 00 00 00 00",  # Of another index.
        "60 81 60 01 00 00 00 00",  # Of another sub-index.
        "43 81 60 00 00 00 00 00",  # Of a read.
        "80 83 60 00 00 00 04 05",  # Abort of another one.
        "60 81 60 00",  # Cut off.
    ],
)
def test_an_answer_to_another_request_is_dropped(late):
    bench = Bench()
    request = bench.request(0x6081, 0, bytes(4))
    assert not bench.answer(late)
    assert not request.is_done
    assert bench.answer("60 81 60 00 00 00 00 00")
    assert request.is_done


def test_an_answer_without_a_request_is_dropped():
    assert not Bench().answer("60 81 60 00 00 00 00 00")


def test_one_request_at_a_time_is_on_the_bus():
    bench = Bench()
    bench.dut.submit(0x6040, 0, b"\x06\x00")
    bench.dut.submit(0x6041, 0)
    bench.dut.poll(0.0)
    bench.dut.poll(0.0)
    assert bench.take_sent() == ["2b 40 60 00 06 00 00 00"]
    bench.answer("60 40 60 00 00 00 00 00")
    assert bench.take_sent() == ["40 41 60 00 00 00 00 00"]


def test_clear_fails_what_waits():
    bench = Bench()
    requests = [bench.request(0x6041, 0), bench.dut.submit(0x6064, 0)]
    bench.dut.clear()
    assert all(request.is_done and request.error for request in requests)
    bench.take_sent()
    bench.dut.poll(10.0)
    assert bench.take_sent() == []


def test_transfer_yields_until_the_answer_and_raises_its_error():
    bench = Bench()
    transfer = bench.dut.transfer(0x6041, 0)
    next(transfer)
    bench.dut.poll(0.0)
    bench.answer("4b 41 60 00 37 02 00 00")
    with pytest.raises(StopIteration) as done:
        next(transfer)
    assert done.value.value == b"\x37\x02"
    failing = bench.dut.transfer(0x6041, 0)
    next(failing)
    bench.dut.poll(0.0)
    bench.answer("80 41 60 00 00 00 02 06")
    with pytest.raises(SdoError, match="06020000h"):
        next(failing)


@pytest.mark.parametrize("data", [b"", bytes(5)])
def test_only_expedited_writes_are_taken(data):
    with pytest.raises(ValueError, match="1 to 4 bytes"):
        Bench().dut.submit(0x6040, 0, data)


def test_fields_of_frames():
    assert address_of(bytes.fromhex("40 7d 60 02 00 00 00 00")) == (0x607D, 2)
    assert expedited_data(bytes.fromhex("2b 40 60 00 0f 01 00 00")) == b"\x0f\x01"
    assert segment_data(bytes.fromhex("0d 61 00 00 00 00 00 00")) == b"a"
