"""One drive as the master sees it; statuswords and controlwords of CiA 402-2."""

import math

import pytest

from painter.canopen.config.bus_file import load_bus
from painter.canopen.master.drive_client import DriveClient
from painter.canopen.protocol.cia402 import State
from painter.canopen.protocol.frames import Frame
from painter.errors import BusError
from painter.resources import models_path

NODE = 1
CYCLE = 0.005
# Statuswords with voltage enabled and remote; CiA 402-2, table of state coding.
SWITCH_ON_DISABLED, READY, SWITCHED_ON, ENABLED = 0x0250, 0x0231, 0x0233, 0x0237
QUICK_STOP, FAULT = 0x0217, 0x0218


class Bench:
    """A drive's client on a bus of one node; time and answers are the test's."""

    def __init__(self):
        self.bus = load_bus(models_path("bus", "painter.bus.yaml"))
        self.sent = []
        limits = self.bus.drive_limits()[0]
        self.dut = DriveClient("base_yaw", self.bus, limits, self.sent.append)
        self.now = 0.0

    def status(self, word, position=0):
        data = word.to_bytes(2, "little") + position.to_bytes(4, "little", signed=True)
        return self.dut.take(Frame(0x180 + NODE, data), self.now)

    def slow(self, velocity, error):
        data = b"".join(v.to_bytes(4, "little", signed=True) for v in (velocity, error))
        return self.dut.take(Frame(0x280 + NODE, data), self.now)

    def emergency(self, code):
        data = code.to_bytes(2, "little") + bytes(6)
        self.dut.take(Frame(0x080 + NODE, data), self.now)

    def step(self, script, seconds=CYCLE):
        """Continues a script; returns whether it still runs."""
        self.now += seconds
        self.dut.poll(self.now)
        return next(script, "ended") is None


@pytest.fixture
def bench():
    return Bench()


def test_tpdos_hold_status_position_velocity_and_following_error(bench):
    assert bench.status(ENABLED, -1234)
    assert bench.slow(-500, 7)
    dut = bench.dut
    assert (dut.state, dut.statusword) == (State.ENABLED, ENABLED)
    assert (dut.position, dut.velocity, dut.following_error) == (-1234, -500, 7)
    config = bench.bus.drives["base_yaw"]
    turn = config.counts_per_turn * config.gear
    status = dut.status()
    assert status.state == "OPERATION ENABLED"
    assert status.following_error == pytest.approx(2 * math.pi * 7 / turn)


@pytest.mark.parametrize(("base", "length"), [(0x180, 5), (0x280, 7), (0x380, 8)])
def test_a_tpdo_of_another_kind_or_length_is_malformed(bench, base, length):
    assert not bench.dut.take(Frame(base + NODE, bytes(length)), 0.0)
    assert bench.dut.state is None


def test_the_rpdo_holds_controlword_and_target(bench):
    bench.dut.controlword, bench.dut.target = 0x0F, -2
    assert bench.dut.rpdo() == Frame(0x201, bytes.fromhex("0f 00 fe ff ff ff"))


def test_enabling_takes_the_steps_of_the_state_machine(bench):
    # Transitions 2, 3 and 4: shutdown, switch on, enable operation.
    script = bench.dut.enable()
    assert bench.step(script)
    for word, command in (
        (SWITCH_ON_DISABLED, 0x06),
        (READY, 0x07),
        (SWITCHED_ON, 0x0F),
    ):
        bench.status(word, 100)
        assert bench.step(script)
        assert bench.dut.controlword == command
        assert bench.dut.target == 100
    bench.status(ENABLED, 250)
    assert not bench.step(script)
    assert (bench.dut.controlword, bench.dut.target) == (0x0F, 250)


def test_a_fault_is_reset_by_a_rising_edge_of_bit_7(bench):
    bench.emergency(0x3210)
    bench.status(FAULT)
    script = bench.dut.enable()
    words = []
    while bench.dut.controlword != 0x80:
        assert bench.step(script)
        words.append(bench.dut.controlword)
        bench.status(FAULT)
    assert set(words[:-1]) == {0}
    assert len(words) >= 3  # Two statuswords saw it low.
    assert bench.dut.emcy == 0
    bench.status(SWITCH_ON_DISABLED)
    assert bench.step(script)
    assert bench.dut.controlword == 0x06


