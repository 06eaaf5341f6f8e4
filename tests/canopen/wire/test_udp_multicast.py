"""Bus and drives as two processes over UDP multicast, in a network of their own.

Multicast leaves by the default route: in a namespace without one nothing gets out.
"""

import importlib.util
import shutil
import subprocess
import sys
import textwrap

import pytest

# The way into a network namespace in which multicast goes round on "lo".
_ALONE = (
    "unshare", "--net", "sh", "-c",
    'ip link set lo up && ip route add 239.0.0.0/8 dev lo && exec "$@"', "sh",
)  # fmt: skip
_PROGRAM = textwrap.dedent("""
    import dataclasses, signal, subprocess, sys, time
    import numpy as np
    from painter.canopen.config.bus_file import load_bus
    from painter.canopen.process.bus_process import BusProcess
    from painter.canopen.master.feedback import BusState
    from painter.canopen.master.setpoints import Setpoint
    from painter.resources import models_path

    def wait_for(dut, state):
        while True:
            report = dut.report()
            if report is not None and report.feedback.bus_state == state:
                return report.feedback
            time.sleep(0.01)

    if __name__ == "__main__":
        way = ["--interface", "udp_multicast", "--channel", "239.74.163.2"]
        code = (
            "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)\\n"
            "from painter.cli.main import main; main()"
        )
        command = [sys.executable, "-c", code, "drives", *way, "--json"]
        drives = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
        assert "drives are on udp_multicast" in drives.stderr.readline()
        bus = load_bus(models_path("bus", "painter.bus.yaml"))
        bus = dataclasses.replace(bus, interface=way[1], channel=way[3], cycle=0.02)
        # Far longer than delays on two busy cores; lost datagrams are asked for again.
        bus.timeouts = dataclasses.replace(
            bus.timeouts, heartbeat=20.0, tpdo=20.0, setpoint=20.0, boot=20.0, sdo=1.0,
            brake=20.0, transition=20.0, rpdo_cycles=1000)
        bus.io = dataclasses.replace(bus.io, deadline=20.0)
        with BusProcess(bus) as dut:
            dut.start()
            q0 = wait_for(dut, BusState.ENABLED).q
            start, points = dut.now() + 2.0, []
            for i in range(51):
                s = i / 50
                points.append(Setpoint(start + 0.5 * s, q0 + 0.1 * s * s * (3 - 2 * s),
                                       np.full(5, 1.2 * s * (1 - s))))
            dut.push(points)
            while np.abs(dut.report().feedback.q - q0 - 0.1).max() > 1e-3:
                time.sleep(0.01)
            feedback = dut.report().feedback
            assert feedback.bus_state == BusState.ENABLED, feedback.reason
            # UDP returns a bus its own frames; none was taken for a node's.
            assert feedback.statistics.foreign == 0, feedback.statistics
        drives.send_signal(signal.SIGINT)
        drives.wait()
""")


def _is_possible() -> bool:
    if importlib.util.find_spec("msgpack") is None or not shutil.which("unshare"):
        return False
    return subprocess.run([*_ALONE, "true"], capture_output=True).returncode == 0


@pytest.mark.skipif(not _is_possible(), reason="needs msgpack and a network namespace")
def test_the_arm_moves_over_udp_multicast(tmp_path):
    script = tmp_path / "program.py"
    script.write_text(_PROGRAM)
    done = subprocess.run(
        [*_ALONE, sys.executable, str(script)],
        capture_output=True,
        text=True,
        timeout=100,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("SWITCH ON DISABLED") == 5, done.stdout
