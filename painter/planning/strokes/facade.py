"""A wall wider or higher than one tile: base positions, and strokes without a seam.

All base positions share one grid of lines over the whole wall, and each line belongs to
one of them: side by side they join as the lines of one tile do. One above the other,
strokes end in a ramp: their flow falls in steps over the overlap while that of the next
base position's strokes rises. An error of the base's place then makes a fraction of the
bead or gap that two blunt ends would make. Lines are cut at known windows and doors,
and places with nothing to paint get no base position.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from painter.planning.config import TileConfig, ZoneConfig
from painter.planning.spray_path import Stroke
from painter.planning.strokes.spans import runs
from painter.planning.strokes.spray_settings import SpraySettings
from painter.planning.strokes.stroke_lines import wall_share
from painter.planning.zones import in_zones
from perception.ground import FloatArray, FrozenValue

_OVERLAP = 0.20  # m, height over which strokes of two base positions blend,
_RAMP_STEPS = 4  # and the steps in which their flow falls and rises.
_CELL = 0.01  # m, of the grid on which zones are drawn.


@dataclass(frozen=True, eq=False)
class BasePosition(FrozenValue):
    """One place of the base, and what is painted from there.

    Lengths are on the wall: x right and y up from its lower left corner as seen by the
    robot.

    Attributes:
        left: Left edge of the base position's tile, m.
        bottom: Lower edge, m.
        width: Of the tile, m.
        height: Of the tile, overlaps included, m.
        base_x: Where the base axis stands, m to the right of the wall's left edge.
        lift: Height of the platform over the floor, m.
        strokes: In the base position's own tile frame T.
    """

    left: float
    bottom: float
    width: float
    height: float
    base_x: float
    lift: float
    strokes: tuple[Stroke, ...]

    @property
    def strokes_on_wall(self) -> tuple[Stroke, ...]:
        """The strokes with their ends on the wall's own axes."""
        corner = np.array([self.left, self.bottom])
        return tuple(
            stroke.replace(start_T=stroke.start_T + corner, end_T=stroke.end_T + corner)
            for stroke in self.strokes
        )


def plan_base_positions(
    width: float,
    height: float,
    spray: SpraySettings,
    *,
    tile: TileConfig,
    zones: Sequence[ZoneConfig] = (),
) -> tuple[BasePosition, ...]:
    """Divides a wall into base positions and lays strokes that join without a seam.

    On the robot, what each base position sees on its tile cuts its strokes further.

    Args:
        width: Of the wall, m.
        height: Of the wall, m.
        spray: The tip and the settings of its strokes.
        tile: Largest tile that one base position paints, and its height over the floor
            or platform that the arm stands on.
        zones: Zones to include and to exclude, on the wall's own axes.

    Returns:
        Base positions in order of execution: row by row from below, back and forth.

    Raises:
        ValueError: The wall or the tile is too small for a line or an overlap, or
            there are several coats.
    """
    raster = spray.raster
    if raster.coats > 1:
        raise ValueError(
            f"raster.coats must be 1 for several base positions, got {raster.coats!r}."
        )
    pitch = spray.nominal_pitch(width)
    lines = round(width / pitch)
    in_tile = math.floor(tile.width / pitch + 1e-9)
    if in_tile < 1 or tile.height <= 2.0 * _OVERLAP or height <= 0.0:
        raise ValueError(
            f"a tile of {tile.width:.2f} x {tile.height:.2f} m cannot divide a wall of "
            f"{width:.2f} x {height:.2f} m: it must be at least one pitch wide, "
            f"{pitch:.2f} m, and higher than two overlaps of {_OVERLAP:.2f} m."
        )
    columns = math.ceil(lines / in_tile)
    edges = np.round(np.linspace(0, lines, columns + 1)).astype(int)
    rows = 1
    if height > tile.height:
        rows = math.ceil((height - _OVERLAP) / (tile.height - _OVERLAP) - 1e-9)
    step = (height - _OVERLAP) / rows if rows > 1 else height
    x_lines = pitch * np.arange(0.5, lines)
    paintable = _paintable_spans(x_lines, width, height, zones, spray)
    base_positions: list[BasePosition] = []
    for row in range(rows):
        bottom = row * step
        tall = height if rows == 1 else step + _OVERLAP
        spans = _ramped(tall, lower=row > 0, upper=row < rows - 1, lead=raster.lead)
        order = range(columns) if row % 2 == 0 else range(columns - 1, -1, -1)
        for column in order:
            first, last = edges[column], edges[column + 1]
            strokes = [
                Stroke(
                    start_T=np.array([x_lines[line] - first * pitch, low]),
                    end_T=np.array([x_lines[line] - first * pitch, high]),
                    speed=raster.speed,
                    kind="body",
                    column=int(line - first),
                    standoff=raster.standoff,
                    flow=flow,
                )
                for line in range(first, last)
                for low, high, flow in _within(
                    spans, paintable[line] - bottom, raster.min_stroke
                )
            ]
            if not strokes:
                continue
            base_positions.append(
                BasePosition(
                    left=float(first * pitch),
                    bottom=bottom,
                    width=float((last - first) * pitch),
                    height=tall,
                    base_x=float((first + last) / 2.0 * pitch),
                    lift=bottom,
                    strokes=tuple(strokes),
                )
            )
    return tuple(base_positions)


def _paintable_spans(
    x_lines: FloatArray,
    width: float,
    height: float,
    zones: Sequence[ZoneConfig],
    spray: SpraySettings,
) -> list[FloatArray]:
    """Returns for each line the spans (k, 2), m, on which the gun may be open."""
    tip, raster = spray
    shape = (max(1, round(height / _CELL)), max(1, round(width / _CELL)))
    bare = np.ones(shape, dtype=bool)
    flow = [
        wall_share(mask, _CELL, x_lines, tip=tip, standoff=raster.standoff)
        for mask in (in_zones(bare, _CELL, zones), bare)
    ]
    # At the wall's own edges part of the fan goes past it either way.
    on = flow[0] >= raster.wall_share * flow[1]
    leads = np.array([-raster.lead, raster.lead])
    return [np.reshape(runs(column), (-1, 2)) * _CELL + leads for column in on.T]


def _within(
    spans: list[tuple[float, float, float]], allowed: FloatArray, shortest: float
) -> list[tuple[float, float, float]]:
    """Returns the parts of spans (low, high, flow) that lie in allowed ones (k, 2)."""
    parts = [
        (max(low, float(start)), min(high, float(end)), flow)
        for low, high, flow in spans
        for start, end in allowed
    ]
    return [part for part in parts if part[1] - part[0] >= shortest]


def _ramped(
    height: float, *, lower: bool, upper: bool, lead: float
) -> list[tuple[float, float, float]]:
    """Returns (low, high, flow) along a line, with a ramp at either joint."""
    part = _OVERLAP / _RAMP_STEPS
    flows = [(step + 0.5) / _RAMP_STEPS for step in range(_RAMP_STEPS)]
    spans: list[tuple[float, float, float]] = []
    if lower:
        spans += [(i * part, (i + 1) * part, flow) for i, flow in enumerate(flows)]
    low = _OVERLAP if lower else -lead
    high = height - _OVERLAP if upper else height + lead
    spans.append((low, high, 1.0))
    if upper:
        spans += [
            (high + i * part, high + (i + 1) * part, 1.0 - flow)
            for i, flow in enumerate(flows)
        ]
    return spans
