"""The operator at the terminal, asked before each phase or before painting."""

from collections.abc import Callable

from painter.systems.values import Phase

_ENDS = (Phase.DONE, Phase.FAULT, Phase.ABORTED)


class StepByStep:
    """Turns the operator's answers into commands for the cycle."""

    def __init__(
        self, *, every_phase: bool, review: bool, ask: Callable[[str], bool]
    ) -> None:
        """Creates it.

        Args:
            every_phase: Whether each phase needs the operator's consent.
            review: Whether the program needs approval before it is painted.
            ask: Asks the operator and waits for the answer; False aborts.
        """
        self._every_phase = every_phase
        self._review = review
        self._ask = ask
        self._allowed: Phase | None = None
        self._waiting: Phase | None = None

    def command(self, phase: Phase) -> str | None:
        """Returns the operator's command, if one is due; to be called often.

        The arm is paused first; the operator is asked when it stands.

        Args:
            phase: Present phase of the cycle.
        """
        if phase == Phase.REVIEW and self._review and self._allowed != phase:
            self._allowed = phase
            return "approve" if self._ask("Paint as planned?") else "abort"
        if not self._every_phase or phase in _ENDS:
            return None
        if phase == Phase.PAUSED and self._waiting is not None:
            self._allowed, self._waiting = self._waiting, None
            question = f"Continue with {self._allowed.value}?"
            return "resume" if self._ask(question) else "abort"
        if phase not in (self._allowed, Phase.PAUSED, Phase.REVIEW, self._waiting):
            self._waiting = phase
            return "pause"
        return None
