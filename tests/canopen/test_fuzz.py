"""Random and malformed frames during operation: no crash, no uncommanded motion."""

import random

import numpy as np
import pytest

from painter.canopen.master.feedback import BusState
from painter.canopen.protocol.frames import Frame
from painter.canopen.sim.rack import Rack

# Frames a step that leave the bus's own cycle its time: the wire's worst case.
AT_ONCE = 4


class Noise:
    """A port that sends the frames of a broken or hostile node."""

    def __init__(self, rack: Rack, seed: int):
        self.random = random.Random(seed)
        self._rack = rack
        self._send = rack.wire.attach(lambda frame, now: None)
        self.count = 0

    def frame(self, ids) -> Frame:
        cob_id = self.random.choice(ids)
        length = self.random.choice((0, 1, 2, 3, 4, 5, 6, 7, 8, 8, 8))
        return Frame(cob_id, self.random.randbytes(length))

    def send(self, ids):
        for _ in range(AT_ONCE):
            self._send(self.frame(ids), self._rack.now)
            self.count += 1


# What the bus's own nodes never send, and so must have no effect: unknown node-IDs,
# unused services, SDO answers, foreign heartbeats.
HARMLESS = [
    *(base + node for base in range(0x180, 0x700, 0x80) for node in range(10, 120)),
    *(0x580 + node for node in range(1, 7)),
    *(0x700 + node for node in range(10, 120)),
    *range(0x101, 0x180),
    *range(0x780, 0x800),
]
# Anything but what legitimately commands nodes: NMT, SYNC, RPDOs, SDO requests and the
# master's heartbeat. No receiver can tell a forged one of these from a true one.
COMMANDS = {
    0x000,
    0x080,
    0x77F,
    *(base + node for base in (0x200, 0x600) for node in range(1, 7)),
}
FORGED = [cob_id for cob_id in range(0x800) if cob_id not in COMMANDS]


def positions(lab):
    return np.array([drive.motor.position for drive in lab.rack.drives.values()])


def run_noise(lab, ids, seed, total):
    noise = Noise(lab.rack, seed)
    lab.rack.stepped = lambda: noise.send(ids)
    while noise.count < total:
        lab.step()
    lab.rack.stepped = lambda: None
    return noise.count


@pytest.mark.parametrize("total", [2000, pytest.param(100_000, marks=pytest.mark.slow)])
def test_frames_that_mean_nothing_change_nothing(lab, total):
    before = positions(lab)
    count = run_noise(lab, HARMLESS, 1, total)
    assert count >= total
    lab.run(0.1)
    counts = lab.master.feedback().statistics
    assert counts.foreign + counts.malformed == count
    assert lab.master.state == BusState.ENABLED, lab.master.reason
    np.testing.assert_allclose(positions(lab), before, atol=1.0)
    lab.sway()
    lab.run(1.05)
    np.testing.assert_allclose(lab.master.feedback().q, 0.4, atol=2e-3)


@pytest.mark.parametrize("total", [2000, pytest.param(100_000, marks=pytest.mark.slow)])
def test_forged_feedback_may_stop_the_arm_but_never_move_it(lab, total):
    before = positions(lab)
    stops = 0
    done = 0
    while done < total:
        done += run_noise(lab, FORGED, done, 500)
        moved = np.abs(positions(lab) - before)
        # Once acknowledged, "target := actual" may take a forged position for the
        # actual one: the drives' own speed limit and following error bound that, so it
        # is inspected before it is acknowledged.
        assert moved.max() <= 2.0
        if lab.master.state == BusState.STOPPED:
            stops += 1
            lab.run(0.5)
            lab.master.acknowledge()
            lab.until(lambda: lab.master.state != BusState.STARTING)
            before = positions(lab)
    assert stops > 0


@pytest.mark.parametrize("total", [2000, pytest.param(100_000, marks=pytest.mark.slow)])
def test_nodes_survive_anything_while_not_enabled(make_lab, total):
    lab = make_lab()
    noise = Noise(lab.rack, 7)
    ids = range(0x800)
    nodes = range(1, 7)
    likely = [0, 0x80, *(b + n for b in (0x200, 0x300, 0x600, 0x700) for n in nodes)]
    while noise.count < total:
        noise.send(ids)
        noise.send(likely)
        lab.cycles += 1
        lab.rack.advance(lab.now)
    lab.run(0.1)
    # After all that, a bring-up that restores the defaults works.
    for node in lab.rack.nodes:
        node.store.write(0x1011, 1, b"load")
    for drive in lab.bus.drives.values():
        drive.restore = True
    make_lab.bring_up(lab)
