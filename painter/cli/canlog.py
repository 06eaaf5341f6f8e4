"""`painter canlog`: a log of the bus in CiA 402 words."""

from collections.abc import Collection
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from painter.canopen.analysis.decoder import Decoded, Decoder, Kind
from painter.canopen.analysis.log_summary import LogSummary
from painter.canopen.config.bus_config import BusConfig
from painter.canopen.config.bus_file import load_bus
from painter.canopen.wire.candump import LogRecord, read_lines, read_log
from painter.cli.common import JsonOption, output_folder, print_result
from painter.errors import InputError
from painter.resources import models_path


def canlog(
    log: Annotated[Path, typer.Argument(help="Log in candump's format (candump -L).")],
    bus_file: Annotated[
        Path | None,
        typer.Option("--bus", help="Bus file.  [default: the robot's]"),
    ] = None,
    changes: Annotated[
        bool,
        typer.Option(
            "--changes",
            help="Only what says more than that all goes on: commands, changed states, "
            "answers to SDO requests, emergencies, errors.",
        ),
    ] = False,
    nodes: Annotated[
        list[str] | None,
        typer.Option(
            "--node",
            metavar="NAME",
            help="Only frames of this node, e.g. elbow_pitch, io, master; repeatable.",
        ),
    ] = None,
    kinds: Annotated[
        list[Kind] | None,
        typer.Option("--kind", help="Only frames of this sort; repeatable."),
    ] = None,
    since: Annotated[
        float, typer.Option(min=0.0, help="Begin so long after the log's start, s.")
    ] = 0.0,
    until: Annotated[
        float | None,
        typer.Option(min=0.0, help="End so long after the log's start, s."),
    ] = None,
    summary: Annotated[
        bool, typer.Option("--summary", help="Print the figures alone.")
    ] = False,
    replay: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Play the log into the robot's diagram and write what it saw to "
            "executed.npz there.",
        ),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Show a log of the bus in words of CiA 301 and 402, and its figures.

    `painter deploy` writes such logs; those of `candump -L` do as well. Times are from
    the log's start. --summary and --json print figures alone: frames, bus load, how
    even SYNC was, and every emergency, SDO abort and error frame.
    """
    bus = load_bus(bus_file or models_path("bus", "painter.bus.yaml"))
    if replay is not None:
        print_result(_replay(log, bus, replay), as_json=as_json)
        return
    decoder, figures = Decoder(bus), LogSummary(bus.bitrate)
    known = decoder.node_names
    for node in nodes or ():
        if node not in known:
            raise InputError(
                f"--node {node!r}: known are {', '.join(known)}.", code="PNT-USE-006"
            )
    is_shown = not (summary or as_json)
    start, foreign, last = None, 0, None
    for record in read_lines(log):
        if record is None:
            foreign += 1
            continue
        start = record.time if start is None else start
        last = record.time
        # All is decoded: what came before may have mapped what comes now.
        decoded = decoder.decode(record.frame)
        time = record.time - start
        if time < since or (until is not None and time > until):
            continue
        figures.add(record, decoded)
        if is_shown and _is_wanted(decoded, changes, nodes or (), kinds or ()):
            _print_line(record, decoded, time)
    if last is None:
        raise InputError(f"{log}: holds no CANopen frames.", code="PNT-USE-007")
    if not is_shown:
        print_result(figures.figures() | {"foreign": foreign}, as_json=as_json)


def _replay(log: Path, bus: BusConfig, folder: Path) -> dict[str, object]:
    """Plays a log into the diagram; returns its figures."""
    # Drake is loaded for this alone.
    from painter.canopen.analysis.log_bus import LogBus
    from painter.config import Scenario
    from painter.cycle.log_replay import ReplayLog
    from painter.run.folder.arrays import save_executed
    from painter.run.folder.values import Executed

    try:
        played = LogBus(bus, read_log(log))
    except InputError as error:
        raise InputError(
            f"{log}: {str(error).removeprefix(f'{log}: ')}", code="PNT-USE-008"
        ) from error
    found = ReplayLog(Scenario(), played, bus.cycle)
    with output_folder(folder) as draft:
        save_executed(
            draft / "executed.npz",
            Executed(
                time=found.time,
                q=found.q,
                v=found.v,
                trigger=found.trigger,
                X_WG=found.X_WG,
                X_WG_desired=found.X_WG_desired,
            ),
        )
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


def _is_wanted(
    decoded: Decoded, changes: bool, nodes: Collection[str], kinds: Collection[Kind]
) -> bool:
    if changes and not decoded.is_news:
        return False
    if nodes and decoded.node not in nodes:
        return False
    return not kinds or decoded.kind in kinds


def _print_line(record: LogRecord, decoded: Decoded, time: float) -> None:
    way = {True: ">", False: "<", None: " "}[record.is_sent]
    node = decoded.node or "all"
    typer.echo(f"{time:12.6f} {way} {node:14} {decoded.kind:9} {decoded.text}")
