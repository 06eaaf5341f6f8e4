"""Draws docs/images/stroke.png: one stroke with the names of its parts.

Run `python -m benchmarks.support.stroke_picture [FILE]`. The glossary shows it.
"""

import sys
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.patches import FancyArrowPatch, Rectangle

from painter.run.pictures import style

DEFAULT = Path(__file__).parents[2] / "docs" / "images" / "stroke.png"
STANDOFF = 0.30  # m, as by default.
SPRAY = (0.35, 1.65)  # m along the stroke, trigger on to trigger off.
LEAD = 0.22  # m of lead-in and lead-out.


def main() -> None:
    """Writes the picture."""
    target = Path(sys.argv[1]) if len(sys.argv) > 1 else DEFAULT
    target.parent.mkdir(parents=True, exist_ok=True)
    target.write_bytes(style.png(draw()))


@style.styled
def draw():
    """Returns the picture: wall below, path of the nozzle above it."""
    figure = style.new_figure(8.6, 3.9)
    axes = figure.subplots()
    axes.set(xlim=(-0.25, 2.3), ylim=(-0.16, 0.92), aspect="equal")
    axes.axis("off")
    axes.add_patch(Rectangle((0.0, -0.06), 2.0, 0.06, color=style.PALE))
    axes.text(0.02, -0.12, "wall (tile T, x to the right)", color=style.MUTED)
    axes.add_patch(
        Rectangle((SPRAY[0], 0.0), SPRAY[1] - SPRAY[0], 0.014, color=style.BLUE)
    )
    axes.text(1.0, 0.035, "film", color=style.BLUE, ha="center")
    start, end = SPRAY[0] - LEAD, SPRAY[1] + LEAD
    line(axes, (start, STANDOFF), (SPRAY[0], STANDOFF), style.MUTED, dashed=True)
    line(axes, (SPRAY[0], STANDOFF), (SPRAY[1], STANDOFF), style.BLUE)
    line(axes, (SPRAY[1], STANDOFF), (end, STANDOFF), style.MUTED, dashed=True)
    middles = (start + SPRAY[0]) / 2, (SPRAY[1] + end) / 2
    label(axes, middles[0], 0.40, "lead-in\n(to speed)")
    label(axes, 1.0, 0.36, "spray at constant speed")
    label(axes, middles[1], 0.40, "lead-out,\novertravel")
    for x, text in zip(SPRAY, ("trigger on", "trigger off"), strict=True):
        axes.plot(x, STANDOFF, "o", color=style.VERMILION, ms=7)
        axes.text(x, STANDOFF - 0.09, text, color=style.VERMILION, ha="center")
    # Before and after: approach, retract and transition.
    curve(axes, (-0.12, 0.78), (start, STANDOFF), "arc3,rad=0.25")
    label(axes, -0.02, 0.85, "approach")
    curve(axes, (end, STANDOFF), (end + 0.16, 0.62), "arc3,rad=0.35")
    label(axes, end + 0.27, 0.42, "retract")
    curve(axes, (end + 0.16, 0.62), (1.35, 0.84), "arc3,rad=0.3")
    label(axes, 1.76, 0.86, "transition to\nthe next stroke")
    axes.annotate(
        "", (1.35, 0.0), (1.35, STANDOFF), arrowprops={"arrowstyle": "<->", "lw": 1.0}
    )
    axes.text(1.37, 0.14, "stand-off", va="center")
    return figure


def line(axes: Axes, begin, end, color, *, dashed: bool = False) -> None:
    """Draws a straight part of the path."""
    axes.plot(
        *zip(begin, end, strict=True), color=color, lw=2.4, ls="--" if dashed else "-"
    )


def curve(axes: Axes, begin, end, style_of_curve: str) -> None:
    """Draws a move with the gun closed."""
    axes.add_patch(
        FancyArrowPatch(
            begin,
            end,
            connectionstyle=style_of_curve,
            arrowstyle="-|>",
            mutation_scale=12,
            color=style.MUTED,
            linestyle="--",
            lw=1.6,
        )
    )


def label(axes: Axes, x: float, y: float, text: str) -> None:
    """Writes a name over its part."""
    axes.text(x, y, text, ha="center", va="bottom", fontsize=9.5)


if __name__ == "__main__":
    main()
