"""`painter canlog` on a log of simulated drives, written as the bus process does."""

import json

import numpy as np
import pytest

from painter.canopen.config.bus_file import load_bus
from painter.canopen.master.arm_bus import ArmBus
from painter.canopen.master.feedback import BusState
from painter.canopen.master.setpoints import Setpoint
from painter.canopen.sim.faults import Fault
from painter.canopen.sim.rack import Rack
from painter.canopen.wire.candump import LogRecord, format_record
from painter.cli.main import run
from painter.resources import models_path

START = 1_700_000_000.0


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    """Bring-up, 0.5 s of motion, an emergency of the elbow's drive."""
    path = tmp_path_factory.mktemp("canlog") / "bus.log"
    bus = load_bus(models_path("bus", "painter.bus.yaml"))
    rack, records = Rack(bus), []
    rack.wire.attach(lambda frame, now: records.append(LogRecord(START + now, frame)))
    master, fault_at, end, cycle = ArmBus(bus, rack.transport), None, None, 0
    master.start()
    while end is None or cycle * bus.cycle < end:
        now = cycle * bus.cycle
        rack.advance(now)
        if master.state == BusState.ENABLED:
            if end is None:
                fault_at, end = now + 0.5, now + 0.7
            moved = np.full(5, 0.05 * max(0.0, now - fault_at + 0.5))
            speed = np.full(5, 0.05)
            master.push([Setpoint(now + 0.005, moved + 0.05 * 0.005, speed, 0.0)])
            if now >= fault_at:
                rack.inject(Fault.EMCY, "elbow_pitch")
        master.cycle(now)
        for i in range(1, 5):
            rack.advance(now + i * 1e-3)
            master.poll(now + i * 1e-3)
        cycle += 1
    path.write_text("".join(format_record(r, "can0") + "\n" for r in records))
    return path


def test_changes_read_as_the_story_of_the_run(log, capsys):
    assert run(["canlog", str(log), "--changes", "--node", "elbow_pitch"]) == 0
    lines = capsys.readouterr().out.splitlines()
    text = "\n".join(line.split(maxsplit=2)[2] for line in lines)
    story = [
        "reset node",
        "boot-up",
        "6060h mode := 8 CYCLIC SYNC POSITION",
        "start",
        "SHUTDOWN",
        "READY TO SWITCH ON",
        "SWITCHED ON",
        "ENABLE OPERATION",
        "OPERATION ENABLED",
        "3220h DC link under-voltage",
        "FAULT",
    ]
    at = 0
    for word in story:
        at = text.index(word, at)
    assert len(lines) < 300  # Of thousands of frames.


def test_figures_name_what_went_wrong(log, capsys):
    assert run(["canlog", str(log), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["frames"] == len(log.read_text().splitlines())
    assert found["sync_period_s"] == pytest.approx(0.005, abs=1e-6)
    assert len(found["errors"]) == 1
    assert "elbow_pitch emcy 3220h" in found["errors"][0]
    # Five drives at 200 Hz, worst-case bits: 0.35 (test_arm_bus.py counts them). What
    # bring-up reads and writes comes on top, in a log of a second.
    assert 0.2 < found["bus_load"] <= 0.45


def test_only_what_is_asked_for_is_shown(log, capsys):
    words = ["--kind", "sync", "--since", "0.5", "--until", "0.6"]
    assert run(["canlog", str(log), *words]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 20
    assert all(0.5 <= float(line.split()[0]) <= 0.6 for line in lines)


def test_a_log_is_played_into_the_robots_diagram(log, tmp_path, capsys):
    assert run(["canlog", str(log), "--replay", str(tmp_path / "out"), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    with np.load(tmp_path / "out" / "executed.npz") as executed:
        time, q, X_WG = executed["time"], executed["q"], executed["X_WG"]
    # All joints at 0.05 rad/s for half a second from when they were enabled.
    middle = q[np.searchsorted(time, 0.4)] - q[np.searchsorted(time, 0.2)]
    np.testing.assert_allclose(middle, 0.01, atol=1e-4)
    stop, reason = found["stops"][0].split(maxsplit=1)
    assert "elbow_pitch: EMCY 3220h" in reason
    assert float(stop) == pytest.approx(0.5, abs=0.03)
    assert np.linalg.det(X_WG[-1, :3, :3]) == pytest.approx(1.0)
    # Shoulder, elbow and wrist pitch alone lower the gun by some cm.
    assert 0.02 < found["tip_travel_m"] < 0.2


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (["none.log"], "none.log: no such log"),
        (["none.log", "--replay", "out"], "none.log: no such log"),
        (["{log}", "--node", "knee"], "--node 'knee': known are base_yaw"),
        (["{log}", "--bus", "none.yaml"], "none.yaml: no such bus file"),
        (["{log}", "--kind", "pdo"], "--kind"),
    ],
)
def test_wrong_use_is_one_line(log, capsys, words, text):
    words = [word.format(log=log) for word in words]
    assert run(["canlog", *words]) == 2
    error = capsys.readouterr().err
    assert text in error
    assert len(error.splitlines()) == 1
