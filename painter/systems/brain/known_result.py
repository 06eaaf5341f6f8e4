"""A stage whose answer is known from before."""

from pydrake.systems.framework import Context

from painter.systems.stage import Stage
from perception.ground import FrozenValue


class KnownResult(Stage):
    """Answers with what an earlier cycle found, where this one need not look again.

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
            stage: Name of the stage that it stands in for.
            value: Its answer to every request.
            period: Time between looks at the request, s.
        """
        super().__init__(stage=stage, period=period)
        self._value = value

    def _Work(self, context: Context, goal: str) -> FrozenValue:
        return self._value
