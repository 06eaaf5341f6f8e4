"""One mapping session: frames through the mapper, with or without a store."""

from collections.abc import Callable, Iterable

from pydrake.math import RigidTransform

from perception.io.frames import Frame
from perception.mapping.sessions.mapper import Mapper, MappingResult, Outcome
from perception.mapping.sessions.places import Localisation, joined, localise
from perception.mapping.sessions.store import MapStore


def run_session(
    mapper: Mapper,
    frames: Iterable[Frame],
    store: MapStore | None = None,
    show: Callable[[int], None] | None = None,
) -> MappingResult:
    """Maps all frames; continues a stored session that was interrupted.

    Args:
        mapper: A new one.
        frames: In order of time; numbers of frames count from the first one on.
        store: Keeps keyframes as they come; frames that it holds are not mapped again.
        show: Called with each frame's number.

    Raises:
        NoMapError: No valid map can be made.
    """
    done = -1 if store is None else _restore(mapper, store)
    for number, frame in enumerate(frames):
        if show is not None:
            show(number)
        if number <= done:
            continue
        outcome = mapper.add(frame)
        if store is not None:
            _save(mapper, store, number, frame, outcome)
    result = mapper.finish()
    if store is not None:
        store.save_answer(result.solution.graph.poses, mapper.seconds)
    return result


def join_map(mapper: Mapper, store: MapStore) -> tuple[MappingResult, Localisation]:
    """Localises a session in a stored map and maps both as one.

    Args:
        mapper: After `finish`; becomes the one of both sessions.
        store: The map, with keyframes; does not change.

    Returns:
        The map of both in the stored one's world, with the poses of the mapper's own
        frames, and the pose of that session's world in it.

    Raises:
        NotLocalisedError: The session is not recognised in the map.
    """
    older = Mapper(mapper.graph.intrinsics, mapper.config)
    _restore(older, store)
    known = older.graph.solved().graph
    found = localise(known, mapper.graph)
    mapper.graph = joined(known, mapper.graph, found.X_MW)
    count = len(known.keyframes)
    mapper.placed = [(time, count + k, X_KC) for time, k, X_KC in mapper.placed]
    return mapper.finish(), found


def _save(
    mapper: Mapper, store: MapStore, number: int, frame: Frame, outcome: Outcome
) -> None:
    placed = None
    if outcome in (Outcome.KEYFRAME, Outcome.TRACKED):
        _, k, X_KC = mapper.placed[-1]
        placed = k, X_KC
    if outcome is Outcome.KEYFRAME:
        graph = mapper.graph
        k = len(graph.keyframes) - 1
        constraints = [
            constraint for constraint in graph.constraints if constraint.j == k
        ]
        store.save_keyframe(k, number, frame, graph.poses[k], constraints)
    store.save_frame(number, frame.time, outcome, placed)


def _restore(mapper: Mapper, store: MapStore) -> int:
    """Restores the mapper from the store; returns the last frame's number."""
    last = -1
    for number, frame, X_WC, constraints in store.keyframes():
        mapper.restore(frame, number, X_WC, constraints)
        last = number
    mapper.placed.clear()
    numbers = set()
    for number, time, outcome, k, X_KC in store.frames():
        mapper.outcomes[Outcome(outcome)] += 1
        numbers.add(number)
        last = max(last, number)
        if k is not None:
            mapper.placed.append((time, k, X_KC))
    for k, keyframe in enumerate(mapper.graph.keyframes):
        if keyframe.number not in numbers:  # Killed between the two transactions.
            mapper.outcomes[Outcome.KEYFRAME] += 1
            mapper.placed.append((keyframe.time, k, RigidTransform()))
    return last
