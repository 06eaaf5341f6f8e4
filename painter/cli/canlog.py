"""`painter canlog`: a log of the bus in CiA 402 words."""

from collections.abc import Collection
from pathlib import Path
from typing import Annotated

import typer

from painter.canopen.bus_file import load_bus
from painter.canopen.candump import LogRecord, read_lines
from painter.canopen.decoder import Decoded, Decoder, Kind
from painter.canopen.log_summary import LogSummary
from painter.cli.common import JsonOption, print_result
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
    as_json: JsonOption = False,
) -> None:
    """Show a log of the bus in words of CiA 301 and 402, and its figures.

    `painter deploy` writes such logs; those of `candump -L` do as well. Times are from
    the log's start. --summary and --json print figures alone: frames, bus load, how
    even SYNC was, and every emergency, SDO abort and error frame.
    """
    bus = load_bus(bus_file or models_path("bus", "painter.bus.yaml"))
    decoder, figures = Decoder(bus), LogSummary(bus.bitrate)
    known = decoder.node_names
    for node in nodes or ():
        if node not in known:
            raise InputError(f"--node {node!r}: known are {', '.join(known)}.")
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
        raise InputError(f"{log}: holds no CANopen frames.")
    if not is_shown:
        print_result(figures.figures() | {"foreign": foreign}, as_json=as_json)


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
