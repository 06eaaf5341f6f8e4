"""The paint film on the scene; simulation only."""

from dataclasses import dataclass, field

import numpy as np
from pydrake.common.value import Value
from pydrake.math import RigidTransform
from pydrake.systems.framework import Context, EventStatus, State

from painter.errors import PainterError
from painter.planning.config import TipConfig
from painter.planning.film.spray_cone import SprayCone, SpraySurface
from painter.systems.ports import EvalAs
from painter.systems.value_system import ValueSystem
from perception.ground import FloatArray, FrozenValue
from perception.settings import validate


@dataclass(frozen=True, eq=False)
class FilmState(FrozenValue):
    """The film on the surface, and the state of the gun; by default not yet sprayed.

    Attributes:
        volume: (ny, nx) m³ of paint on each cell, row 0 at the lowest y of S.
        cell: Edge of a cell, m.
        origin: (2,) m, corner of the grid at its lowest x and y, in S.
        sprayed: Volume that left the gun, m³, before transfer efficiency.
        missed: Volume, after transfer efficiency, that met no surface, m³.
        X_SG: Nozzle pose at the last update, or None before the first.
        time: (k,) s, latest updates.
        dose: (k,) s, integral of the trigger up to each of them.
        trigger: At the last update, 0 to 1.
    """

    volume: FloatArray
    cell: float
    origin: FloatArray
    sprayed: float = 0.0
    missed: float = 0.0
    X_SG: RigidTransform | None = None
    time: FloatArray = field(default_factory=lambda: np.zeros(0))
    dose: FloatArray = field(default_factory=lambda: np.zeros(0))
    trigger: float = 0.0

    def same_grid(self, other: "FilmState") -> bool:
        """Returns whether another film lies on the same cells."""
        return (
            self.volume.shape == other.volume.shape
            and self.cell == other.cell
            and bool(np.allclose(self.origin, other.origin))
        )

    @property
    def thickness(self) -> FloatArray:
        """(ny, nx) m of wet film, seen along S z."""
        return self.volume / self.cell**2

    @property
    def landed(self) -> float:
        """Volume on the surface, m³."""
        return float(self.volume.sum())


class PaintFilm(ValueSystem):
    """Deposits paint on the scene's true surface as the gun moves over it.

    .. pydrake_system::

        name: PaintFilm
        input_ports:
        - X_WG
        - trigger
        output_ports:
        - film

    Ports:
        X_WG: RigidTransform, true pose of the nozzle in W.
        trigger: (1,) 0 to 1 of the nominal flow, as commanded.
        film: FilmState.

    State is one FilmState, replaced every `period` s, first at t = 0. Paint is spread
    over the nozzle's motion since the last update. The flow follows the trigger after
    the tip's valve delay, opening and closing; between updates the trigger is
    interpolated linearly, which keeps the volume on average.
    """

    def __init__(
        self,
        *,
        height: FloatArray,
        cell: float,
        origin: FloatArray,
        X_WS: RigidTransform,
        tip: TipConfig,
        period: float = 0.01,
        before: FilmState | None = None,
    ) -> None:
        """Creates the system.

        Args:
            height: (ny, nx) m along S z, row 0 at the lowest y; NaN = nothing there.
            cell: Edge of a cell, m.
            origin: (2,) m, corner of the grid at its lowest x and y, in S.
            X_WS: Pose of the surface's frame in W; S z towards the robot.
            tip: The spray tip.
            period: Time between updates, s.
            before: Film that is there already, on the same grid; None = none.

        Raises:
            ValueError: The surface, the tip or `period` is invalid, or `before` lies on
                another grid.
        """
        super().__init__()
        if not (np.isfinite(period) and period > 0.0):
            raise ValueError(f"period must be > 0 s, got {period!r}.")
        validate(tip, "gun.tip")
        self._surface = SpraySurface(height, cell=cell, origin=origin)
        self._cone = SprayCone(tip)
        self._tip = tip
        self._period = period
        self._X_SW = X_WS.inverse()
        # Inputs.
        self._pose_port = self.DeclareAbstractInputPort("X_WG", Value(RigidTransform()))
        self._trigger_port = self.DeclareVectorInputPort("trigger", 1)
        # State.
        film = FilmState(np.zeros(height.shape), cell, np.array(origin, dtype=float))
        if before is not None:
            if not film.same_grid(before):
                raise ValueError(
                    f"before: {before.volume.shape} cells of {before.cell} m from "
                    f"{before.origin} m must lie on the surface's grid: "
                    f"{height.shape} cells of {cell} m from {film.origin} m."
                )
            film = before
        self.DeclareValue(film)
        # Outputs.
        self.DeclareValueOutput("film", lambda film: film)
        # Events.
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._UpdateFilm)

    def _UpdateFilm(self, context: Context, state: State) -> EventStatus:
        trigger = float(self._trigger_port.Eval(context)[0])
        if not 0.0 <= trigger <= 1.0:
            name = self.GetSystemPathname()
            raise PainterError(
                f"{name}: trigger must be 0 to 1, got {trigger!r}.",
                code="PNT-CYCLE-011",
            )
        X_SG = self._X_SW @ EvalAs(self._pose_port, context, RigidTransform)
        film = self._Sprayed(self.GetValue(context), context.get_time(), X_SG, trigger)
        return self.SetValue(state, film)

    def _Sprayed(
        self, film: FilmState, time: float, X_SG: RigidTransform, trigger: float
    ) -> FilmState:
        """Returns the film after the nozzle's motion since the last update."""
        if film.X_SG is None:
            return film.replace(
                X_SG=X_SG, time=np.array([time]), dose=np.zeros(1), trigger=trigger
            )
        last = film.time[-1]
        dose = film.dose[-1] + 0.5 * (film.trigger + trigger) * (time - last)
        times, doses = np.append(film.time, time), np.append(film.dose, dose)
        delayed = np.array([last, time]) - self._tip.valve_delay
        start, end = np.interp(delayed, times, doses)
        recent = np.searchsorted(times, delayed[1], side="right") - 1
        after = film.replace(
            X_SG=X_SG,
            time=times[max(recent, 0) :],
            dose=doses[max(recent, 0) :],
            trigger=trigger,
        )
        if end <= start:
            return after
        sprayed = self._tip.flow * float(end - start)
        share, missed = self._Land(film.X_SG, X_SG)
        lands = sprayed * self._tip.transfer_efficiency
        return after.replace(
            volume=film.volume + lands * share,
            sprayed=film.sprayed + sprayed,
            missed=film.missed + lands * missed,
        )

    def _Land(
        self, X_SG_start: RigidTransform, X_SG_end: RigidTransform
    ) -> tuple[FloatArray, float]:
        """Returns the share of the paint on each cell, and the share that missed."""
        rays = self._cone.rays(X_SG_start, X_SG_end)
        cells, shares, missed = self._surface.land(*rays)
        count = rays[0].shape[1]
        ny, nx = self._surface.shape
        landed = np.bincount(cells, weights=shares, minlength=ny * nx) / count
        return landed.reshape(ny, nx), missed / count
