"""Bus and drives in real time on a real SocketCAN interface: `make test-socketcan`.

The interface is slow and so is the clock where these run: they wait for conditions,
never for a time.
"""

import dataclasses
import os
import shutil
import signal
import socket
import struct
import subprocess
import sys
import time

import numpy as np
import pytest

from painter.canopen.config.bus_file import load_bus
from painter.canopen.master.feedback import BusState
from painter.canopen.master.setpoints import Setpoint
from painter.canopen.process.bus_process import BusProcess
from painter.canopen.protocol.frames import ERROR_BUS_OFF, SYNC_ID, Frame
from painter.canopen.wire.candump import read_log
from painter.canopen.wire.transports import PythonCanTransport, TransportError
from painter.resources import models_path

CHANNEL = os.environ.get("PAINTER_CAN")
pytestmark = pytest.mark.skipif(CHANNEL is None, reason="needs make test-socketcan")
PATIENCE = 120.0
ERROR_FLAG = 0x20000000  # Linux, include/uapi/linux/can.h: CAN_ERR_FLAG.


def wait_for(condition, what):
    end = time.monotonic() + PATIENCE
    while not (found := condition()):
        assert time.monotonic() < end, what
        time.sleep(0.02)
    return found


def state_is(process, state):
    def check():
        report = process.report()
        return report if report and report.feedback.bus_state == state else None

    return check


def set_link(state):
    subprocess.run(["ip", "link", "set", CHANNEL, state], check=True)


def send_raw(can_id, data=bytes(8)):
    """Sends like the driver of a controller, the only source of error frames."""
    with socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW) as raw:
        raw.bind((CHANNEL,))
        raw.send(struct.pack("=IB3x8s", can_id, len(data), data))


@pytest.fixture
def bus():
    bus = load_bus(models_path("bus", "painter.bus.yaml"))
    bus = dataclasses.replace(bus, interface="socketcan", channel=CHANNEL, cycle=0.04)
    bus.timeouts = dataclasses.replace(
        bus.timeouts, heartbeat=20.0, tpdo=20.0, setpoint=20.0, boot=10.0, sdo=5.0,
        brake=60.0, transition=60.0, rpdo_cycles=1000,
    )  # fmt: skip
    bus.io = dataclasses.replace(bus.io, deadline=5.0)
    return bus


@pytest.fixture
def drives(bus):
    # A script starts background jobs with SIGINT ignored; children inherit that.
    code = (
        "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "from painter.cli.main import main; main()"
    )
    command = [sys.executable, "-c", code, "drives", "--json"]
    command += ["--interface", "socketcan", "--channel", CHANNEL]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    while b"drives are on" not in process.stderr.readline():
        assert process.poll() is None
    yield process
    if process.poll() is None:
        process.send_signal(signal.SIGINT)
    process.communicate(timeout=PATIENCE)


@pytest.fixture
def enabled(bus, drives, tmp_path):
    with BusProcess(bus, log=tmp_path / "bus.log") as process:
        process.start()
        wait_for(state_is(process, BusState.ENABLED), "not enabled")
        yield process


def move(process, goal):
    q0, start = process.report().feedback.q_commanded, time.monotonic() + 0.5
    points = []
    for i in range(41):
        s = i / 40
        q = q0 + s * s * (3 - 2 * s) * (goal - q0)
        points.append(Setpoint(start + s, q, 6 * s * (1 - s) * (goal - q0)))
    process.push(points)
    wait_for(
        lambda: np.allclose(process.report().feedback.q, goal, atol=1e-3),
        "the goal is not reached",
    )


def test_the_arm_is_enabled_moves_and_stops(enabled):
    goal = np.array([0.1, 0.1, 0.1, 0.1, -0.1])
    move(enabled, goal)
    assert enabled.report().feedback.bus_state == BusState.ENABLED
    enabled.stop("a test says so.")
    wait_for(state_is(enabled, BusState.STOPPED), "not stopped")
    enabled.acknowledge()
    wait_for(state_is(enabled, BusState.ENABLED), "not enabled again")
    move(enabled, np.zeros(5))


