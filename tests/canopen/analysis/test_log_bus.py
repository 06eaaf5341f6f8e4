"""A log in the bus's place: against where the simulated motors truly were."""

import numpy as np
import pytest

from painter.canopen.analysis.log_bus import LogBus
from painter.canopen.config.units import joints_from_axes
from painter.canopen.master.feedback import BusState
from painter.canopen.master.setpoints import Setpoint
from painter.canopen.protocol.frames import SYNC_ID, Frame
from painter.canopen.sim.faults import Fault
from painter.canopen.wire.candump import LogRecord
from painter.errors import InputError


@pytest.fixture
def recorded(make_lab):
    """A lab whose frames are recorded, and where the arm was at each SYNC."""
    lab = make_lab()
    lab.records, lab.truth = [], []

    def note(frame, now):
        lab.records.append(LogRecord(now, frame))
        if frame.cob_id == SYNC_ID:
            drives = lab.rack.drives.values()
            axes = [d.motor.position for d in drives]
            units = [lab.bus.drives[name].units() for name in lab.rack.drives]
            angles = [u.angle(x) for u, x in zip(units, axes, strict=True)]
            lab.truth.append((now, joints_from_axes(np.array(angles))))

    lab.rack.wire.attach(note)
    return lab.bring_up()


def test_samples_are_where_the_arm_was_at_each_sync(recorded):
    recorded.sway(0.2, 2.0)
    recorded.trigger = 0.8
    recorded.run(1.5)
    dut = LogBus(recorded.bus, recorded.records)
    assert dut.report().feedback.bus_state == BusState.ENABLED
    dut.wait_until(dut.end)
    samples = dut.samples(dut.begin)
    times, q = zip(*recorded.truth, strict=True)
    where = np.array([np.interp(samples.time, times, joint) for joint in np.array(q).T])
    # Encoder counts of 1e-6 rad, and 1 ms steps of motors at 0.63 rad/s.
    np.testing.assert_allclose(samples.q, where.T, atol=1e-3)
    assert samples.q.max() > 0.3
    assert samples.trigger[-1] == pytest.approx(0.8, abs=1e-4)
    np.testing.assert_allclose(
        dut.report().feedback.q_commanded, recorded.path(dut.end)[0], atol=0.02
    )


def test_time_advances_only_in_wait_until(recorded):
    recorded.run(0.5)
    dut = LogBus(recorded.bus, recorded.records)
    assert dut.now() == dut.begin
    assert dut.samples(dut.begin).time.size == 0
    dut.wait_until(dut.begin + 0.1)
    assert dut.samples(dut.begin).time.size == pytest.approx(20, abs=1)
    dut.wait_until(dut.begin)
    assert dut.now() == dut.begin + 0.1
    dut.push([Setpoint(dut.now(), np.ones(5), np.zeros(5))])
    dut.stop("has no effect.")
    assert dut.report().feedback.bus_state == BusState.ENABLED


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        (Fault.EMCY, "base_yaw: EMCY 3220h"),
        (Fault.NODE_RESET, "base_yaw: unexpected boot-up"),
        (Fault.ESTOP, "e-stop: the chain is open"),
        (Fault.HEARTBEAT_LOST, "the master stopped the arm"),
    ],
)
def test_the_reason_of_a_stop_is_named(recorded, fault, words):
    recorded.run(0.2)
    at = recorded.now
    recorded.rack.inject(fault)
    recorded.run(0.6)
    dut = LogBus(recorded.bus, recorded.records)
    dut.wait_until(dut.end)
    feedback = dut.report().feedback
    assert feedback.bus_state == BusState.STOPPED
    assert words in feedback.reason
    # Within the step in which it was injected; the heartbeat's time-out is 0.3 s.
    assert at - 0.005 <= feedback.stopped_at <= at + 0.4


def test_a_log_without_motion_is_rejected(make_lab):
    with pytest.raises(InputError, match="at no time in the log are all drives"):
        LogBus(make_lab().bus, [LogRecord(0.1, Frame(SYNC_ID))] * 2)
