"""What each figure of a run means, its unit on the page and its target."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml


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


def _read_catalogue() -> Iterator[FigureInfo]:
    """Yields the entries of figures.yaml in their order."""
    text = Path(__file__).with_name("figures.yaml").read_text(encoding="utf-8")
    for group, entries in yaml.safe_load(text).items():
        for entry in entries:
            yield FigureInfo(group=group, **entry)


FIGURES = tuple(_read_catalogue())
# The tiles at the top of the page, and their titles.
HEADLINE = {
    "cycle_time_s": "Cycle time",
    "coverage": "Coverage",
    "overspray": "Overspray",
    "mask_iou": "Mask IoU",
    "collisions": "Collisions",
}


def figure_info(name: str) -> FigureInfo:
    """Returns the entry of a figure."""
    return next(info for info in FIGURES if info.name == name)
