"""Obstacles as boxes in T, the wall among them, and clearance from them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from pydrake.common import Parallelism
from pydrake.geometry import Box
from pydrake.math import RigidTransform
from pydrake.planning import CollisionChecker
from scipy import ndimage

from painter.errors import CollisionError
from painter.planning.clearance.prefilter import SeparatingAxisPrefilter
from perception.ground import BoolArray, FloatArray, FrozenValue
from perception.values import WallSegmentation

_MIN_HEIGHT = 0.01  # m; lower things are within the wall's own unevenness.
_MIN_FILL = 0.6  # A region that fills less of its box is split into two boxes.
_WALL_THICKNESS = 0.10  # m, behind T z = 0.
_WALL_BORDER = 1.0  # m of wall expected around the tile.
_FEW = 8  # Every so many-th configuration of a motion is checked first.
_INFLUENCE = 0.1  # m, within which the nearest pair is searched for a report.


@dataclass(frozen=True, eq=False)
class ObstacleBox(FrozenValue):
    """A box in front of (or behind) the wall, its edges along T's axes.

    Attributes:
        name: Of the obstacle, for messages.
        lower: (3,) m, in T.
        upper: (3,) m, in T.
    """

    name: str
    lower: FloatArray
    upper: FloatArray


def wall_box(width: float, height: float, *, keepout: float = 0.0) -> ObstacleBox:
    """Makes the box of the wall and of a layer in front of it that stays free.

    Args:
        width: Of the tile, m.
        height: Of the tile, m.
        keepout: Thickness of the layer, m.
    """
    return ObstacleBox(
        "wall",
        np.array([-_WALL_BORDER, -_WALL_BORDER, -_WALL_THICKNESS]),
        np.array([width + _WALL_BORDER, height + _WALL_BORDER, keepout]),
    )


def segmentation_boxes(segmentation: WallSegmentation) -> tuple[ObstacleBox, ...]:
    """Turns a segmentation into boxes: the wall first, then what stands out of it.

    Cells that were not seen count as wall. Each connected region more than 1 cm in
    front of the wall becomes one box or several that together cover it, as high as
    its highest cell.

    Args:
        segmentation: Labelled grid; depth along T z, m.
    """
    cell = segmentation.cell
    height = np.nan_to_num(np.asarray(segmentation.depth, dtype=float), nan=0.0)
    ny, nx = height.shape
    regions, _ = ndimage.label(height > _MIN_HEIGHT, structure=np.ones((3, 3)))
    boxes = [wall_box(nx * cell, ny * cell)]
    for number, window in enumerate(ndimage.find_objects(regions), start=1):
        filled = regions[window] == number
        row, column = window[0].start, window[1].start
        top = height[window]
        for r0, r1, c0, c1 in _cover(filled):
            boxes.append(
                ObstacleBox(
                    f"obstacle {number}",
                    np.array([(column + c0) * cell, (row + r0) * cell, 0.0]),
                    np.array(
                        [
                            (column + c1) * cell,
                            (row + r1) * cell,
                            top[r0:r1, c0:c1][filled[r0:r1, c0:c1]].max(),
                        ]
                    ),
                )
            )
    return tuple(boxes)


def _cover(filled: BoolArray) -> list[tuple[int, int, int, int]]:
    """Covers True cells with rectangles (r0, r1, c0, c1), halving what is sparse."""
    done: list[tuple[int, int, int, int]] = []
    open_ = [(0, filled.shape[0], 0, filled.shape[1])]
    while open_:
        r0, r1, c0, c1 = open_.pop()
        rows = np.flatnonzero(filled[r0:r1, c0:c1].any(axis=1))
        columns = np.flatnonzero(filled[r0:r1, c0:c1].any(axis=0))
        if rows.size == 0:
            continue
        r0, r1 = r0 + int(rows[0]), r0 + int(rows[-1]) + 1
        c0, c1 = c0 + int(columns[0]), c0 + int(columns[-1]) + 1
        sparse = filled[r0:r1, c0:c1].mean() < _MIN_FILL
        if not sparse or max(r1 - r0, c1 - c0) <= 2:
            done.append((r0, r1, c0, c1))
        elif r1 - r0 >= c1 - c0:
            middle = (r0 + r1) // 2
            open_ += [(r0, middle, c0, c1), (middle, r1, c0, c1)]
        else:
            middle = (c0 + c1) // 2
            open_ += [(r0, r1, c0, middle), (r0, r1, middle, c1)]
    return done


class ClearSpace:
    """Checks that the arm keeps its clearance from all known obstacles.

    It clones the given checker, so that the boxes of one wall are not kept for the next
    one.
    """

    def __init__(
        self,
        checker: CollisionChecker,
        *,
        X_WT: RigidTransform,
        boxes: Sequence[ObstacleBox],
        clearance: float,
        floor_clearance: float,
    ) -> None:
        """Adds the boxes to a clone of the checker.

        Args:
            checker: Of the robot's cell: arm, frame and floor.
            X_WT: Tile frame T in W.
            boxes: Obstacles, in T.
            clearance: Least distance of the arm from the boxes, m.
            floor_clearance: Least distance from floor and frame, m, <= `clearance`.
        """
        self.clearance = clearance
        self.boxes = tuple(boxes)
        self._checker = checker.Clone()
        # The checker has one padding for all that is fixed in W, so the boxes grow by
        # the difference.
        self._floor_clearance = floor_clearance
        grown = 2.0 * (clearance - floor_clearance)
        self._names: dict[int, str] = {}
        world = self._checker.plant().world_body()
        for index, box in enumerate(self.boxes):
            X_TB = RigidTransform((box.lower + box.upper) / 2.0)
            added = self._checker.AddCollisionShapeToBody(
                f"{box.name} ({index})",
                world,
                Box(box.upper - box.lower + grown),
                X_WT @ X_TB,
            )
            assert added, box.name
        self._checker.SetPaddingAllRobotEnvironmentPairs(floor_clearance)
        self._prefilter = SeparatingAxisPrefilter(self._checker, X_WT)

    def free(self, q: FloatArray, *, slack: float = 0.0) -> BoolArray:
        """Returns which configurations keep clear.

        Args:
            q: (n, 5) rad.
            slack: Taken off every clearance, m.

        Returns:
            (n,) bool.
        """
        free = self._prefiltered(q, slack)
        free[~free] = self._checked(q[~free], slack)
        return free

    def all_free(self, q: FloatArray) -> bool:
        """Returns whether all configurations q (n, 5) keep clear.

        A few along the way are checked before those between them: an obstacle mostly
        blocks a whole stretch of a motion.
        """
        few = np.zeros(len(q), dtype=bool)
        few[::_FEW] = True
        remaining = ~self._prefiltered(q)
        return all(self._checked(q[remaining & some]).all() for some in (few, ~few))

    def _prefiltered(self, q: FloatArray, slack: float = 0.0) -> BoolArray:
        """Returns which configurations the prefilter proves clear; see `free`."""
        return self._prefilter.passes(q, self._floor_clearance - slack)

    def _checked(self, q: FloatArray, slack: float = 0.0) -> BoolArray:
        """Returns which configurations the checker finds clear; see `free`."""
        if not len(q):
            return np.zeros(0, dtype=bool)
        self._checker.SetPaddingAllRobotEnvironmentPairs(self._floor_clearance - slack)
        answers = self._checker.CheckConfigsCollisionFree(
            list(np.asarray(q, float)), Parallelism(False)
        )
        return np.array(answers, dtype=bool)

    def worst_pair(self, q: FloatArray) -> str:
        """Names the two bodies at q (5,) that lack most of their clearance."""
        found = self._checker.CalcRobotClearance(np.asarray(q, float), _INFLUENCE)
        lacking = np.asarray(found.distances())  # Padding is taken off already.
        if lacking.size == 0:
            return "nothing near"
        least = int(np.argmin(lacking))
        pair = (found.robot_indices()[least], found.other_indices()[least])
        names = [self._checker.get_body(index).name() for index in pair]
        names = ["surroundings" if name == "world" else name for name in names]
        return f"{names[0]} and {names[1]}, {-1e3 * lacking[least]:.0f} mm too near"

    def require(
        self, q: FloatArray, time: FloatArray, *, what: str, slack: float = 0.0
    ) -> None:
        """Raises if a sampled motion comes too near to an obstacle.

        Args:
            q: (n, 5) rad.
            time: (n,) s.
            what: Name of the motion, for the message.
            slack: Taken off every clearance, m.

        Raises:
            CollisionError: Names time, bodies, the lacking distance and the clearance.
        """
        remaining = np.flatnonzero(~self._prefiltered(q, slack))
        begin, count = 0, 1
        while begin < len(remaining):
            # In a blocked motion the first blocked place mostly comes early.
            rows = remaining[begin : begin + count]
            free = self._checked(q[rows], slack)
            if not free.all():
                first = int(rows[np.argmin(free)])
                raise CollisionError(
                    f"{what}: {self.worst_pair(q[first])} at {time[first]:.2f} s; "
                    f"clearance is {1e3 * self.clearance:.0f} mm, "
                    f"{1e3 * self._floor_clearance:.0f} mm from floor and frame.",
                    code="PNT-MOTION-001",
                )
            begin, count = begin + count, 2 * count
