"""Simulated nodes against CiA 301 and CiA 402-2, row by row; clauses beside each."""

import re
from pathlib import Path

import pytest

from painter.canopen import sim
from painter.canopen.config.device import ObjectInfo
from painter.canopen.config.standard_objects import standard_drive
from painter.canopen.config.units import AxisUnits
from painter.canopen.protocol.cia402 import (
    STATUS_CODES,
    TRANSITIONS,
    State,
    Status,
    state_of,
)
from painter.canopen.protocol.codes import SDO_ABORTS
from painter.canopen.protocol.frames import Frame
from painter.canopen.protocol.nmt import NmtState
from painter.canopen.protocol.od_types import DataType
from painter.canopen.sim.drive import SimDrive
from painter.canopen.sim.store import LOAD, SAVE
from painter.canopen.sim.wire import Wire

UNITS = AxisUnits(counts_per_turn=4096, gear=100)
COUNTS_S = 20_000  # Speed of the moving axis, counts/s.
RAMP = 200_000  # Quick stop ramp, counts/s2.


class Bench:
    """One drive and a port to it."""

    def __init__(self, description=None):
        self.wire = Wire(1_000_000)
        self.frames: list[Frame] = []
        self.dut = SimDrive(
            5, description or standard_drive(), self.wire, units=UNITS, brake_time=0.05
        )
        self._send = self.wire.attach(lambda frame, now: self.frames.append(frame))
        self.now = 0.0
        self.run(0.1)

    def run(self, seconds):
        for _ in range(round(seconds * 1000)):
            self.now += 0.001
            self.wire.advance(self.now)
            self.dut.step(self.now)
        self.wire.advance(self.now + 0.001)

    def send(self, cob_id, data=b""):
        self._send(Frame(cob_id, bytes(data)), self.now)
        self.run(0.003)

    def sdo(self, request):
        self.frames.clear()
        self.send(0x605, request)
        return next((f.data for f in self.frames if f.cob_id == 0x585), None)

    def write(self, index, sub, value, size):
        data = value.to_bytes(size, "little", signed=value < 0)
        head = [0x23 | (4 - size) << 2, index & 0xFF, index >> 8, sub]
        answer = self.sdo(bytes(head) + data.ljust(4, b"\0"))
        return int.from_bytes(answer[4:], "little") if answer[0] == 0x80 else 0

    def read(self, index, sub=0):
        answer = self.sdo(bytes([0x40, index & 0xFF, index >> 8, sub, 0, 0, 0, 0]))
        return int.from_bytes(answer[4:], "little")

    def command(self, *words):
        for word in words:
            assert self.write(0x6040, 0, word, 2) == 0

    def state(self):
        return state_of(self.read(0x6041))

    def go(self, state):
        """Brings the drive into a state by its own rules."""
        self.write(0x605A, 0, 6, 2)
        if state in (State.READY, State.SWITCHED_ON, State.ENABLED, State.QUICK_STOP):
            self.command(6)
        if state in (State.SWITCHED_ON, State.ENABLED, State.QUICK_STOP):
            self.command(7)
        if state in (State.ENABLED, State.QUICK_STOP):
            self.command(15)
            self.run(0.06)
        if state == State.QUICK_STOP:
            self.command(2)
        if state == State.FAULT:
            self.dut.trip(0x3220)
            self.run(0.1)
        assert self.state() == state

    def move(self):
        """Moves at constant speed in profile position mode."""
        self.write(0x6060, 0, 1, 1)
        self.go(State.ENABLED)
        for index, value in (
            (0x607A, 10_000_000),
            (0x6081, COUNTS_S),
            (0x6083, RAMP),
            (0x6084, RAMP // 2),
            (0x6085, RAMP),
        ):
            assert self.write(index, 0, value, 4) == 0
        self.command(0x1F)
        self.run(0.5)
        assert self.dut.motor.velocity == pytest.approx(COUNTS_S, rel=0.01)


@pytest.fixture
def bench():
    return Bench()


# CiA 402-2 v4.0.0 (IEC 61800-7-201), 7.2.2, figure "power drive system finite state
# automaton" and its table "transition events and actions": number, the statusword's
# state bits before (mask 6Fh, or 4Fh where bit 5 does not count), controlword, and the
# state bits after. Transitions 0, 1, 13 and 14 are the drive's own: tests below.
TRANSITION_TABLE = [
    (2, 0x40, 0x06, 0x21),  # Shutdown: switch on disabled -> ready to switch on.
    (3, 0x21, 0x07, 0x23),  # Switch on: -> switched on.
    (4, 0x23, 0x0F, 0x27),  # Enable operation: -> operation enabled.
    (5, 0x27, 0x07, 0x23),  # Disable operation: -> switched on.
    (6, 0x23, 0x06, 0x21),  # Shutdown: -> ready to switch on.
    (7, 0x21, 0x00, 0x40),  # Disable voltage: -> switch on disabled.
    (7, 0x21, 0x02, 0x40),  # Quick stop: the same.
    (8, 0x27, 0x06, 0x21),  # Shutdown: -> ready to switch on.
    (9, 0x27, 0x00, 0x40),  # Disable voltage: -> switch on disabled.
    (10, 0x23, 0x00, 0x40),  # Disable voltage: -> switch on disabled.
    (10, 0x23, 0x02, 0x40),  # Quick stop: the same.
    (11, 0x27, 0x02, 0x07),  # Quick stop: -> quick stop active.
    (12, 0x07, 0x00, 0x40),  # Disable voltage: -> switch on disabled.
    (15, 0x08, 0x80, 0x40),  # Fault reset: -> switch on disabled.
    (16, 0x07, 0x0F, 0x27),  # Enable operation, 605Ah 5 to 8: -> operation enabled.
]
STATES = {
    0x40: State.SWITCH_ON_DISABLED,
    0x21: State.READY,
    0x23: State.SWITCHED_ON,
    0x27: State.ENABLED,
    0x07: State.QUICK_STOP,
    0x08: State.FAULT,
}
COMMANDS = (0x00, 0x02, 0x06, 0x07, 0x0F, 0x80)


def state_bits(bench):
    word = bench.read(0x6041)
    # 7.2.3, statusword coding: in these states bit 5 (quick stop) does not count.
    return word & 0x4F if word & 0x4F in (0x00, 0x40, 0x08, 0x0F) else word & 0x6F


@pytest.mark.parametrize(("number", "start", "word", "end"), TRANSITION_TABLE)
def test_transition(bench, number, start, word, end):
    bench.go(STATES[start])
    assert state_bits(bench) == start
    bench.command(word)
    bench.run(0.2)  # The brake opens in 0.05 s.
    assert state_bits(bench) == end


@pytest.mark.parametrize(
    ("start", "word"),
    [
        (start, word)
        for start in STATES
        for word in COMMANDS
        if (start, word) not in {row[1:3] for row in TRANSITION_TABLE}
    ],
)
def test_a_command_without_a_transition_changes_nothing(bench, start, word):
    bench.go(STATES[start])
    bench.command(word)
    bench.run(0.1)
    # READY and ENABLE OPERATION: 3 and 4 in one go are optional, and not done here.
    assert state_bits(bench) == start


def test_the_drives_own_transitions_after_power_on():
    # 7.2.2, transitions 0 and 1: start, then initialisation done.
    drive = SimDrive(5, standard_drive(), Wire(1_000_000), units=UNITS)
    assert drive.state == State.NOT_READY
    now = 0.0
    while drive.state == State.NOT_READY:
        now += 0.001
        assert now < 1.0
        drive.step(now)
    assert drive.state == State.SWITCH_ON_DISABLED


def test_the_drives_own_transitions_at_a_fault(bench):
    # 7.2.2, transitions 13 and 14: fault reaction by 605Eh, then fault.
    assert bench.write(0x605E, 0, 2, 2) == 0
    bench.move()
    bench.dut.trip(0x3220)
    seen = []
    for _ in range(300):
        bench.run(0.001)
        if not seen or seen[-1] != bench.dut.state:
            seen.append(bench.dut.state)
    assert seen == [State.FAULT_REACTION, State.FAULT]


def test_every_transition_of_the_standard_is_in_a_test():
    own = {0, 1, 13, 14}
    assert {row[0] for row in TRANSITION_TABLE} | own == set(range(17))
    # And the master's table equals the standard's.
    known = {
        (number, STATUS_CODES[start][1], int(word), STATUS_CODES[end][1])
        for (start, word), (number, end) in TRANSITIONS.items()
    }
    assert known == set(TRANSITION_TABLE)


def test_fault_reset_needs_a_rising_edge(bench):
    # CiA 402-2, 7.2.2: bit 7 changes from 0 to 1.
    bench.command(0x80)
    bench.dut.trip(0x3220)
    bench.run(0.1)
    bench.command(0x80)
    assert bench.state() == State.FAULT
    bench.command(0x00, 0x80)
    assert bench.state() == State.SWITCH_ON_DISABLED


def test_the_brake_opens_before_the_drive_is_enabled(bench):
    bench.go(State.SWITCHED_ON)
    assert bench.dut.brake_closed
    bench.command(15)
    assert not bench.dut.brake_closed
    assert bench.state() == State.SWITCHED_ON
    bench.run(0.06)
    assert bench.state() == State.ENABLED


@pytest.mark.parametrize(
    ("index", "option", "act", "ramp", "end"),
    [
        # CiA 402-2, 605Ah: 1, 5 slow down ramp; 2, 6 quick stop ramp; 5, 6 hold.
        (0x605A, 0, 2, None, State.SWITCH_ON_DISABLED),
        (0x605A, 1, 2, RAMP // 2, State.SWITCH_ON_DISABLED),
        (0x605A, 2, 2, RAMP, State.SWITCH_ON_DISABLED),
        (0x605A, 5, 2, RAMP // 2, State.QUICK_STOP),
        (0x605A, 6, 2, RAMP, State.QUICK_STOP),
        # 605Bh, 605Ch: 0 power off at once, 1 slow down first.
        (0x605B, 0, 6, None, State.READY),
        (0x605B, 1, 6, RAMP // 2, State.READY),
        (0x605C, 1, 7, RAMP // 2, State.SWITCHED_ON),
        # 605Dh: halt, bit 8; the drive stays enabled.
        (0x605D, 1, 0x11F, RAMP // 2, State.ENABLED),
        (0x605D, 2, 0x11F, RAMP, State.ENABLED),
        # 605Eh: fault reaction.
        (0x605E, 0, None, None, State.FAULT),
        (0x605E, 1, None, RAMP // 2, State.FAULT),
        (0x605E, 2, None, RAMP, State.FAULT),
    ],
)
def test_option_code(bench, index, option, act, ramp, end):
    bench.move()
    assert bench.write(index, 0, option, 2) == 0
    start = bench.dut.motor.position
    if act is None:
        bench.dut.trip(0x3220)
    else:
        bench.command(act)
    bench.run(0.5)
    assert bench.state() == end
    assert bench.dut.motor.velocity == pytest.approx(0.0, abs=1.0)
    if ramp is not None:
        # v^2 / 2a, the 3 ms that the command waits on the bus in this bench, and the
        # position loop's lag.
        distance = bench.dut.motor.position - start
        expected = COUNTS_S**2 / (2 * ramp)
        assert distance == pytest.approx(expected, abs=COUNTS_S * 0.005)


@pytest.mark.parametrize(
    ("option", "end"),
    [
        (0, State.ENABLED),
        (1, State.FAULT),
        (2, State.SWITCH_ON_DISABLED),
        (3, State.QUICK_STOP),
    ],
)
def test_abort_connection_option(bench, option, end):
    # CiA 402-2, 6007h; CiA 301, 1016h and EMCY 8130h.
    assert bench.write(0x1016, 1, 127 << 16 | 50, 4) == 0
    assert bench.write(0x6007, 0, option, 2) == 0
    bench.move()
    bench.write(0x605A, 0, 6, 2)
    bench.frames.clear()
    bench.send(0x77F, [5])
    bench.run(0.3)
    assert bench.dut.state == end
    emergencies = [f.data for f in bench.frames if f.cob_id == 0x85]
    assert emergencies[0][:3] == bytes([0x30, 0x81, 0x11])


# CiA 301 v4.2.0, table 22 (SDO abort codes): how each one is provoked by a write, and
# the clause that asks for it there.
ABORTS = [
    # 7.4.2, index and sub-index of the object dictionary.
    ("object does not exist", 0x06020000, 0x5FFF, 0, 0, 4),
    ("sub-index does not exist", 0x06090011, 0x607D, 9, 0, 4),
    # 7.4.5, table 43 (access attributes).
    ("read only", 0x06010002, 0x6041, 0, 0, 2),
    ("const", 0x06010002, 0x1008, 0, 0, 4),
    # 7.1.6, lengths of the data types.
    ("too long", 0x06070012, 0x6040, 0, 0, 4),
    ("too short", 0x06070013, 0x607A, 0, 0, 2),
    # CiA 402-2, value ranges of 605Ah, 605Dh, 6060h.
    ("too high", 0x06090031, 0x605A, 0, 9, 2),
    ("too low", 0x06090032, 0x605D, 0, 0, 2),
    ("mode not supported", 0x06090030, 0x6060, 0, 3, 1),
    # 7.5.2.13 and 7.5.2.14, 1010h and 1011h: wrong signature.
    ("cannot be stored", 0x08000020, 0x1010, 1, 1, 4),
    ("cannot be restored", 0x08000020, 0x1011, 1, 1, 4),
    # 7.5.2.35 to 7.5.2.38, PDO parameters and mapping.
    ("cannot be mapped", 0x06040041, 0x1A00, 1, 0x60850020, 4),
    ("mapped object missing", 0x06020000, 0x1A00, 1, 0x5FFF0020, 4),
    ("COB-ID of a live PDO", 0x06090030, 0x1800, 1, 0x199, 4),
]
# Those that other tests of this file provoke.
OTHER_ABORTS = {
    0x06040042: "mapping_needs_the_pdo_off_and_empty_and_ends_at_64_bits",
    0x08000022: "mapping_needs_the_pdo_off_and_empty_and_ends_at_64_bits",
    0x06010001: "write_only_objects_cannot_be_read",
    0x05040001: "unknown_and_block_commands_are_aborted",
    0x05030000: "segments_alternate_their_toggle_bit",
}


def test_every_abort_code_that_a_node_can_send_is_in_a_test():
    files = Path(sim.__file__).parent.glob("*.py")
    found = {
        int(code, 16)
        for file in files
        for code in re.findall(r"0x0[568]0[0-9A-F]{5}\b", file.read_text())
    }
    assert found == {row[1] for row in ABORTS} | set(OTHER_ABORTS)
    assert found <= set(SDO_ABORTS)
    for name in OTHER_ABORTS.values():
        assert f"test_{name}" in globals()


@pytest.mark.parametrize(
    ("what", "code", "index", "sub", "value", "size"),
    ABORTS,
    ids=[row[0] for row in ABORTS],
)
def test_sdo_abort(bench, what, code, index, sub, value, size):
    if "live" in what:
        assert bench.write(0x1800, 1, 0x185, 4) == 0
    assert bench.write(index, sub, value, size) == code


def test_mapping_needs_the_pdo_off_and_empty_and_ends_at_64_bits(bench):
    # CiA 301, 7.5.2.36: disable, clear, map, count, enable.
    assert bench.write(0x1A00, 1, 0x60410010, 4) == 0
    assert bench.write(0x1A00, 2, 0x60640020, 4) == 0
    assert bench.write(0x1A00, 3, 0x606C0020, 4) == 0
    assert bench.write(0x1A00, 0, 3, 1) == 0x06040042  # 80 bits.
    assert bench.write(0x1A00, 0, 2, 1) == 0
    assert bench.write(0x1A00, 1, 0x60640020, 4) == 0x08000022  # Not empty.
    assert bench.write(0x1800, 1, 0x185, 4) == 0
    assert bench.write(0x1A00, 0, 0, 1) == 0x08000022  # Not off.


def test_write_only_objects_cannot_be_read():
    base = standard_drive()
    extra = ObjectInfo(0x2000, 0, "key", DataType.UNSIGNED8, "wo", 0)
    base.objects = dict(base.objects) | {(0x2000, 0): extra}
    bench = Bench(base)
    answer = bench.sdo(bytes([0x40, 0x00, 0x20, 0, 0, 0, 0, 0]))
    assert answer == bytes([0x80, 0x00, 0x20, 0]) + (0x06010001).to_bytes(4, "little")


def test_unknown_and_block_commands_are_aborted(bench):
    for command in (0xA0, 0xC0, 0xE0):
        answer = bench.sdo(bytes([command, 0x00, 0x10, 0, 0, 0, 0, 0]))
        assert answer[0] == 0x80
        assert int.from_bytes(answer[4:], "little") == 0x05040001


def test_segments_alternate_their_toggle_bit(bench):
    # CiA 301, 7.2.4.3.6: upload SDO segment.
    first = bench.sdo(bytes([0x40, 0x08, 0x10, 0, 0, 0, 0, 0]))
    assert first[0] == 0x41
    text, toggle = b"", 0
    while True:
        answer = bench.sdo(bytes([0x60 | toggle << 4]) + bytes(7))
        assert answer[0] >> 4 & 1 == toggle
        text += answer[1 : 8 - (answer[0] >> 1 & 7)]
        toggle ^= 1
        if answer[0] & 1:
            break
    assert text == b"Painter simulated node"
    assert len(text) == int.from_bytes(first[4:], "little")
    bench.sdo(bytes([0x40, 0x08, 0x10, 0, 0, 0, 0, 0]))
    wrong = bench.sdo(bytes([0x70]) + bytes(7))
    assert int.from_bytes(wrong[4:], "little") == 0x05030000


def test_nmt_states_decide_what_is_answered(bench):
    # CiA 301, table 38 (NMT states and communication objects).
    assert bench.dut.nmt == NmtState.PRE_OPERATIONAL
    bench.send(0, [2, 5])
    assert bench.dut.nmt == NmtState.STOPPED
    assert bench.sdo(bytes([0x40, 0, 0x10, 0, 0, 0, 0, 0])) is None
    bench.send(0, [1, 0])
    assert bench.dut.nmt == NmtState.OPERATIONAL
    bench.send(0, [128, 6])  # Another node's.
    assert bench.dut.nmt == NmtState.OPERATIONAL
    bench.frames.clear()
    bench.send(0, [129, 5])
    bench.run(0.1)
    assert bench.frames == [Frame(0x705, b"\0")]


def test_heartbeats_say_the_state(bench):
    bench.write(0x1017, 0, 10, 2)
    bench.frames.clear()
    bench.run(0.1)
    beats = [f for f in bench.frames if f.cob_id == 0x705]
    assert 9 <= len(beats) <= 11
    assert {beat.data for beat in beats} == {b"\x7f"}


def test_emergencies_are_kept_and_end_with_zero(bench):
    # CiA 301, 7.2.7 and 1003h: newest first; writing 0 clears.
    bench.frames.clear()
    bench.dut.trip(0x3220)
    bench.run(0.1)
    bench.command(0, 0x80)
    bench.dut.trip(0x8611)
    bench.run(0.1)
    assert bench.read(0x1003, 0) == 2
    assert bench.read(0x1003, 1) == 0x8611
    assert bench.read(0x1003, 2) == 0x3220
    assert bench.read(0x603F) == 0x8611
    assert bench.read(0x1001) & 1
    assert bench.write(0x1003, 0, 1, 1) == 0x06090031
    assert bench.write(0x1003, 0, 0, 1) == 0


def test_what_is_stored_survives_a_reset_until_defaults_are_restored(bench):
    # CiA 301, 1010h and 1011h.
    bench.write(0x6065, 0, 777, 4)
    bench.dut.reboot()
    bench.run(0.1)
    assert bench.read(0x6065) == 2000
    bench.write(0x6065, 0, 777, 4)
    assert bench.write(0x1010, 1, SAVE, 4) == 0
    bench.dut.reboot()
    bench.run(0.1)
    assert bench.read(0x6065) == 777
    assert bench.write(0x1011, 1, LOAD, 4) == 0
    assert bench.read(0x6065) == 777
    bench.dut.reboot()
    bench.run(0.1)
    assert bench.read(0x6065) == 2000


def test_following_error_beyond_its_window_is_a_fault(bench):
    bench.move()
    bench.dut.motor.is_blocked = True
    bench.run(0.3)
    # 2000 counts at 20000 counts/s are 0.1 s; then 6066h, 10 ms.
    assert bench.state() == State.FAULT
    assert bench.read(0x603F) == 0x8611
    assert bench.read(0x6041) & Status.MODE_13


def test_profile_position_ends_at_its_target(bench):
    bench.move()
    position = round(bench.dut.position)
    bench.write(0x607A, 0, position + 30_000, 4)
    bench.command(0x0F, 0x1F)
    bench.run(3.0)
    assert bench.dut.position == pytest.approx(position + 30_000, abs=2)
    assert bench.read(0x6041) & Status.TARGET_REACHED


def test_software_limits_clamp_and_show(bench):
    bench.write(0x607D, 1, -500, 4)
    bench.write(0x607D, 2, 500, 4)
    bench.write(0x6060, 0, 8, 1)
    bench.write(0x60C2, 1, 5, 1)
    bench.go(State.ENABLED)
    bench.send(0, [1, 5])
    bench.write(0x607A, 0, 5000, 4)
    for _ in range(100):
        bench.send(0x80)
        bench.run(0.002)
    assert bench.dut.position == pytest.approx(500, abs=2)
    assert bench.read(0x6041) & Status.INTERNAL_LIMIT


@pytest.mark.parametrize("method", [1, 17, 35, 37])
def test_homing_makes_the_switch_zero(method):
    bench = Bench()
    bench.dut.home_switch = 3000.0
    bench.write(0x6098, 0, method, 1)
    bench.write(0x6099, 1, 10_000, 4)
    bench.write(0x6060, 0, 6, 1)
    bench.go(State.ENABLED)
    bench.command(0x1F)
    bench.run(2.0)
    done = Status.MODE_12 | Status.TARGET_REACHED
    assert bench.read(0x6041) & done == done
    assert bench.read(0x6064) in (0, 1, 2**32 - 1)
    moved = 0.0 if method in (35, 37) else 3000.0
    assert bench.dut.motor.position == pytest.approx(moved, abs=2)


def test_identity_cannot_be_written(bench):
    assert bench.write(0x1018, 1, 1, 4) == 0x06010002
