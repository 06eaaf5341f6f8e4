"""Figures of time, from the event log."""

from collections.abc import Mapping, Sequence
from typing import Any

Event = Mapping[str, Any]

DONE = "DONE"
STOPPED = ("PAUSED", "FAULT", "ABORTED")
STAGE = "stage"
COLLISION = "collision"
STARTED = "started"
ENDED = "ended"


def phase_spans(events: Sequence[Event]) -> list[tuple[str, float, float]]:
    """Returns (phase, start, end) in robot time, s, in order of the log.

    The last phase ends with the log; DONE is a moment, whatever is logged after it.
    """
    phases = [event for event in events if "phase" in event]
    ends = [float(event["time"]) for event in phases[1:]]
    if phases:
        done = phases[-1]["phase"] == DONE
        ends.append(float(phases[-1]["time"]) if done else _end(events))
    return [
        (str(event["phase"]), float(event["time"]), end)
        for event, end in zip(phases, ends, strict=True)
    ]


def phase_times(events: Sequence[Event]) -> dict[str, float]:
    """Robot time spent in each phase, s; a phase entered twice counts twice."""
    times: dict[str, float] = {}
    for phase, start, end in phase_spans(events):
        times[phase] = times.get(phase, 0.0) + end - start
    return times


def computing_phases(events: Sequence[Event]) -> list[tuple[str, Event]]:
    """Returns each stage's event with the phase in which the stage worked."""
    found: list[tuple[str, Event]] = []
    phase = ""
    for event in events:
        phase = str(event.get("phase", phase))
        if event.get("event") == STAGE:
            found.append((phase, event))
    return found


def compute_times(events: Sequence[Event]) -> dict[str, float]:
    """Wall-clock time of each stage's work for which the robot stood, s."""
    times: dict[str, float] = {}
    for event in named(events, STAGE):
        stage = str(event["stage"])
        times[stage] = times.get(stage, 0.0) + float(event["compute_s"])
    return times


def motion_time(events: Sequence[Event]) -> float | None:
    """Robot time from the start to DONE (or to where the log ends), s."""
    if not events:
        return None
    done = [float(event["time"]) for event in events if event.get("phase") == DONE]
    return (done[0] if done else _end(events)) - float(events[0]["time"])


def named(events: Sequence[Event], name: str) -> list[Event]:
    """Returns the events of that name."""
    return [event for event in events if event.get("event") == name]


def time_figures(events: Sequence[Event]) -> dict[str, Any]:
    """Robot-time figures; the same for the same seed."""
    return {
        "motion_time_s": motion_time(events),
        "phase_time_s": phase_times(events),
    }


def timing_figures(events: Sequence[Event]) -> dict[str, Any]:
    """Wall-clock figures, which differ from run to run."""
    motion = motion_time(events)
    stages = compute_times(events)
    compute = sum(stages.values())
    ended = named(events, ENDED)
    wall_clock = float(ended[-1]["wall_clock_s"]) if ended else None
    return {
        "compute_time_s": compute,
        "compute_time_by_stage_s": stages,
        "cycle_time_s": None if motion is None else motion + compute,
        "wall_clock_s": wall_clock,
        "realtime_factor": (
            motion / wall_clock if motion is not None and wall_clock else None
        ),
    }


def _end(events: Sequence[Event]) -> float:
    # What is found out afterwards, such as a collision, is logged last.
    return max(float(event["time"]) for event in events)
