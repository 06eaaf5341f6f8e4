"""A paint cycle over the bus beside the same one in the simulated station.

`python -m benchmarks.findings.hil` starts `painter drives --scenario` and
`painter deploy` as processes of their own, lets them paint, and compares the figures
with those of `painter simulate`. Exit status 1 if one differs by more than 10 %. Four
processes at once: on two cores take `--rate 0.5`, which gives all of them twice the
time. How many cycles the bus skipped all the same is said: each leaves the arm 5 ms
behind for a quarter of a second.
"""

import argparse
import contextlib
import json
import shlex
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

from painter.run.figures.tracking_figures import spraying, tip_errors
from painter.run.folder.folder import RunFolder

# What the camera sees differs from run to run, and so does the plan: the largest error
# of the tip while it sprays is one instant of one plan. So the largest one near
# spraying is compared, where all turns count.
NEAR = "tip_error_max_m within 0.1 s of spraying"
FIGURES = ("coverage", "overspray", "tip_error_rms_m", NEAR)
OTHERS = (
    "tip_error_max_m",
    "coverage_half",
    "thickness_cv",
    "keepout_paint",
    "collisions",
    "mask_iou",
)
ALLOWED = 0.10
PAINTER = (sys.executable, "-c", "from painter.cli.main import main; main()")
START_TIME = 120.0
END_TIME = 300.0


def main() -> int:
    """Runs both and prints the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--out", type=Path, default=Path("runs/hil"), help="folder of both runs"
    )
    parser.add_argument("--scenario", default="cubes", help="named scenario or file")
    parser.add_argument("--set", nargs="*", default=[], help="KEY=VALUE over it")
    parser.add_argument(
        "--simulated", type=Path, help="an earlier run of `painter simulate` instead"
    )
    parser.add_argument(
        "--rate", type=float, default=1.0, help="of the clock of bus and drives"
    )
    parser.add_argument("--drives", default="", help="more options of drives")
    parser.add_argument("--deploy", default="", help="more options of deploy")
    arguments = parser.parse_args()
    out: Path = arguments.out
    out.mkdir(parents=True, exist_ok=True)
    sets = [word for pair in arguments.set for word in ("--set", pair)]
    job = (arguments.scenario, *sets)
    over_bus = out / "deployed"
    paint_over_bus(job, over_bus, arguments)
    simulated = arguments.simulated or out / "simulated"
    if not (simulated / "report.json").is_file():
        command = ("simulate", arguments.scenario, *sets, "--no-replay")
        subprocess.run([*PAINTER, *command, "--out", str(simulated)], check=True)
    print(f"cycles skipped by the bus: {skipped_cycles(over_bus)}")
    return compare(read(simulated), read(over_bus))


def paint_over_bus(
    job: tuple[str, ...], run: Path, arguments: argparse.Namespace
) -> None:
    """Runs drives and deploy until the wall is painted and its truth is written."""
    out: Path = arguments.out
    way = ("--interface", "local", "--channel", str(out / "can"))
    way += ("--camera", str(out / "camera"), "--rate", str(arguments.rate))
    log = out / "drives.log"
    with log.open("w") as errors, (out / "drives.json").open("w") as figures:
        drives = subprocess.Popen(
            [*PAINTER, "drives", *way, "--scenario", *job, "--truth", str(run)]
            + ["--json", *shlex.split(arguments.drives)],
            stdout=figures,
            stderr=errors,
            start_new_session=True,
        )
        come_first(drives)
        try:
            wait_for_drives(drives, log)
            command = [*PAINTER, "deploy", *job, *way, "--out", str(run)]
            deploy = subprocess.Popen(
                [*command, *shlex.split(arguments.deploy)], start_new_session=True
            )
            come_first(deploy)
            status = deploy.wait()
            drives.send_signal(signal.SIGINT)
            drives.wait(END_TIME)
        finally:
            drives.kill()
    if status or drives.returncode:
        raise SystemExit(f"deploy {status}, drives {drives.returncode}: {log}")


def come_first(process: subprocess.Popen[bytes]) -> None:
    """Puts a session before others, where niceness counts within sessions alone."""
    with contextlib.suppress(OSError):
        Path(f"/proc/{process.pid}/autogroup").write_text("-19")


def wait_for_drives(drives: subprocess.Popen[bytes], log: Path) -> None:
    """Waits until the drives listen."""
    end = time.monotonic() + START_TIME
    while "drives are on" not in log.read_text():
        if drives.poll() is not None or time.monotonic() > end:
            raise SystemExit(f"the drives did not start: {log}")
        time.sleep(0.1)


def read(run: Path) -> dict[str, Any]:
    """Returns a run's figures."""
    figures: dict[str, Any] = json.loads((run / "report.json").read_text())
    executed = RunFolder.open(run).executed()
    if executed is not None:
        sprayed = executed.time[spraying(executed)]
        after = np.searchsorted(sprayed, executed.time - 0.1)
        near = after < np.searchsorted(sprayed, executed.time + 0.1)
        figures[NEAR] = float(tip_errors(executed)[near].max(initial=0.0))
    return figures


def skipped_cycles(run: Path) -> int:
    """Returns how many cycles the bus skipped because the computer held it up."""
    lines = (run / "events.jsonl").read_text().splitlines()
    events = [json.loads(line) for line in lines]
    return sum(e["overruns"] for e in events if e.get("event") == "bus")


def compare(simulated: dict[str, Any], over_bus: dict[str, Any]) -> int:
    """Prints both runs' figures; returns 1 if one over the bus is too far off.

    Errors may be less over the bus by any share, not more.
    """
    print("| figure | simulated | over the bus | difference | |")
    print("| --- | --- | --- | --- | --- |")
    is_off = False
    for name in (*FIGURES, *OTHERS):
        a, b = simulated.get(name), over_bus.get(name)
        share, mark = "", ""
        if a and b is not None:
            difference = b / a - 1.0
            share = f"{100 * difference:+.1f} %"
            if name in FIGURES:
                worse = difference if "error" in name else abs(difference)
                mark = "ok" if worse <= ALLOWED else "OFF"
                is_off = is_off or worse > ALLOWED
        print(f"| `{name}` | {a} | {b} | {share} | {mark} |")
    return int(is_off)


if __name__ == "__main__":
    sys.exit(main())
