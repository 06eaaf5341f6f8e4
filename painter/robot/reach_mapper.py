"""Draws the arm's reach map: `python -m painter.robot.reach_mapper --out DIR`."""

import argparse
from collections.abc import Callable
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.colors import LinearSegmentedColormap, ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from pydrake.geometry import Box
from pydrake.math import RigidTransform

from painter.config import Scenario
from painter.planning.arm.reach_map import ReachTask, TileReach, placement, tile_reach
from painter.planning.arm.scan_camera import ScanCamera
from painter.robot.robot_model import MakeRobotModel

DISTANCES = np.linspace(0.70, 1.40, 15)
SHOULDER_HEIGHTS = np.linspace(0.80, 1.60, 9)

_SHARE_COLORS = LinearSegmentedColormap.from_list(
    "share", ["#f4f1ea", "#9cc3c9", "#2c7f8f", "#0d3c4a"]
)
_INK, _ACCENT = "#26323a", "#e8590c"


class ReachMapper:
    """Computes what the arm reaches before a wall, collisions included."""

    def __init__(self, scenario: Scenario) -> None:
        """Loads the robot.

        Args:
            scenario: Gives the tile, stand-offs, clearance and directives.
        """
        self._scenario = scenario
        robot = MakeRobotModel(scenario)
        self._checker = robot.checker.Clone()
        self.arm, self.limits = robot.kinematics, robot.limits
        camera = ScanCamera.mounted(scenario.wall_camera.stereo, self.arm.X_LC)
        self.task = ReachTask(
            standoff=scenario.raster.standoff,
            scan_distance=scenario.scan.distance,
            footprint=camera.footprint(scenario.scan.distance),
            margin=scenario.scan.margin,
        )

    def reach(
        self,
        *,
        distance: float,
        shoulder_height: float,
        step: float = 0.05,
        around: float = 0.0,
    ) -> TileReach:
        """Computes the reach from one placement.

        Args:
            distance: Of the wall from the base axis, m.
            shoulder_height: Of the shoulder axis over the floor, m; the frame's mast
                moves with the shoulder.
            step: Spacing of the points on the tile, m.
            around: How far beyond the tile to compute, m.
        """
        raised = shoulder_height - self.arm.shoulder_height
        tile = placement(self._scenario.tile, distance=distance, raised=raised)
        return tile_reach(
            self.arm,
            self.limits,
            tile,
            self.task,
            is_free=self.IsFreeBefore(distance, raised),
            step=step,
            around=around,
        )

    def IsFreeBefore(
        self, distance: float, raised: float
    ) -> Callable[[np.ndarray], np.ndarray]:
        """Returns the collision check of joint positions (n, 5) before a bare wall.

        Args:
            distance: Of the wall from the base axis, m.
            raised: How much higher than modelled the shoulder is, m.
        """
        checker = self._checker
        world, thickness = checker.plant().world_body(), 0.1
        checker.RemoveAllAddedCollisionShapes()
        for name, box, p_WBox in (
            ("wall", Box(thickness, 8, 8), [distance + thickness / 2, 0, 0]),
            ("floor", Box(8, 8, thickness), [0, 0, -raised - thickness / 2]),
        ):
            checker.AddCollisionShapeToBody(name, world, box, RigidTransform(p_WBox))
        return lambda q: np.array(checker.CheckConfigsCollisionFree(q), dtype=bool)


def draw_reach_map(scenario: Scenario) -> Figure:
    """Returns the picture of models/arm/README.md.

    Left and middle: the share of the tile that can be sprayed and seen, by placement.
    Right: the scenario's own placement.
    """
    mapper = ReachMapper(scenario)
    reaches = [
        [mapper.reach(distance=d, shoulder_height=h, step=0.1) for d in DISTANCES]
        for h in SHOULDER_HEIGHTS
    ]
    nominal = mapper.reach(
        distance=scenario.tile.distance,
        shoulder_height=mapper.arm.shoulder_height,
        step=0.025,
        around=0.4,
    )
    figure = Figure(figsize=(13.0, 4.6), dpi=110, layout="constrained")
    axes = figure.subplots(1, 3, width_ratios=[1.15, 1.15, 1.0])
    task = mapper.task
    for ax, title, shares in (
        (
            axes[0],
            f"Sprayed at {task.standoff:.2f} m",
            [[reach.spray_share for reach in row] for row in reaches],
        ),
        (
            axes[1],
            f"Seen from {task.scan_distance:.2f} m",
            [[reach.scan_share for reach in row] for row in reaches],
        ),
    ):
        _draw_shares(ax, title, 100.0 * np.array(shares))
        ax.plot(
            scenario.tile.distance,
            mapper.arm.shoulder_height,
            marker="s",
            markersize=17,
            markerfacecolor="none",
            markeredgecolor=_ACCENT,
            markeredgewidth=2.5,
        )
    _draw_tile(axes[2], scenario, nominal)
    return figure


def _draw_shares(ax: matplotlib.axes.Axes, title: str, percent: np.ndarray) -> None:
    ax.pcolormesh(
        DISTANCES, SHOULDER_HEIGHTS, percent, cmap=_SHARE_COLORS, vmin=40, vmax=100
    )
    for i, height in enumerate(SHOULDER_HEIGHTS):
        for j, distance in enumerate(DISTANCES):
            share = int(percent[i, j] + 1e-9)  # Rounded down: 100 is all of it.
            ax.text(
                distance,
                height,
                str(share),
                ha="center",
                va="center",
                fontsize=7,
                fontweight="bold" if share == 100 else "normal",
                color="white" if share > 75 else _INK,
            )
    ax.set_title(f"{title}: % of the tile", color=_INK)
    ax.set_xlabel("wall to base axis, m")
    ax.set_ylabel("shoulder over the floor, m")


def _draw_tile(ax: matplotlib.axes.Axes, scenario: Scenario, reach: TileReach) -> None:
    tile = scenario.tile
    colors = ListedColormap(["#d9d4c8", "#9cc3c9", "#e9b384", "#2c7f8f"])
    state = reach.seen.astype(int) + 2 * reach.sprayed.astype(int)
    ax.pcolormesh(
        reach.x, reach.y, state, cmap=colors, vmin=-0.5, vmax=3.5, shading="nearest"
    )
    ax.add_patch(
        Rectangle(
            (0, 0), tile.width, tile.height, fill=False, edgecolor=_ACCENT, linewidth=2
        )
    )
    for number, label in enumerate(["neither", "seen only", "sprayed only", "both"]):
        if np.any(state == number):
            ax.plot([], [], "s", color=colors(number), label=label)
    ax.plot([], [], color=_ACCENT, linewidth=2, label="tile")
    ax.legend(loc="center", fontsize=9, framealpha=0.95)
    ax.set_title(
        f"Wall at {tile.distance:.2f} m: spray {100 * reach.spray_share:.0f} %, "
        f"scan {100 * reach.scan_share:.0f} %",
        color=_INK,
    )
    ax.set_aspect("equal")
    ax.set_xlabel("T x, m")
    ax.set_ylabel("T y, m")


def main(arguments: list[str] | None = None) -> None:
    """Writes reach_map.png into the folder given by --out."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, required=True, help="folder to write to")
    folder: Path = parser.parse_args(arguments).out
    folder.mkdir(parents=True, exist_ok=True)
    draw_reach_map(Scenario()).savefig(folder / "reach_map.png")


if __name__ == "__main__":
    main()
