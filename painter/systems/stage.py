"""A stage of the paint cycle: works when asked and keeps its answer."""

import time
from typing import Any

from pydrake.common.value import Value
from pydrake.systems.framework import Context, EventStatus, LeafSystem, State

from painter.errors import PainterError
from painter.systems.ports import EvalAs
from painter.systems.values import StageRequest, StageResult
from perception.errors import PerceptionError


class Stage(LeafSystem):
    """Base of the systems that do one heavy piece of work when the cycle asks for it.

    .. pydrake_system::

        name: Stage
        input_ports:
        - request
        - (the subclass's own)
        output_ports:
        - result

    Ports:
        request: StageRequest; acted on when it names this stage and has a new number.
        result: StageResult of the last request that named this stage.

    State is one StageResult. An error of Painter's own becomes a failed result, so that
    the cycle can stop the arm and name the cause; any other exception is a bug and ends
    the simulation.
    """

    def __init__(self, *, stage: str, period: float) -> None:
        """Creates the stage.

        Args:
            stage: Name that requests use.
            period: Time between looks at the request, s.
        """
        super().__init__()
        self._stage = stage
        self._request_port = self.DeclareAbstractInputPort(
            "request", Value(StageRequest())
        )
        self._result_index = self.DeclareAbstractState(Value(StageResult()))
        self.DeclareStateOutputPort("result", self._result_index)
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._UpdateResult)

    def _Work(self, context: Context, goal: str) -> Any:
        """Does the work; returns a frozen value, raises an error of Painter's own."""
        raise NotImplementedError

    def _Warning(self, context: Context) -> str | None:
        """Returns what somebody should look at although the work is done, if any."""
        return None

    def _UpdateResult(self, context: Context, state: State) -> EventStatus:
        request = EvalAs(self._request_port, context, StageRequest)
        index = int(self._result_index)
        last: StageResult = context.get_abstract_state(index).get_value()
        if request.stage != self._stage or request.number == last.number:
            return EventStatus.DidNothing()
        start = time.perf_counter()
        value, error, warning = None, None, None
        try:
            value = self._Work(context, request.goal)
            warning = self._Warning(context)
        except (PainterError, PerceptionError) as failure:
            error = f"{type(failure).__name__}: {failure}"
        result = StageResult(
            number=request.number,
            value=value,
            error=error,
            warning=warning,
            compute_time=time.perf_counter() - start,
        )
        state.get_mutable_abstract_state(index).set_value(result)
        return EventStatus.Succeeded()
