"""`painter canlog`: a log of the bus in CiA 402 terms."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from painter.canopen.analysis.kinds import Kind
from painter.cli import common
from painter.cli.common import output_folder, print_result, read_bus

if TYPE_CHECKING:
    from painter.canopen.analysis.decoder import Decoded
    from painter.canopen.wire.candump import LogRecord

LogArgument = Annotated[
    Path, typer.Argument(metavar="LOG", help="Log in candump's format (candump -L).")
]
ChangesOption = Annotated[
    bool,
    typer.Option(
        "--changes",
        help="Leave out what repeats: show only commands, state changes, answers to "
        "SDO requests, emergencies and errors.",
    ),
]
NodeOption = Annotated[
    list[str] | None,
    typer.Option(
        "--node",
        metavar="NAME",
        help="Show only frames of this node, e.g. elbow_pitch, io, master; repeatable.",
    ),
]
KindOption = Annotated[
    list[Kind] | None,
    typer.Option("--kind", help="Show only frames of this kind; repeatable."),
]
SinceOption = Annotated[
    float, typer.Option(min=0.0, help="Start this long after the log's start, s.")
]
UntilOption = Annotated[
    float | None,
    typer.Option(min=0.0, help="End this long after the log's start, s."),
]
SummaryOption = Annotated[
    bool, typer.Option("--summary", help="Print figures instead of frames.")
]
ReplayOption = Annotated[
    Path | None,
    typer.Option(
        metavar="DIR",
        help="Replay the log through the robot's diagram and write the measured motion "
        "to executed.npz in this folder.",
    ),
]


def canlog(
    log: LogArgument,
    bus_file: common.Bus = None,
    changes: ChangesOption = False,
    nodes: NodeOption = None,
    kinds: KindOption = None,
    since: SinceOption = 0.0,
    until: UntilOption = None,
    summary: SummaryOption = False,
    replay: ReplayOption = None,
    as_json: common.Json = False,
) -> None:
    """Show a log of the bus in CiA 301 and CiA 402 terms, or its figures.

    Reads logs of `painter deploy --log-bus` and of `candump -L`. Times count from the
    log's start. --summary and --json print figures instead of frames: frame counts, bus
    load, SYNC jitter, and every emergency, SDO abort and error frame.
    """
    bus = read_bus(bus_file)
    if replay is not None:
        from painter.jobs.replay_bus_log import replay_bus_log

        with output_folder(replay) as folder:
            figures = replay_bus_log(log, bus, folder)
        print_result(figures, as_json=as_json)
        return
    from painter.canopen.analysis.show_log import LogFilter, show_log

    chosen = LogFilter(
        changes=changes,
        nodes=nodes or (),
        kinds=kinds or (),
        since=since,
        until=until,
    )
    is_shown = not (summary or as_json)
    figures = show_log(log, bus, chosen, _print_frame if is_shown else _ignore)
    if not is_shown:
        print_result(figures, as_json=as_json)


def _print_frame(record: "LogRecord", decoded: "Decoded", time: float) -> None:
    way = {True: ">", False: "<", None: " "}[record.is_sent]
    node = decoded.node or "all"
    typer.echo(f"{time:12.6f} {way} {node:14} {decoded.kind:9} {decoded.text}")


def _ignore(record: "LogRecord", decoded: "Decoded", time: float) -> None:
    """Shows nothing."""
