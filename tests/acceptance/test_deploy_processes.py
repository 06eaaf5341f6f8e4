"""`painter deploy` and `painter drives` as they are started by hand, in real time.

At a fifth of the real rate, so that a busy computer is not what is tested.
"""

import json
import signal
import subprocess
import sys
import time

import pytest

PAINTER = (sys.executable, "-c", "from painter.cli.main import main; main()")
SCENE = ("blank", "--set", "tile={width: 0.7, height: 0.6, bottom: 0.9}")
RATE = ("--rate", "0.2")
PATIENCE = 200.0

pytestmark = [pytest.mark.slow, pytest.mark.timeout(1800)]


class Bench:
    """Drives, and what commands them, in a folder of their own."""

    def __init__(self, folder):
        self.run = folder / "run"
        self._folder = folder
        self._way = ("--interface", "local", "--channel", str(folder / "can"))
        self.drives = None
        self.deploy = None

    def start_drives(self, *words):
        log = self._folder / "drives.log"
        self.drives = self._start("drives", "--scenario", *SCENE, "--json", *words)
        wait_for(lambda: "drives are on" in log.read_text(), self.drives)

    def start_deploy(self, *words):
        self.deploy = self._start("deploy", *SCENE, "--out", str(self.run), *words)

    def words_of(self, name):
        return " ".join((self._folder / f"{name}.log").read_text().split())

    def comes_to(self, phase):
        wait_for(lambda: phase in self.phases(), self.deploy)

    def phases(self):
        events = self.run / "events.jsonl"
        lines = events.read_text().splitlines() if events.is_file() else []
        return [p for line in lines if (p := json.loads(line).get("phase"))]

    def end_drives(self):
        """Switches the drives off; returns their figures."""
        self.drives.send_signal(signal.SIGINT)
        assert self.drives.wait(PATIENCE) == 0, self.words_of("drives")
        return json.loads((self._folder / "drives.out").read_text())

    def close(self):
        for process in (self.deploy, self.drives):
            if process is not None and process.poll() is None:
                process.kill()
                process.wait()

    def _start(self, command, *words):
        words = (*words, *self._way, *RATE, "--camera", str(self._folder / "camera"))
        with (
            (self._folder / f"{command}.out").open("w") as out,
            (self._folder / f"{command}.log").open("w") as log,
        ):
            return subprocess.Popen([*PAINTER, command, *words], stdout=out, stderr=log)


def wait_for(condition, process):
    end = time.monotonic() + PATIENCE
    while not condition():
        assert process.poll() is None, "the process has ended"
        assert time.monotonic() < end, "not in time"
        time.sleep(0.05)


@pytest.fixture
def bench(tmp_path):
    bench = Bench(tmp_path)
    yield bench
    bench.close()


def test_ctrl_c_stops_the_arm_under_control(bench):
    bench.start_drives()
    bench.start_deploy()
    bench.comes_to("SCAN")
    bench.deploy.send_signal(signal.SIGINT)
    assert bench.deploy.wait(PATIENCE) == 1
    assert "ABORTED: interrupted by the operator." in bench.words_of("deploy")
    report = json.loads((bench.run / "report.json").read_text())
    assert report["result"] == "ABORTED"
    assert bench.phases()[-1] == "ABORTED"
    figures = bench.end_drives()
    states = {value for name, value in figures.items() if name.endswith("_state")}
    assert states == {"SWITCH ON DISABLED"}  # Switched off, not stopped by a watch.


def test_drives_that_are_gone_end_the_job_and_are_named(bench):
    bench.start_drives()
    bench.start_deploy()
    bench.comes_to("SCAN")
    bench.drives.kill()
    assert bench.deploy.wait(PATIENCE) == 1
    words = bench.words_of("deploy")
    assert "FAULT: " in words
    assert "bus lost: local" in words or "camera" in words


def test_the_wrong_drive_fails_the_check_before_anything_moves(bench):
    bench.start_drives("--fault", "wrong_identity@elbow_pitch:0")
    bench.start_deploy()
    assert bench.deploy.wait(PATIENCE) == 1
    words = bench.words_of("deploy")
    for name in ("disk", "calibration", "camera"):
        assert f"ok {name}:" in words
    assert "FAIL drives: elbow_pitch: wrong device: product" in words
    assert "Traceback" not in words
    assert "wrong device" in (bench.run / "INCOMPLETE").read_text()
    assert "LOOK" not in bench.phases()


def test_a_camera_that_is_not_there_fails_the_check(bench):
    bench.start_deploy()
    assert bench.deploy.wait(PATIENCE) == 1
    words = bench.words_of("deploy")
    assert "FAIL camera: camera socket" in words
    assert "No such file" in words
    assert ".." not in words
    assert "Traceback" not in words
