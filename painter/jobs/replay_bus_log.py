"""A bus log replayed through the robot's station, into executed.npz."""

from pathlib import Path
from typing import Any

import numpy as np

from painter.canopen.analysis.log_bus import LogBus
from painter.canopen.config.bus_config import BusConfig
from painter.canopen.wire.candump import read_log
from painter.config import Scenario
from painter.cycle.log_replay import ReplayLog
from painter.errors import InputError
from painter.run.folder.arrays import save_executed


def replay_bus_log(log: Path, bus: BusConfig, folder: Path) -> dict[str, Any]:
    """Replays a log through the robot's station and writes executed.npz.

    Args:
        log: Log in candump's format.
        bus: What was on the bus.
        folder: Where to write; exists.

    Returns:
        Duration (s), travel and greatest lag of the gun (m), spraying time (s), and
        stops with their reasons.

    Raises:
        InputError: There is no such log, or the drives are never enabled in it.
    """
    try:
        played = LogBus(bus, read_log(log))
    except InputError as error:
        raise InputError(
            f"{log}: {str(error).removeprefix(f'{log}: ')}", code="PNT-USE-008"
        ) from error
    found = ReplayLog(Scenario(), played, bus.cycle)
    save_executed(folder / "executed.npz", found)
    p_WG, p_WG_desired = found.X_WG[:, :3, 3], found.X_WG_desired[:, :3, 3]
    lag = np.linalg.norm(p_WG - p_WG_desired, axis=1)
    steps = np.linalg.norm(np.diff(p_WG, axis=0), axis=1)
    return {
        "duration_s": float(found.time[-1]),
        "tip_travel_m": float(steps.sum()),
        "tip_lag_max_m": float(lag.max()),
        "spraying_s": bus.cycle * int(np.count_nonzero(found.trigger)),
        "stops": [f"{time:.3f} {reason}" for time, reason in found.stops],
    }