def test_a_drive_that_stays_in_a_state_is_named_with_its_statusword(bench):
    bench.status(SWITCHED_ON)
    script = bench.dut.enable()
    timeout = bench.bus.timeouts.brake
    assert bench.step(script)
    assert bench.step(script, timeout)
    with pytest.raises(BusError, match=r"stays in SWITCHED ON \(brake\?\) .* 0233h"):
        bench.step(script)


def test_disabling_shuts_down_and_then_removes_the_voltage(bench):
    bench.status(ENABLED)
    script = bench.dut.disable()
    assert bench.step(script)
    assert bench.dut.controlword == 0x06
    bench.status(READY)
    assert bench.step(script)
    assert bench.dut.controlword == 0x00
    bench.status(SWITCH_ON_DISABLED)
    assert not bench.step(script)


def test_disabling_leaves_a_quick_stop_by_transition_12(bench):
    bench.status(QUICK_STOP)
    script = bench.dut.disable()
    assert bench.step(script)
    assert bench.dut.controlword == 0x00


@pytest.mark.parametrize(
    ("word", "text"),
    [
        (ENABLED, None),
        (ENABLED | 1 << 10, None),  # Target reached.
        (ENABLED | 1 << 7, None),  # Warning.
        (ENABLED | 1 << 11, "internal limit active (statusword bit 11)"),
        (ENABLED | 1 << 13, "following error (statusword bit 13)"),
        (QUICK_STOP, "left OPERATION ENABLED, is in QUICK STOP ACTIVE"),
        (FAULT, "drive fault, EMCY 8611h"),
        (FAULT | 0x07, "drive fault"),  # Fault reaction active.
    ],
)
def test_reasons_to_stop_an_enabled_arm(bench, word, text):
    bench.emergency(0x8611)
    bench.status(word)
    reason = bench.dut.stop_reason()
    if text is None:
        assert reason is None
    else:
        assert reason.startswith(f"base_yaw: {text}")


def test_a_late_answer_does_not_pass_for_one_to_the_next_sync(bench):
    dut = bench.dut
    assert not dut.expect_answer()
    bench.status(ENABLED, 1)
    assert dut.is_measured
    dut.expect_answer()
    dut.got_tpdo = False
    dut.expect_answer()  # The answer to the SYNC before is still out.
    bench.status(ENABLED, 2)
    assert not dut.is_measured
    bench.status(ENABLED, 3)
    assert dut.is_measured


def test_an_answer_that_stays_out_counts_as_lost(bench):
    dut = bench.dut
    dut.expect_answer()  # Never answered.
    seconds = 0.0
    while not dut.is_measured:
        dut.expect_answer()
        bench.status(ENABLED)
        seconds += CYCLE
        assert seconds < 1.0
    assert seconds == pytest.approx(0.2, abs=2 * CYCLE)


def test_missed_answers_are_counted_in_a_row(bench):
    dut = bench.dut
    for _ in range(3):
        dut.got_tpdo = False
        dut.expect_answer()
    assert dut.missed == 3
    bench.status(ENABLED)
    assert dut.expect_answer()
    assert dut.missed == 0


def answer_reads(bench, script, values):
    """Answers reads by SDO with 32-bit values until the script ends."""
    while bench.step(script):
        for frame in bench.sent:
            assert frame.cob_id == 0x600 + NODE
            head = frame.data[1:4]
            value = values[int.from_bytes(head[:2], "little"), head[2]]
            data = b"\x43" + head + value.to_bytes(4, "little")
            bench.dut.take(Frame(0x580 + NODE, data), bench.now)
        bench.sent.clear()


def test_an_encoder_or_mode_that_differs_from_the_bus_file_is_named(bench):
    counts = round(bench.bus.drives["base_yaw"].counts_per_turn)
    # Bit 7 of 6502h: cyclic synchronous position.
    good = {(0x608F, 1): 3 * counts, (0x608F, 2): 3, (0x6502, 0): 1 << 7}
    answer_reads(bench, bench.dut.check_device(), good)
    with pytest.raises(
        BusError, match=r"wrong unit: the encoder has \d+ counts a turn"
    ):
        answer_reads(bench, bench.dut.check_device(), good | {(0x608F, 2): 1})
    bench.dut.sdo.clear()
    with pytest.raises(BusError, match="CYCLIC_SYNC_POSITION is not supported"):
        answer_reads(bench, bench.dut.check_device(), good | {(0x6502, 0): 0x7F})