def test_bus_off_stops_the_arm_and_an_acknowledgement_starts_it(enabled, tmp_path):
    send_raw(ERROR_FLAG | ERROR_BUS_OFF)
    report = wait_for(state_is(enabled, BusState.STOPPED), "not stopped")
    assert "bus-off" in report.feedback.reason
    recover(enabled)
    move(enabled, np.full(5, 0.05))

    def errors():
        records = read_log(tmp_path / "bus.log")
        return [record.frame.cob_id for record in records if record.frame.is_error]

    wait_for(errors, "no error frame in the log")
    assert errors() == [ERROR_BUS_OFF]


def test_a_link_that_goes_down_stops_the_arm_until_it_is_back(enabled, drives):
    set_link("down")
    try:
        report = wait_for(state_is(enabled, BusState.STOPPED), "not stopped")
        assert "bus lost" in report.feedback.reason
        enabled.acknowledge()
        rejection = wait_for(lambda: enabled.report().rejection, "not refused")
        assert "still lost" in rejection
    finally:
        set_link("up")
    recover(enabled)
    move(enabled, np.full(5, 0.05))


def recover(process):
    """Acknowledges until the arm is enabled: the bus takes a moment to be back."""

    seen = []

    def is_enabled():
        report = process.report()
        feedback = report.feedback
        seen.append((feedback.bus_state, feedback.reason, report.rejection))
        if feedback.bus_state == BusState.STOPPED:
            process.acknowledge()
            time.sleep(0.5)
        return feedback.bus_state == BusState.ENABLED

    wait_for(is_enabled, seen)


def test_a_link_reports_errors_and_opens_again():
    dut, other = (PythonCanTransport("socketcan", CHANNEL, 1_000_000) for _ in range(2))
    other.send(Frame(0x123, b"abc"))
    assert dut.receive(5.0) == [Frame(0x123, b"abc")]
    send_raw(ERROR_FLAG | ERROR_BUS_OFF)
    assert dut.receive(5.0) == [Frame(ERROR_BUS_OFF, bytes(8), is_error=True)]
    set_link("down")
    try:
        with pytest.raises(TransportError):
            for _ in range(100):
                dut.send(Frame(0x80))
                dut.receive(0.01)
    finally:
        set_link("up")
    dut.reopen()
    other.reopen()
    other.send(Frame(0x124))
    assert dut.receive(5.0) == [Frame(0x124)]
    dut.close()
    other.close()
    with pytest.raises(TransportError, match="can99"):
        PythonCanTransport("socketcan", "can99", 1_000_000)


@pytest.mark.skipif(shutil.which("candump") is None, reason="needs can-utils")
def test_logs_of_candump_itself_are_read(tmp_path):
    log = tmp_path / "peer.log"
    with log.open("w") as out:
        peer = subprocess.Popen(
            ["candump", "-L", f"{CHANNEL},0:0,#FFFFFFFF"], stdout=out
        )
        transport = PythonCanTransport("socketcan", CHANNEL, 1_000_000)
        sent = [Frame(SYNC_ID), Frame(0x185, bytes(range(8)))]
        wait_for(lambda: _passes(transport, log), "candump does not start")
        for frame in sent:
            transport.send(frame)
        send_raw(ERROR_FLAG | ERROR_BUS_OFF)
        wait_for(lambda: "20000040#" in log.read_text(), "no error frame")
        peer.terminate()
        peer.wait()
        transport.close()
    frames = [record.frame for record in read_log(log)]
    assert frames[-3:] == [*sent, Frame(ERROR_BUS_OFF, bytes(8), is_error=True)]


def _passes(transport, log):
    transport.send(Frame(0x7FF))
    time.sleep(0.2)
    return "7FF#" in log.read_text()
