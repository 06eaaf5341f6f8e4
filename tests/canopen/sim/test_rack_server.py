"""The simulated drives' time follows the SYNCs, whatever delays either process."""

import dataclasses
import itertools

import pytest

from painter import timebase
from painter.canopen.config.bus_file import load_bus
from painter.canopen.protocol.frames import SYNC_ID, Frame
from painter.canopen.protocol.nmt import NmtState
from painter.canopen.sim.server import RackServer
from painter.resources import models_path

SYNC = Frame(SYNC_ID)
TARGET = Frame(0x202, bytes(6))


@pytest.fixture
def bench(tmp_path, monkeypatch):
    """A server whose clock and frames are the test's."""
    bench = Bench()
    monkeypatch.setattr(timebase.time, "monotonic", lambda: bench.now)
    bus = load_bus(models_path("bus", "painter.bus.yaml"))
    bus = dataclasses.replace(bus, interface="local", channel=str(tmp_path / "can"))
    bench.server = RackServer(bus)
    bench.server.transport.receive = bench.receive
    bench.server.rack.wire.attach(bench.hear)
    bench.set_cycle(milliseconds=5)
    yield bench
    bench.server.close()


class Bench:
    def __init__(self):
        self.now = 100.0
        self.batch = []
        self.heard = []

    def set_cycle(self, milliseconds):
        """Writes the cycle to the drives and makes them operational."""
        for drive in self.server.rack.drives.values():
            drive.store.fix(0x60C2, 1, milliseconds)
            drive.nmt = NmtState.OPERATIONAL

    def receive(self, timeout):
        batch, self.batch = self.batch, []
        return batch

    def hear(self, frame, time):
        if frame.cob_id in (SYNC_ID, TARGET.cob_id):
            self.heard.append((frame.cob_id, time))

    def until(self, time):
        """Serves each quarter of a millisecond."""
        while self.now < time:
            self.now += 0.00025
            self.server.serve()

    def syncs(self):
        return [time for cob_id, time in self.heard if cob_id == SYNC_ID]


def test_late_syncs_are_a_cycle_apart_for_the_drives(bench):
    for arrival in (100.005, 100.010, 100.018, 100.0205, 100.065, 100.066):
        bench.until(arrival)
        bench.batch = [SYNC]
        bench.until(arrival + 5e-4)
    times = bench.syncs()
    assert len(times) == 6
    gaps = [b - a for a, b in itertools.pairwise(times)]
    assert gaps == pytest.approx([0.005] * 5, abs=1e-9)
    assert bench.server.sync_late == pytest.approx(0.0395, abs=1e-3)
    assert bench.server.slips == 0


def test_the_cycle_is_that_written_to_the_drives_not_that_of_the_bus_file(bench):
    bench.set_cycle(milliseconds=40)
    for arrival in (100.040, 100.080, 100.123, 100.160):
        bench.until(arrival)
        bench.batch = [SYNC]
        bench.until(arrival + 5e-4)
    gaps = [b - a for a, b in itertools.pairwise(bench.syncs())]
    assert gaps == pytest.approx([0.040] * 3, abs=1e-9)


def test_time_waits_for_no_sync_before_a_drive_is_operational(bench):
    for drive in bench.server.rack.drives.values():
        drive.nmt = NmtState.PRE_OPERATIONAL
    bench.until(100.005)
    bench.batch = [SYNC]
    bench.until(100.040)
    assert bench.server.rack.now == pytest.approx(0.040, abs=3e-3)


def test_a_silent_master_does_not_stop_the_drives_time(bench):
    bench.until(100.005)
    bench.batch = [SYNC]
    bench.until(100.050)
    # A cycle after the only one, it waits.
    held = bench.server.rack.now
    assert held == pytest.approx(bench.syncs()[0] + 0.005, abs=1e-3)
    bench.until(100.2)
    # It has waited for 50 ms and caught up.
    assert bench.server.rack.now == pytest.approx(0.2, abs=3e-3)


def test_targets_received_before_a_late_sync_are_carried_before_it(bench):
    bench.until(100.005)
    bench.batch = [SYNC, TARGET]
    bench.until(100.018)
    bench.batch = [TARGET, SYNC, TARGET, SYNC, TARGET]
    bench.until(100.020)
    heard = [cob_id for cob_id, _ in bench.heard]
    assert heard == [SYNC_ID, TARGET.cob_id, TARGET.cob_id] + 2 * [
        SYNC_ID,
        TARGET.cob_id,
    ]
