"""What each figure of a run means, its unit on the page and its target."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class FigureInfo:
    """One figure as the report shows it.

    Attributes:
        name: Its name in report.json.
        group: Heading it stands under.
        meaning: One sentence for the reader.
        unit: Unit on the page.
        scale: Value on the page / value in report.json.
        digits: Decimals on the page.
        at_least: Target: not below this (as in report.json); None = no such target.
        at_most: Target: not above this.
    """

    name: str
    group: str
    meaning: str
    unit: str = ""
    scale: float = 1.0
    digits: int = 1
    at_least: float | None = None
    at_most: float | None = None

    def value(self, figures: Mapping[str, Any]) -> Any:
        """Returns the figure from report.json's content, or None if it is not there."""
        found = figures.get(self.name)
        return figures.get("timing", {}).get(self.name) if found is None else found

    def text(self, figures: Mapping[str, Any]) -> str:
        """Returns the figure with its unit, or a dash if it is not known."""
        value = self.value(figures)
        if value is None:
            return "–"
        if isinstance(value, list):
            number = ", ".join(f"{self.scale * item:.{self.digits}f}" for item in value)
        else:
            number = f"{self.scale * value:.{self.digits}f}"
        return self._with_unit(number)

    def target(self) -> str:
        """Returns the target with its unit, or nothing if there is none."""
        bound = self.at_least if self.at_least is not None else self.at_most
        if bound is None:
            return ""
        sign = "≥ " if self.at_least is not None else "≤ " if bound > 0 else ""
        return sign + self._with_unit(f"{self.scale * bound:g}")

    def _with_unit(self, number: str) -> str:
        return (
            number + self.unit if self.unit == "°" else f"{number} {self.unit}".rstrip()
        )

    def passes(self, figures: Mapping[str, Any]) -> bool | None:
        """Tells whether the target is met; None without target or value."""
        value = self.value(figures)
        if value is None or not self.target():
            return None
        if self.at_least is not None:
            return bool(value >= self.at_least)
        return bool(value <= self.at_most)


def _percent(name: str, group: str, meaning: str, **target: Any) -> FigureInfo:
    return FigureInfo(name, group, meaning, unit="%", scale=100.0, **target)


def _mm(
    name: str, group: str, meaning: str, *, digits: int = 1, **target: Any
) -> FigureInfo:
    return FigureInfo(
        name, group, meaning, unit="mm", scale=1e3, digits=digits, **target
    )


def _seconds(name: str, group: str, meaning: str, **target: Any) -> FigureInfo:
    return FigureInfo(name, group, meaning, unit="s", **target)


TIME, MASK, FILM, ARM = "Time", "Wall and mask", "Paint film", "Strokes and tracking"

# Targets: issue "The whole paint cycle", table "Must show".
FIGURES = (
    _seconds(
        "cycle_time_s",
        TIME,
        "What a user waits for a wall: robot time and computing.",
        at_most=150.0,
    ),
    _seconds("motion_time_s", TIME, "Robot time from the start to DONE."),
    _seconds(
        "compute_time_s",
        TIME,
        "Wall-clock time for which the robot stands and waits for perception or "
        "planning.",
    ),
    _seconds("wall_clock_s", TIME, "Time the program ran."),
    FigureInfo(
        "realtime_factor", TIME, "Robot time / wall-clock time.", unit="×", digits=2
    ),
    FigureInfo(
        "mask_iou",
        MASK,
        "Segmented mask against truth on the tile: common area / joint area.",
        digits=3,
        at_least=0.95,
    ),
    _mm(
        "mask_edge_error_median_m",
        MASK,
        "Distance of the mask's edge cells to the true edge, median.",
    ),
    _mm(
        "mask_edge_error_p95_m",
        MASK,
        "The same: 95 % of the edge cells are nearer than this.",
    ),
    FigureInfo(
        "mask_area_m2", MASK, "Area of the mask: what is to be painted.", "m²", digits=3
    ),
    _mm(
        "tile_offset_m",
        MASK,
        "How far right and up of its nominal place the robot laid its tile.",
    ),
    _mm(
        "wall_distance_error_m",
        MASK,
        "How much nearer than it is the robot takes the wall for.",
    ),
    FigureInfo(
        "wall_tilt_error_deg",
        MASK,
        "Angle between the wall's normal as found and the true one.",
        unit="°",
        digits=2,
    ),
    _percent(
        "coverage",
        FILM,
        "Share of truly paintable cells with at least 80 % of the nominal film.",
        at_least=0.85,
    ),
    _percent("coverage_half", FILM, "The same at 50 % of the nominal film."),
    FigureInfo(
        "nominal_thickness_m",
        FILM,
        "Wet film that the program aims at.",
        unit="µm",
        scale=1e6,
        digits=0,
    ),
    FigureInfo(
        "thickness_mean_m",
        FILM,
        "Mean wet film on paintable cells.",
        unit="µm",
        scale=1e6,
        digits=0,
    ),
    _percent(
        "thickness_cv", FILM, "Standard deviation / mean of the film, paintable cells."
    ),
    _percent(
        "thickness_cv_interior",
        FILM,
        "The same at least half a fan width from any edge.",
    ),
    _percent(
        "overspray",
        FILM,
        "Paint that landed off the paintable cells / paint that landed.",
        at_most=0.10,
    ),
    _percent(
        "keepout_paint",
        FILM,
        "Share of window, door and obstacle cells with at least 10 % of the nominal "
        "film.",
    ),
    FigureInfo(
        "mass_balance_error",
        FILM,
        "|sprayed × transfer efficiency - landed - missed| / sprayed: a check of the "
        "simulation.",
        unit="%",
        scale=100.0,
        digits=4,
        at_most=0.001,
    ),
    FigureInfo(
        "sprayed_m3", FILM, "Paint that left the gun.", unit="l", scale=1e3, digits=3
    ),
    _percent("predicted_coverage", FILM, "Coverage as planned, by the closed form."),
    _percent("predicted_overspray", FILM, "Overspray as planned, likewise."),
    _percent(
        "predicted_film_error",
        FILM,
        "Mean |planned - laid film| on the tile, share of nominal.",
        at_most=0.05,
    ),
    FigureInfo("stroke_count", ARM, "Strokes of the program.", digits=0),
    FigureInfo("stroke_length_m", ARM, "Their length in all.", unit="m"),
    FigureInfo(
        "skipped_length_m",
        ARM,
        "Length of strokes left out because the arm cannot do them.",
        unit="m",
    ),
    FigureInfo(
        "collisions",
        ARM,
        "Contacts and clearance violations in the executed cycle.",
        digits=0,
        at_most=0.0,
    ),
    _mm(
        "tip_error_rms_m",
        ARM,
        "Executed against commanded nozzle position on strokes, root mean square.",
        digits=2,
        at_most=0.002,
    ),
    _mm("tip_error_max_m", ARM, "The same, largest.", digits=2),
    FigureInfo(
        "gun_angle_error_max_deg",
        ARM,
        "Executed against commanded gun orientation on strokes, largest angle.",
        unit="°",
        digits=2,
        at_most=1.0,
    ),
    _percent(
        "speed_within_2pct",
        ARM,
        "Share of the sprayed length at which the gun moved within 2 % of its speed.",
    ),
)
HEADLINE = ("cycle_time_s", "coverage", "overspray", "mask_iou", "collisions")


def figure_info(name: str) -> FigureInfo:
    """Returns the entry of a figure."""
    return next(info for info in FIGURES if info.name == name)
