"""Frozen values of planning: strokes, arm motions and the paint program."""

import functools
from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform
from pydrake.trajectories import PiecewisePolynomial

from perception.ground import FloatArray, FrozenValue


@dataclass(frozen=True, eq=False)
class Stroke(FrozenValue):
    """One straight pass of the gun at constant speed with the spray on.

    Attributes:
        start_T: (2,) m, in T's x and y: where the spray axis meets the wall as the gun
            opens.
        end_T: (2,) m: where it closes.
        speed: Speed of that point along the wall, m/s.
        kind: "body" for the raster, "cut_in" beside an edge, or "touch_up".
        column: Number of its line, from the left.
        standoff: Nozzle to wall, m; the nearer, the narrower the fan.
        flow: Share of the tip's nominal flow, above 0 up to 1.
        coat: Number of its coat, from 1.
    """

    start_T: FloatArray
    end_T: FloatArray
    speed: float
    kind: str
    column: int
    standoff: float = 0.30
    flow: float = 1.0
    coat: int = 1

    @property
    def length(self) -> float:
        """Length on the wall, m."""
        return float(np.linalg.norm(self.end_T - self.start_T))

    def part(self, begin: float, end: float) -> "Stroke":
        """Returns the part between two shares of its length."""
        travel = self.end_T - self.start_T
        return self.replace(
            start_T=self.start_T + begin * travel, end_T=self.start_T + end * travel
        )


@dataclass(frozen=True, eq=False)
class Motion(FrozenValue):
    """An arm motion from rest to rest, with the times at which the gun is open.

    Attributes:
        time: (n,) s, strictly increasing, from 0.
        q: (n, 5) rad.
        v: (n, 5) rad/s, zero in the first and last row.
        spray_on: (m, 2) s, [open, close) in the motion's own time as the trigger is
            commanded (valve delay already taken off), in order, not overlapping.
        flow: (m,) share of the nominal flow while it is open; None = 1 throughout.
    """

    time: FloatArray
    q: FloatArray
    v: FloatArray
    spray_on: FloatArray
    flow: FloatArray | None = None

    @property
    def duration(self) -> float:
        """Time from start to end, s."""
        return float(self.time[-1])

    @functools.cached_property
    def trajectory(self) -> PiecewisePolynomial:
        """Cubic Hermite spline through the samples, (5,) rad over s."""
        return PiecewisePolynomial.CubicHermite(self.time, self.q.T, self.v.T)

    def trigger(self, time: float) -> float:
        """Returns the flow commanded at `time` (s), 0 to 1 of the nominal flow."""
        index = int(np.searchsorted(self.spray_on[:, 0], time, side="right")) - 1
        if index < 0 or time >= self.spray_on[index, 1]:
            return 0.0
        return 1.0 if self.flow is None else float(self.flow[index])

    def strokes_done(self, time: float) -> float:
        """Returns the number of strokes sprayed by `time` (s), with fractions."""
        opens, closes = self.spray_on[:, 0], self.spray_on[:, 1]
        shares = np.clip((time - opens) / (closes - opens), 0.0, 1.0)
        return float(shares.sum())

    def sprays_within(self, start: float, end: float) -> bool:
        """Returns whether the gun opens or is open within [start, end] (s)."""
        opens, closes = self.spray_on[:, 0], self.spray_on[:, 1]
        return bool(np.any((opens < end) & (closes > start)))


@dataclass(frozen=True, eq=False)
class SkippedStroke(FrozenValue):
    """A stroke, or a part of one, that is not in the program.

    Attributes:
        stroke: What is left out.
        reason: Why, in one line.
    """

    stroke: Stroke
    reason: str


@dataclass(frozen=True, eq=False)
class PaintProgram(FrozenValue):
    """The job of one tile, ready to be approved and executed.

    Attributes:
        strokes: In order of execution.
        motion: Approach, strokes, transitions and way home as one motion.
        X_WT: Tile frame T in W, as segmented.
        standoff: Nozzle to wall of the raster, m; each stroke has its own.
        nominal_thickness: Film that the raster aims at, m (wet).
        paint_volume: Paint that leaves the gun, m³.
        skipped: Infeasible strokes, or parts of them, with the reason.
    """

    strokes: tuple[Stroke, ...]
    motion: Motion
    X_WT: RigidTransform
    standoff: float
    nominal_thickness: float
    paint_volume: float = 0.0
    skipped: tuple[SkippedStroke, ...] = ()
