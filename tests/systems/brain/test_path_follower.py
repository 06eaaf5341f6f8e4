"""PathFollower: on time, at rest where it should be, gun open only at full speed."""

import numpy as np
import pytest
from pydrake.common.value import Value
from pydrake.systems.analysis import Simulator

from painter.errors import MotionLimitError
from painter.planning.spray_path import Motion
from painter.systems.brain.path_follower import PathClock, PathFollower
from painter.systems.values import MotionCommand

RAMP = 0.3


def make_motion(spray_on=((1.0, 2.0), (3.0, 4.0))) -> Motion:
    """A quintic of 1 rad of every joint over 5 s, from rest to rest."""
    time = np.linspace(0.0, 5.0, 501)
    s = time / 5.0
    q = 10 * s**3 - 15 * s**4 + 6 * s**5
    v = (30 * s**2 - 60 * s**3 + 30 * s**4) / 5.0
    return Motion(
        time=time,
        q=np.tile(q[:, None], 5),
        v=np.tile(v[:, None], 5),
        spray_on=np.array(spray_on).reshape(-1, 2),
    )


class Rig:
    """A follower with a command that the test exchanges."""

    def __init__(self) -> None:
        self.dut = PathFollower(period=0.01, ramp=RAMP)
        self.simulator = Simulator(self.dut)
        self.context = self.simulator.get_mutable_context()
        self.dut.GetInputPort("state").FixValue(self.context, np.zeros(10))
        self.command(MotionCommand())
        self.simulator.Initialize()

    def command(self, command: MotionCommand) -> None:
        port = self.dut.GetInputPort("motion_command")
        port.FixValue(self.context, Value(command))

    def advance(self, time: float, step: float = 0.005) -> list[tuple]:
        """Advances and returns (t, q1, v1, trigger) samples."""
        samples = []
        while self.context.get_time() < time - 1e-9:
            self.simulator.AdvanceTo(min(time, self.context.get_time() + step))
            x = self.dut.GetOutputPort("desired_state").Eval(self.context)
            trigger = self.dut.GetOutputPort("trigger").Eval(self.context)[0]
            samples.append((self.context.get_time(), x[0], x[5], trigger))
        return samples

    @property
    def status(self):
        return self.dut.GetOutputPort("status").Eval(self.context)


def test_holds_where_the_arm_was_until_a_motion_comes():
    dut = PathFollower(period=0.01)
    simulator = Simulator(dut)
    context = simulator.get_mutable_context()
    q = np.array([0.1, -0.2, 0.3, 0.0, 0.5])
    dut.GetInputPort("state").FixValue(context, np.concatenate([q, np.ones(5)]))
    port = dut.GetInputPort("motion_command")
    port.FixValue(context, Value(MotionCommand()))
    simulator.AdvanceTo(0.2)
    expected = np.concatenate([q, np.zeros(5)])
    desired = dut.GetOutputPort("desired_state").Eval(context)
    np.testing.assert_array_equal(desired, expected)


def test_follows_the_motion_in_time_and_opens_the_gun_in_its_intervals():
    rig = Rig()
    motion = make_motion()
    rig.command(MotionCommand(number=1, motion=motion))
    samples = np.array(rig.advance(6.0))
    start = samples[:, 0] - 0.0
    reference = motion.trajectory.vector_values(np.clip(start, 0, 5))[0]
    # The command is seen at t = 0, and the motion begins then.
    np.testing.assert_allclose(samples[:, 1], reference, atol=1e-9)
    on = samples[samples[:, 3] > 0.5, 0]
    inside = ((on >= 1.0) & (on < 2.0)) | ((on >= 3.0) & (on < 4.0))
    assert inside.all()
    assert len(on) == pytest.approx(2.0 / 0.005, abs=4)
    assert rig.status.done


def test_stop_is_smooth_and_resume_sprays_every_part_once():
    rig = Rig()
    motion = make_motion()
    rig.command(MotionCommand(number=1, motion=motion))
    samples = rig.advance(1.5)
    rig.command(MotionCommand(number=1, motion=motion, rate=0.0))
    samples += rig.advance(3.0)
    assert rig.status.rate == 0.0
    assert samples[-1][2] == 0.0
    rig.command(MotionCommand(number=1, motion=motion, rate=1.0))
    samples += rig.advance(12.0)
    assert rig.status.done
    t, q, v, trigger = np.array(samples).T
    # Speed changes no faster than the ramp asks for: v_max / ramp, with the motion's
    # own acceleration (at most 5.77/25 rad/s²) on top and a full turn at 2 v_max.
    v_max = 1.875 / 5.0
    assert np.abs(np.diff(v) / np.diff(t)).max() < v_max / RAMP + 0.25
    # The gun is open over each planned part of the path exactly once.
    q_on = q[trigger > 0.5]
    knots = motion.trajectory.vector_values([1.0, 2.0, 3.0, 4.0])[0]
    first = q_on[q_on < knots[1] + 1e-6]
    assert first.min() == pytest.approx(knots[0], abs=2 * v_max * 0.005)
    assert first.max() == pytest.approx(knots[1], abs=2 * v_max * 0.005)
    assert np.all(np.diff(q_on) > 0.0)  # Never over the same place again.
    assert np.diff(first).max() < 3 * v_max * 0.005  # And no gap.


def test_gun_stays_closed_when_the_command_says_so():
    rig = Rig()
    rig.command(MotionCommand(number=1, motion=make_motion(), spray=False))
    assert not any(sample[3] for sample in rig.advance(6.0))


def test_refuses_a_motion_that_begins_elsewhere():
    rig = Rig()
    motion = make_motion()
    rig.command(MotionCommand(number=1, motion=motion.replace(q=motion.q + 0.01)))
    with pytest.raises(MotionLimitError, match="0.01"):
        rig.advance(0.1)


def test_clock_integrates_its_rate():
    clock = PathClock(start=1.0, origin=2.0, rate=1.0, target=0.0, ramp=RAMP)
    position, rate = clock.at(1.0 + RAMP)
    assert rate == 0.0
    assert position == pytest.approx(2.0 + 0.5 * RAMP)
    turned = clock.turned_to(-1.0, 5.0)
    assert turned.at(5.0 + RAMP + 1.0)[0] == pytest.approx(2.0 - 1.0)


@pytest.mark.parametrize("field", ["period", "ramp"])
def test_refuses_times_that_are_not_positive(field):
    with pytest.raises(ValueError, match="> 0 s"):
        PathFollower(**({"period": 0.01, "ramp": 0.3} | {field: 0.0}))
