"""The bus in its own process against drives in another, in real time."""

import dataclasses
import os
import pickle
import signal
import subprocess
import sys
import textwrap
import time
from pathlib import Path

import numpy as np
import pytest

from painter.canopen.config.bus_file import load_bus
from painter.canopen.master.feedback import BusState
from painter.canopen.master.setpoints import Setpoint
from painter.canopen.process.bus_process import BusProcess
from painter.canopen.process.mailbox import Mailbox
from painter.canopen.wire.candump import read_log
from painter.canopen.wire.transports import LocalTransport, TransportError
from painter.errors import BusError
from painter.resources import models_path

# Limit for hangs. A busy test machine may delay any process; nothing depends on speed.
PATIENCE = 60.0


def wait_for(condition, what):
    end = time.monotonic() + PATIENCE
    while not (found := condition()):
        assert time.monotonic() < end, what
        time.sleep(0.01)
    return found


@pytest.fixture
def bus(tmp_path):
    bus = load_bus(models_path("bus", "painter.bus.yaml"))
    bus = dataclasses.replace(
        bus, interface="local", channel=str(tmp_path / "can"), cycle=0.02
    )
    # Drives and bus share two cores with other tests: far longer than any delay.
    bus.timeouts = dataclasses.replace(
        bus.timeouts, heartbeat=20.0, tpdo=20.0, setpoint=20.0, boot=20.0, sdo=20.0,
        brake=20.0, transition=20.0, rpdo_cycles=1000,
    )  # fmt: skip
    bus.io = dataclasses.replace(bus.io, deadline=20.0)
    return bus


@pytest.fixture
def drives(bus):
    # A script starts background jobs with SIGINT ignored; children inherit that.
    code = (
        "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "from painter.cli.main import main; main()"
    )
    command = [sys.executable, "-c", code, "drives", "--json"]
    command += ["--interface", "local", "--channel", bus.channel]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE)

    def is_there():
        try:
            LocalTransport(bus.channel).close()
        except TransportError:
            assert process.poll() is None, process.stderr.read()
            return False
        return True

    wait_for(is_there, "the drives do not listen")
    yield process
    if process.poll() is None:
        process.send_signal(signal.SIGINT)
    process.communicate(timeout=PATIENCE)


def state_is(process, state):
    def check():
        report = process.report()
        return report if report and report.feedback.bus_state == state else None

    return check


def test_the_arm_moves_and_switches_off(bus, drives):
    with BusProcess(bus) as dut:
        dut.start()
        report = wait_for(state_is(dut, BusState.ENABLED), "not enabled")
        q0, start = report.feedback.q, time.monotonic() + 2.0
        goal, duration = np.array([0.1, 0.1, 0.1, 0.1, -0.1]), 0.5
        points = []
        for i in range(51):
            s = i / 50
            q = q0 + s * s * (3 - 2 * s) * goal
            v = 6 * s * (1 - s) / duration * goal
            points.append(Setpoint(start + s * duration, q, v))
        dut.push(points)
        wait_for(
            lambda: np.allclose(dut.report().feedback.q, q0 + goal, atol=1e-3),
            "the goal is not reached",
        )
        assert dut.report().feedback.bus_state == BusState.ENABLED
        dut.stop("stopped by the test.")
        wait_for(state_is(dut, BusState.STOPPED), "not stopped")
        assert dut.report().feedback.reason == "stopped by the test."
        dut.acknowledge()
        wait_for(state_is(dut, BusState.ENABLED), "not enabled again")
    assert not dut.is_alive


def test_a_rejected_command_is_in_the_report(bus, drives):
    with BusProcess(bus) as dut:
        dut.acknowledge()
        rejection = wait_for(
            lambda: (r := dut.report()) and r.rejection, "nothing was rejected"
        )
        assert "nothing to acknowledge" in rejection


def test_a_bus_that_cannot_be_opened_gives_the_cause(bus):
    with BusProcess(bus) as dut:
        wait_for(lambda: not dut.is_alive, "still alive")
        with pytest.raises(BusError, match="local .*: No such file"):
            dut.report()


def test_the_arm_stops_when_the_commanding_program_is_killed(bus, drives, tmp_path):
    code = textwrap.dedent("""
        import pickle, sys, time
        from painter.canopen.process.bus_process import BusProcess
        from painter.canopen.master.feedback import BusState
        if __name__ == "__main__":
            dut = BusProcess(pickle.loads(sys.stdin.buffer.read()))
            dut.start()
            state = None
            while state != BusState.ENABLED:
                time.sleep(0.01)
                report = dut.report()
                state = report and report.feedback.bus_state
            print(dut.pid, flush=True)
            time.sleep(1000)
    """)
    script = tmp_path / "program.py"
    script.write_text(code)
    program = subprocess.Popen(
        [sys.executable, str(script)], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    )
    program.stdin.write(pickle.dumps(bus))
    program.stdin.close()
    pid = int(program.stdout.readline())
    program.kill()
    program.wait()

    def is_gone():
        try:
            os.kill(pid, 0)
        except ProcessLookupError:
            return True
        state = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0]
        return state == "Z"

    wait_for(is_gone, "the bus process lives on")
    program.stdout.close()
    drives.send_signal(signal.SIGINT)
    out, _ = drives.communicate(timeout=PATIENCE)
    assert out.count(b"SWITCH ON DISABLED") == 5


def test_drives_stop_and_the_log_is_whole_when_the_bus_process_is_killed(
    bus, drives, tmp_path
):
    log = tmp_path / "bus.log"
    bus.timeouts = dataclasses.replace(bus.timeouts, heartbeat=5.0)
    dut = BusProcess(bus, log=log)
    dut.start()
    wait_for(state_is(dut, BusState.ENABLED), "not enabled")
    os.kill(dut.pid, signal.SIGKILL)
    listener, silent = LocalTransport(bus.channel), set(range(0x081, 0x086))

    def have_drives_missed_the_master():
        silent.difference_update(f.cob_id for f in listener.receive(0.0))
        return not silent

    wait_for(lambda: not dut.is_alive, "still alive")
    with pytest.raises(BusError, match="has ended"):
        dut.report()
    dut.close()
    frames = [record.frame for record in read_log(log)]
    enable = b"\x0f\0"  # Controlword of all five RPDOs.
    enabled = {f.cob_id for f in frames if f.data[:2] == enable and f.cob_id < 0x300}
    assert enabled >= {0x201, 0x202, 0x203, 0x204, 0x205}
    assert log.read_text().endswith("\n")
    # The drives' own monitors of heartbeat and RPDO; each sends an EMCY and stops.
    wait_for(have_drives_missed_the_master, "drives have not missed the master")
    listener.close()
    drives.send_signal(signal.SIGINT)
    out, _ = drives.communicate(timeout=PATIENCE)
    assert out.count(b"QUICK STOP ACTIVE") == 5


def test_mailbox_keeps_the_newest_value():
    dut = Mailbox(64)
    other = Mailbox(64, name=dut.name)
    try:
        assert other.get() is None
        for i in range(5):
            dut.put(i)
        assert other.get() == (5, 4)
        with pytest.raises(ValueError, match="holds 64 bytes"):
            dut.put("x" * 100)
    finally:
        other.close()
        dut.close()
