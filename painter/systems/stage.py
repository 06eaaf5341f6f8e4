"""A stage of the paint cycle: does one piece of work on request and keeps the answer.

To exchange a stage, derive from `Stage` or write any LeafSystem with the same ports;
see docs/own-stage.md.
"""

import time
from dataclasses import dataclass
from typing import Any, TypeVar

from pydrake.systems.framework import Context, EventStatus, State

from painter.errors import PainterError
from painter.planning.arm.kinematics import NQ
from painter.planning.spray_path import Motion, PaintProgram
from painter.systems.ports import DeclareInputs, EvalAs, Ports
from painter.systems.value_system import ValueSystem
from painter.systems.values import StageRequest, StageResult
from perception.errors import PerceptionError
from perception.values import SurfaceMap, Wall, WallSegmentation

T = TypeVar("T")


@dataclass(frozen=True)
class StageContract:
    """What a stage reads and answers.

    Attributes:
        inputs: Its input ports beside `request`.
        answer: Types that its result's value may have.
    """

    inputs: Ports
    answer: tuple[type, ...]


STAGES = {
    "motion_planner": StageContract(
        {"state": 2 * NQ, "wall": StageResult(), "surface_map": SurfaceMap.empty()},
        (Motion, type(None)),
    ),
    "wall_finder": StageContract({"surface_map": SurfaceMap.empty()}, (Wall,)),
    "wall_segmenter": StageContract(
        {"surface_map": SurfaceMap.empty(), "wall": StageResult()},
        (WallSegmentation,),
    ),
    "spray_path_planner": StageContract(
        {"state": 2 * NQ, "segmentation": StageResult()}, (PaintProgram,)
    ),
}
"""The stages of a paint cycle. Each also has the input `request` (StageRequest) and
the output `result` (StageResult)."""


class Stage(ValueSystem):
    """Base of the systems that do one heavy piece of work when the cycle requests it.

    .. pydrake_system::

        name: Stage
        input_ports:
        - request
        - (those of the stage's contract)
        output_ports:
        - result

    Ports:
        request: StageRequest; acted on when it names this stage and has a new number.
        result: StageResult of the last request that named this stage.

    State is one StageResult. A PainterError or PerceptionError becomes a failed result:
    the cycle stops the arm and names the cause. Any other exception is a bug and ends
    the simulation.
    """

    def __init__(
        self, *, stage: str, period: float = 0.02, inputs: Ports | None = None
    ) -> None:
        """Creates the stage.

        Args:
            stage: Its name in requests, one of `STAGES`.
            period: Time between checks for a new request, s.
            inputs: Input ports beside `request`; None = those of the stage's contract.
        """
        super().__init__()
        self._stage = stage
        # Inputs.
        ports = STAGES[stage].inputs if inputs is None else inputs
        self._kinds = {"request": StageRequest(), **ports}
        self._ports = DeclareInputs(self, self._kinds)
        # State.
        self.DeclareValue(StageResult())
        # Outputs.
        self.DeclareValueOutput("result", lambda result: result)
        # Events.
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._UpdateResult)

    def Work(self, context: Context, goal: str) -> Any:
        """Does the work; to be overridden.

        Args:
            context: To read the inputs with.
            goal: What is requested, where the stage can do more than one thing.

        Returns:
            The answer, a frozen value of the type in `STAGES`.

        Raises:
            PainterError: There is no answer; says why.
            PerceptionError: The same.
        """
        raise NotImplementedError

    def Warning(self, context: Context) -> str | None:
        """Returns what a person should check although the work is done, if anything."""
        return None

    def Read(self, context: Context, port: str) -> Any:
        """Returns an input: a vector (n,), or a value of the declared type.

        Raises:
            PortTypeError: The port carries a value of another type.
        """
        kind = self._kinds[port]
        if isinstance(kind, int):
            return self._ports[port].Eval(context).copy()
        return EvalAs(self._ports[port], context, type(kind))

    def ReadAnswer(self, context: Context, port: str, kind: type[T]) -> T:
        """Returns the answer of another stage.

        Args:
            context: Of this stage.
            port: Input that carries the other stage's StageResult.
            kind: Expected type of its value.

        Raises:
            PainterError: The other stage has no such answer yet.
        """
        value = self.Read(context, port).value
        if not isinstance(value, kind):
            raise PainterError(
                f"{self.GetSystemPathname()}:{port} holds {type(value).__name__}, "
                f"expected {kind.__name__}.",
                code="PNT-CYCLE-013",
            )
        return value

    def _UpdateResult(self, context: Context, state: State) -> EventStatus:
        request: StageRequest = self.Read(context, "request")
        last = self.GetValue(context).number
        if request.stage != self._stage or request.number == last:
            return EventStatus.DidNothing()
        start = time.perf_counter()
        result = StageResult(number=request.number)
        try:
            value = self.Work(context, request.goal)
            result = result.replace(value=value, warning=self.Warning(context))
        except (PainterError, PerceptionError) as failure:
            error = f"{type(failure).__name__}: {failure}"
            result = result.replace(error=error, code=failure.code)
        result = result.replace(compute_time=time.perf_counter() - start)
        return self.SetValue(state, result)
