"""The wall's own surface as the gun follows it: heights and normals, smooth in T.

A surface coordinate is (x, y, distance): the foot (x, y) on the surface and the
distance from it along the normal there. On a flat wall these are T's own x, y and z, so
a plan in them for a flat wall holds for any other.
"""

import functools
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import RectBivariateSpline
from scipy.ndimage import gaussian_filter

from painter.planning.tile import cell_centres
from perception.ground import FloatArray, FrozenValue
from perception.values import WallSegmentation

# Flatter walls are sprayed as planes: the error is within the strokes' tolerances.
_FLAT_HEIGHT = 0.005  # m
_FLAT_DEG = 1.0
# m, standard deviation of the Gaussian that smooths heights (0.09 m wide at half its
# height), so that the gun turns gently over an edge and ripples do not shake it.
_SMOOTHING = 0.04
_KNOTS = 0.02  # m, between the spline's.
_BORDER = (
    0.5  # m beyond the tile; the surface continues there with its slope at the edge.
)
_DEGREE = 5  # Its normals, and with them the joints, have continuous accelerations.
_ROUNDS = 60  # Of the search for a foot; each takes at least a quarter off the error.


@dataclass(frozen=True, eq=False)
class SurfaceFrame(FrozenValue):
    """A smooth surface over T with its normals.

    Attributes:
        x: (nx,) m in T, ascending.
        y: (ny,) m in T, ascending.
        height: (ny, nx) m along T z.
    """

    x: FloatArray
    y: FloatArray
    height: FloatArray

    @classmethod
    def of_wall(cls, segmentation: WallSegmentation) -> "SurfaceFrame | None":
        """Makes the surface that the gun follows on a wall; cached for the last wall.

        Args:
            segmentation: Of the tile.

        Returns:
            The surface; None if none is known, or if the wall is flat within 5 mm and
            1 degree.
        """
        return _surface_of(segmentation)

    @classmethod
    def smoothed(cls, height: FloatArray, cell: float) -> "SurfaceFrame":
        """Makes a surface of heights (ny, nx), m, at the centres of a tile's cells."""
        border = int(np.ceil(_BORDER / cell))
        fringe = int(np.ceil(4.0 * _SMOOTHING / cell))  # Cut off after smoothing.
        # Point reflection at an edge continues the slope there.
        wide = np.pad(height, border + fringe, mode="reflect", reflect_type="odd")
        step = max(1, round(_KNOTS / cell))
        smooth: FloatArray = gaussian_filter(wide, _SMOOTHING / cell)
        smooth = smooth[fringe:-fringe, fringe:-fringe]
        y, x = (
            (np.arange(count, dtype=np.float64) - border + 0.5)[::step] * cell
            for count in smooth.shape
        )
        return cls(x=x, y=y, height=smooth[::step, ::step])

    def heights(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Returns heights (n,), m along T z, at points (n,), m in T."""
        inside_x, inside_y = self._within(x, y)
        height = self._spline.ev(inside_y, inside_x)
        # Farther out the surface is a plane.
        slope_x, slope_y = self._slopes(inside_x, inside_y)
        return np.asarray(
            height + slope_x * (x - inside_x) + slope_y * (y - inside_y), dtype=float
        )

    def normals(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Returns normals (n, 3), unit, in T, towards the robot."""
        slope_x, slope_y = self._slopes(*self._within(x, y))
        normal = np.stack([-slope_x, -slope_y, np.ones_like(slope_x)], axis=-1)
        return np.asarray(normal / np.linalg.norm(normal, axis=-1, keepdims=True))

    def points(self, places: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Returns points and normals in T, (n, 3) each, of coordinates (n, 3), m."""
        x, y, distance = places.T
        normals = self.normals(x, y)
        feet = np.column_stack([x, y, self.heights(x, y)])
        return feet + distance[:, None] * normals, normals

    def places(self, p_TQs: FloatArray) -> FloatArray:
        """Returns the coordinates (n, 3), m, of points (n, 3), m in T.

        Inverts `points`. Where normals cross, far before a hollow, a point has no
        unique coordinates; the result is then one of them, or none.
        """
        places = np.array(p_TQs, dtype=np.float64)
        for _ in range(_ROUNDS):
            reached, normals = self.points(places)
            off = p_TQs - reached
            along = np.sum(off * normals, axis=1)
            across = off - along[:, None] * normals
            # Half of it: on a hill the foot moves by less than the point, in a hollow
            # by more.
            places[:, :2] += 0.5 * across[:, :2]
            places[:, 2] += along
        return places

    @functools.cached_property
    def _spline(self) -> RectBivariateSpline:
        return RectBivariateSpline(
            self.y, self.x, self.height, kx=_DEGREE, ky=_DEGREE, s=0
        )

    def _slopes(self, x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Returns the slopes (n,) along T x and T y, m/m, within the spline's ends."""
        return self._spline.ev(y, x, dy=1), self._spline.ev(y, x, dx=1)

    def _within(self, x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
        return (
            np.clip(x, self.x[0], self.x[-1]),
            np.clip(y, self.y[0], self.y[-1]),
        )


@functools.lru_cache(maxsize=1)
def _surface_of(segmentation: WallSegmentation) -> SurfaceFrame | None:
    """See `SurfaceFrame.of_wall`; a planner asks three times for one wall."""
    if segmentation.surface is None or segmentation.normals is None:
        return None
    height = np.asarray(segmentation.surface, dtype=np.float64)
    least = float(np.asarray(segmentation.normals)[..., 2].min())
    if np.abs(height).max() <= _FLAT_HEIGHT and least >= np.cos(np.deg2rad(_FLAT_DEG)):
        return None
    return SurfaceFrame.smoothed(height, segmentation.cell)


def above_wall(segmentation: WallSegmentation) -> FloatArray:
    """Returns the depth seen (ny, nx), m before the surface that the gun follows."""
    depth = np.asarray(segmentation.depth, dtype=np.float64)
    frame = SurfaceFrame.of_wall(segmentation)
    if frame is None:
        return depth
    xs, ys = np.meshgrid(*cell_centres(depth.shape, segmentation.cell))
    return depth - frame.heights(xs.ravel(), ys.ravel()).reshape(depth.shape)
