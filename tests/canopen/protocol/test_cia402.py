"""Each row is a row of CiA 402-2's tables: statuswords, commands, transitions."""

import pytest

from painter.canopen.protocol.cia402 import (
    STATUS_CODES,
    TRANSITIONS,
    Command,
    State,
    command_of,
    next_command,
    state_of,
)
from painter.canopen.protocol.codes import SDO_ABORTS, abort_text, emcy_text

# Clause 7.2.2, table "state coding": xxxx xxxx x0xx 0000 and so on.
STATUS_TABLE = [
    ("xxxx xxxx x0xx 0000", State.NOT_READY),
    ("xxxx xxxx x1xx 0000", State.SWITCH_ON_DISABLED),
    ("xxxx xxxx x01x 0001", State.READY),
    ("xxxx xxxx x01x 0011", State.SWITCHED_ON),
    ("xxxx xxxx x01x 0111", State.ENABLED),
    ("xxxx xxxx x00x 0111", State.QUICK_STOP),
    ("xxxx xxxx x0xx 1111", State.FAULT_REACTION),
    ("xxxx xxxx x0xx 1000", State.FAULT),
]
# Table "command coding": bit 7, 3, 2, 1, 0.
COMMAND_TABLE = [
    ("0 x 1 1 0", Command.SHUTDOWN),
    ("0 0 1 1 1", Command.SWITCH_ON),
    ("0 1 1 1 1", Command.ENABLE_OPERATION),
    ("0 x x 0 x", Command.DISABLE_VOLTAGE),
    ("0 x 0 1 x", Command.QUICK_STOP),
]


def expand(pattern: str) -> list[str]:
    words = [""]
    for letter in pattern.replace(" ", ""):
        letters = "01" if letter == "x" else letter
        words = [word + bit for word in words for bit in letters]
    return words


@pytest.mark.parametrize(("pattern", "state"), STATUS_TABLE)
def test_every_statusword_holds_its_state(pattern, state):
    assert all(state_of(int(word, 2)) == state for word in expand(pattern))


def test_state_codes_exclude_each_other():
    for word in range(1 << 16):
        fits = [s for s, (mask, value) in STATUS_CODES.items() if word & mask == value]
        assert len(fits) <= 1
        assert state_of(word) == (fits[0] if fits else None)


@pytest.mark.parametrize(("pattern", "command"), COMMAND_TABLE)
def test_every_controlword_holds_its_command(pattern, command):
    for word in expand(pattern):
        b7, b3, b2, b1, b0 = (int(bit) for bit in word)
        assert command_of(b7 << 7 | b3 << 3 | b2 << 2 | b1 << 1 | b0) == command


def test_fault_reset_is_an_edge():
    assert command_of(0x80, 0x00) == Command.FAULT_RESET
    assert command_of(0x80, 0x80) is None


def test_all_commanded_transitions_are_there():
    numbers = sorted(number for number, _ in TRANSITIONS.values())
    # 7 and 10 by two commands each; 0, 1, 13, 14 are the drive's own.
    assert numbers == [2, 3, 4, 5, 6, 7, 7, 8, 9, 10, 10, 11, 12, 15, 16]


def test_the_way_up_ends_enabled_from_everywhere():
    for start in State:
        if start in (State.NOT_READY, State.FAULT_REACTION):
            continue  # The drive leaves these by itself.
        state, steps = start, 0
        while (command := next_command(state)) is not None:
            _, state = TRANSITIONS[state, command]
            steps += 1
            assert steps < 6
        assert state == State.ENABLED


def test_texts_name_the_code_or_its_class():
    assert emcy_text(0x8611) == "following error"
    assert emcy_text(0x8130) == "life guard or heartbeat error"
    assert emcy_text(0x3212) == "DC link over-voltage"
    assert emcy_text(0xFF17) == "device specific"
    assert emcy_text(0xB000) == "unknown error"
    assert abort_text(0x06020000) == "Object does not exist"
    assert abort_text(1) == "unknown abort code"
    assert all(code >> 24 in (0x05, 0x06, 0x08) for code in SDO_ABORTS)
