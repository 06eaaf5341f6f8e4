"""Prints which share of lines and branches the tests reach, room by room.

`make coverage` runs the fast tests under coverage and calls this; what child processes
run is not counted.
"""

import json
import sys
from collections import defaultdict
from pathlib import Path

COUNTS = ("covered_lines", "num_statements", "covered_branches", "num_branches")


def main() -> None:
    """Prints a line for each room of the file that is given, coverage.json."""
    path = Path(sys.argv[1] if len(sys.argv) > 1 else "coverage.json")
    rooms: dict[str, list[int]] = defaultdict(lambda: [0] * len(COUNTS))
    for name, file in json.loads(path.read_text())["files"].items():
        counts = [file["summary"][key] for key in COUNTS]
        for room in (str(Path(name).parent), "all"):
            rooms[room] = [a + b for a, b in zip(rooms[room], counts, strict=True)]
    whole = rooms.pop("all")
    print(f"{'room':36} lines  branches")
    for room, counts in [*sorted(rooms.items()), ("all", whole)]:
        shares = (share(*counts[:2]), share(*counts[2:]))
        print(f"{room:36} {shares[0]:>5}  {shares[1]:>8}")


def share(covered: int, total: int) -> str:
    """Returns covered / total in percent, or a dash for nothing."""
    return f"{100 * covered / total:.0f} %" if total else "–"


if __name__ == "__main__":
    main()
