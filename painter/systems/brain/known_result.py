"""A stage whose answer is known before the cycle."""

from pydrake.systems.framework import Context

from painter.systems.stage import Stage
from perception.ground import FrozenValue


class KnownResult(Stage):
    """Answers with the result of an earlier cycle.

    .. pydrake_system::

        name: KnownResult
        input_ports:
        - request
        output_ports:
        - result

    Ports:
        request: StageRequest; acted on when it names this stage and is new.
        result: StageResult; its value is the known one.

    State is the last StageResult.
    """

    def __init__(self, *, stage: str, value: FrozenValue, period: float) -> None:
        """Creates the stage.

        Args:
            stage: Name of the stage that it replaces.
            value: Answer to every request.
            period: Time between checks for a new request, s.
        """
        super().__init__(stage=stage, period=period, inputs={})
        self._value = value

    def Work(self, context: Context, goal: str) -> FrozenValue:
        """Returns the known value; see `Stage.Work`."""
        return self._value
