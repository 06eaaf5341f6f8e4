"""How long `painter X --help` and a TAB take, from the start of the process to its end.

Prints for each command the median of five runs, s: elapsed time and, since other work
on the machine only adds to that, the processors' time. The last rows are the floor:
what Python itself takes, and `import painter`. Limits: --help 0.4 s, a TAB 0.3 s.

    python -m benchmarks.speed.command_start [--repeats N]
"""

import argparse
import os
import statistics
import subprocess
import sys
import time

from painter.cli.main import COMMANDS

MAIN = ["-m", "painter"]


def measure(
    arguments: list[str], repeats: int, **environment: str
) -> tuple[float, float]:
    """Returns medians of a Python process's elapsed and processors' time, s."""
    elapsed, used = [], []
    for _ in range(repeats):
        start = time.perf_counter()
        process = subprocess.Popen(
            [sys.executable, *arguments],
            stdout=subprocess.DEVNULL,
            env=os.environ | environment,
        )
        _, _, usage = os.wait4(process.pid, 0)
        elapsed.append(time.perf_counter() - start)
        used.append(usage.ru_utime + usage.ru_stime)
    return statistics.median(elapsed), statistics.median(used)


def completion(typed: str) -> dict[str, str]:
    """Returns the variables by which bash asks for completion at the end of a line."""
    return {
        "_PAINTER_COMPLETE": "complete_bash",
        "COMP_WORDS": typed,
        "COMP_CWORD": str(len(typed.split(" ")) - 1),
    }


def main() -> None:
    """Measures and prints the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=5)
    repeats = parser.parse_args().repeats
    print(f"{'':36} {'elapsed':>8} {'cpu':>8}")
    rows: list[tuple[str, list[str], dict[str, str]]] = [
        (f"painter {name} --help", [*MAIN, name, "--help"], {}) for name in COMMANDS
    ]
    rows += [
        (f"{typed}<TAB>", MAIN, completion(typed))
        for typed in ("painter s", "painter simulate te", "painter segment --")
    ]
    rows += [
        ("python -c pass", ["-c", "pass"], {}),
        ("import painter", ["-c", "import painter"], {}),
    ]
    for name, arguments, environment in rows:
        elapsed, used = measure(arguments, repeats, **environment)
        print(f"{name:36} {elapsed:8.2f} {used:8.2f}", flush=True)


if __name__ == "__main__":
    main()
