"""A paint cycle in a simulator, observed and commanded from outside."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import LogVectorOutput, VectorLog

from painter.cycle.cycle_log import CycleLog
from painter.diagrams.paint_cycle import PaintCycleDiagram
from painter.systems.values import CycleStatus, FollowerStatus, OperatorCommand, Phase

Watch = Callable[[float, CycleStatus, FollowerStatus], str | None]
"""Receives the robot's time, s, and both statuses; may return an operator command."""


class RunningCycle:
    """A paint cycle on its way.

    Attributes:
        cycle: The cycle.
        simulator: Of the whole diagram.
    """

    def __init__(
        self,
        cycle: PaintCycleDiagram,
        *,
        logged: Mapping[str, float],
        watch: Watch | None,
    ) -> None:
        """Creates the simulator of a cycle, not yet initialised.

        Args:
            cycle: The cycle.
            logged: Vector outputs of the cycle to log, and the period of each, s.
            watch: See `Watch`; None = no watcher.
        """
        self.cycle = cycle
        self._watch = watch
        builder = DiagramBuilder()
        builder.AddNamedSystem("paint_cycle", cycle.diagram)
        self._sinks = {
            port: LogVectorOutput(cycle.diagram.GetOutputPort(port), builder, period)
            for port, period in logged.items()
        }
        builder.ExportInput(cycle.diagram.GetInputPort("operator"), "operator")
        self._root = builder.Build()
        self.simulator = Simulator(self._root)
        self._context = self.simulator.get_mutable_context()
        self._look_image: npt.NDArray[np.uint8] | None = None
        self._command = OperatorCommand()
        self._Fix(self._command)

    @property
    def time(self) -> float:
        """Robot time, s."""
        return float(self._context.get_time())

    def evaluate(self, port: str) -> Any:
        """Returns the present value of an output of the cycle."""
        own = self.cycle.diagram.GetMyContextFromRoot(self._context)
        return self.cycle.diagram.GetOutputPort(port).Eval(own)

    def vector_log(self, port: str) -> VectorLog:
        """Returns the log of a logged output."""
        return self._sinks[port].FindLog(self._context)

    def observe(self) -> CycleStatus:
        """Returns the status, after it was shown to the watch.

        Hands the watch's command to the cycle and keeps the first picture of the wall.
        """
        status: CycleStatus = self.evaluate("cycle_status")
        if self._watch is not None:
            follower = self.evaluate("follower_status")
            command = self._watch(self.time, status, follower)
            if command is not None:
                self._command = OperatorCommand(self._command.number + 1, command)
                self._Fix(self._command)
        if self._look_image is None and status.phase == Phase.SCAN:
            self._look_image = self.evaluate("wall_camera.color_image").data.copy()
        return status

    def cycle_log(self, **measured: Any) -> CycleLog:
        """Returns the log of the cycle.

        Args:
            measured: The fields of `CycleLog` that depend on the body.
        """
        return CycleLog(
            status=self.evaluate("cycle_status"),
            end_time=self.time,
            surface_map=self.evaluate("surface_map"),
            segmentation=self.evaluate("segmentation").value,
            program=self.evaluate("program").value,
            look_image=self._look_image,
            **measured,
        )

    def _Fix(self, command: OperatorCommand) -> None:
        self._root.GetInputPort("operator").FixValue(self._context, command)
