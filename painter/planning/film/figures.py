"""What a film is judged by, the same as planned, as previewed and as reported."""

from typing import NamedTuple

from perception.ground import FloatArray

# Shares of the nominal film.
COVERED = 0.8  # Least film of wall that counts as covered ...
OVERSPRAYED = 0.1  # ... and of keep-out that counts as painted.


class FilmFigures(NamedTuple):
    """Figures of a film, named as in `report.json`.

    Attributes:
        coverage: Share of the wall whose film is at least `COVERED`; 0 without wall.
        thickness_cv: Standard deviation over mean on the wall; 0 where it is bare.
        overspray: Share of the landed paint that is not on the wall.
        keepout_paint: Share of the keep-out whose film is at least `OVERSPRAYED`; 0
            without keep-out.
    """

    coverage: float
    thickness_cv: float
    overspray: float
    keepout_paint: float

    @classmethod
    def of(
        cls, on_wall: FloatArray, on_keepout: FloatArray, landed: float
    ) -> "FilmFigures":
        """Measures a film.

        Args:
            on_wall: (n,) film of the cells to be painted, as shares of nominal.
            on_keepout: (k,) film of the keep-out's cells.
            landed: Sum of the film over all cells, the tile's margin included.
        """
        mean = on_wall.mean() if on_wall.size else 0.0
        return cls(
            coverage=float((on_wall >= COVERED).mean()) if on_wall.size else 0.0,
            thickness_cv=float(on_wall.std() / mean) if mean > 0.0 else 0.0,
            overspray=float(1.0 - on_wall.sum() / landed) if landed > 0.0 else 0.0,
            keepout_paint=(
                float((on_keepout >= OVERSPRAYED).mean()) if on_keepout.size else 0.0
            ),
        )
