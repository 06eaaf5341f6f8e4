"""Forward model of a D435-like stereo depth camera: from true depth to its picture.

The steps follow a block matcher: true depth becomes disparity, near edges grow by half
the matcher's window, what the right imager does not see is lost, noise is added, the
result is quantised and turned back into depth.

Source: Intel, "Subpixel linearity improvement for RealSense depth cameras": Z = f B / d
with f = (W / 2) / tan(HFOV / 2), hence sigma_Z = Z² sigma_d / (f B); Intel, "D400
series data sheet", 337029, "invalid depth band": the left imager is the reference, so a
band of f B / Z px on the left has no depth. Window sizes of the noise and of glass are
assumptions; the other constants are `StereoConfig`'s.
"""

import dataclasses

import numpy as np
import numpy.typing as npt
from scipy.ndimage import uniform_filter
from scipy.special import ndtri

from perception.config import StereoConfig
from perception.depth_camera.depth import CameraIntrinsics
from perception.depth_camera.windows import moving_max, moving_min
from perception.ground import BoolArray
from perception.settings import validate

FloatImage = npt.NDArray[np.float32]
DepthImage = npt.NDArray[np.uint16]

_NOISE_WINDOW = 5
"""Two 5 px boxes in a row have a standard deviation of 2 px: neighbours correlate."""
_GLASS_WINDOW = 25
"""The same for what a pane of glass returns: blotches some 20 px wide."""
_GLASS_FIXED_SHARE = 0.8
"""Share of the blotches' variance that stays from picture to picture."""
_GLASS_GAP = 0.002
"""A pane is where the depth with glass is nearer than without by this, m."""
_EDGE = 0.25
"""Second difference of disparity over the matcher's window that makes an edge, px."""


class StereoModel:
    """One camera: its settings and the patterns that its make has fixed.

    Nothing in it changes after it was made; what varies from picture to picture comes
    from the generator given to `measure`.
    """

    def __init__(self, config: StereoConfig, seed: int) -> None:
        """Creates the camera.

        Args:
            config: Geometry and errors; copied.
            seed: Makes this camera's fixed patterns.

        Raises:
            ValueError: A setting is out of bounds.
        """
        validate(config, "wall_camera.stereo")
        self._config = dataclasses.replace(config)
        intrinsics = CameraIntrinsics.from_stereo(config)
        self._focal = intrinsics.fx
        self._shape = (config.height, config.width)
        # A spawned seed, so that no picture's generator repeats the fixed pattern.
        rng = np.random.default_rng(np.random.SeedSequence(seed).spawn(1)[0])
        self._noise = correlated_noise(rng, self._shape, _NOISE_WINDOW)
        self._glass = correlated_noise(rng, self._shape, _GLASS_WINDOW)
        self._column = np.arange(config.width, dtype=np.float32)
        row = np.arange(config.height, dtype=np.float32)[:, np.newaxis]
        self._x, self._y = intrinsics.rays(self._column, row)

    @property
    def depth_disparity(self) -> float:
        """Product of depth and disparity, f B, m px."""
        return self._focal * self._config.baseline

    def measure(
        self,
        depth: FloatImage,
        depth_with_glass: FloatImage,
        rng: np.random.Generator,
    ) -> DepthImage:
        """Takes a picture.

        Args:
            depth: (H, W) float32, true depth along C's z with panes of glass left out,
                m; 0 = too near to be rendered, inf = nothing there.
            depth_with_glass: The same with the panes as solid bodies.
            rng: Draws this picture's noise; the same state gives the same picture.

        Returns:
            (H, W) uint16, mm, 0 = no return.

        Raises:
            ValueError: A picture is not of the camera's size.
        """
        for name, image in (("depth", depth), ("depth_with_glass", depth_with_glass)):
            if image.shape != self._shape:
                raise ValueError(
                    f"{name} must be {self._shape} (H, W), got {image.shape}."
                )
        config = self._config
        noise = correlated_noise(rng, self._shape, _NOISE_WINDOW)
        depth, hole = self._look_through_glass(depth, depth_with_glass, rng)
        true = self._disparity(depth)
        disparity = self._grow_near_edges(true, noise, rng)
        lost = hole & (disparity == true)
        lost |= self._hidden_from_right(disparity)
        lost |= self._grazing(true, rng)
        # Half a picture away the noise is independent of what it is here.
        lost |= _elsewhere(noise, 0.5) < np.float32(ndtri(config.dropout))
        return self._to_depth(self._with_errors(disparity, noise), lost)

    def _look_through_glass(
        self,
        depth: FloatImage,
        depth_with_glass: FloatImage,
        rng: np.random.Generator,
    ) -> tuple[FloatImage, BoolArray]:
        """Returns the depth of what the matcher sees and where it sees nothing.

        A pane shows what is behind it, nothing, or the robot itself: a mirror image
        lies as far behind the pane as the thing stands in front, at twice its depth.
        """
        pane = depth_with_glass < depth - np.float32(_GLASS_GAP)
        if not pane.any():
            return depth, pane
        config = self._config
        blotches = _mix(
            self._glass,
            correlated_noise(rng, self._shape, _GLASS_WINDOW),
            _GLASS_FIXED_SHARE,
        )
        hole = pane & (blotches < ndtri(config.hole_share))
        mirror = pane & (blotches > ndtri(1.0 - config.reflection_share))
        return np.where(mirror, 2 * depth_with_glass, depth), hole

    def _disparity(self, depth: FloatImage) -> FloatImage:
        """Returns f B / Z, px; what is too near gets more than can be measured."""
        with np.errstate(divide="ignore"):
            disparity = np.float32(self.depth_disparity) / depth
        too_near = 2.0 * self.depth_disparity / self._config.min_range
        return np.asarray(np.minimum(disparity, np.float32(too_near)))

    def _grow_near_edges(
        self, disparity: FloatImage, noise: FloatImage, rng: np.random.Generator
    ) -> FloatImage:
        """Grows the near side of depth edges by half the matcher's window.

        On a plane disparity is linear in the image, so the second difference over the
        window is zero however steep the plane, and an edge's height beside an edge.
        """
        config = self._config
        near = moving_max(disparity, config.fattening)
        second = near + moving_min(disparity, config.fattening) - 2 * disparity
        grown = second > _EDGE
        grown &= _elsewhere(noise, 0.25) < ndtri(config.fattening_share)
        pixels = np.flatnonzero(grown)
        # Some match half near and half far: flying pixels.
        share, where = rng.random((2, pixels.size), dtype=np.float32)
        share[where >= config.flying_share] = 1.0
        result = disparity.copy()
        old = disparity.flat[pixels]
        result.flat[pixels] = old + share * (near.flat[pixels] - old)
        return result

    def _hidden_from_right(self, disparity: FloatImage) -> BoolArray:
        """Returns where the right imager sees something nearer, or is out of picture.

        Pixel u is column u - d of the right imager. It is hidden if a pixel to its
        right has a lower one.
        """
        right = self._column - disparity
        lowest = np.minimum.accumulate(right[:, ::-1], axis=1)[:, ::-1]
        return np.asarray((right > lowest) | (right < 0))

    def _grazing(self, disparity: FloatImage, rng: np.random.Generator) -> BoolArray:
        """Draws the pixels that are lost because the surface is seen at a low angle.

        With the surface n . P = h and the ray r = (x, y, 1), disparity is
        f B (n . r) / h; so f d,u and f d,v are n's x and y in units of h / (f B), z
        follows, and cos(incidence) = d / (|n| |r|) in the same units. A pixel is kept
        with probability cos / cos(grazing angle), at most 1.
        """
        x = self._focal * _slope(disparity, axis=1)
        y = self._focal * _slope(disparity, axis=0)
        z = disparity - self._x * x - self._y * y
        ray = 1 + self._x**2 + self._y**2
        bound = np.cos(np.deg2rad(self._config.grazing_deg)) ** 2
        draw = rng.random(self._shape, dtype=np.float32)
        least = draw**2 * np.float32(bound) * ray * (x**2 + y**2 + z**2)
        return np.asarray(disparity**2 < least)

    def _with_errors(self, disparity: FloatImage, noise: FloatImage) -> FloatImage:
        """Adds fixed and temporal noise and ripple, and quantises."""
        config = self._config
        quantum = np.float32(config.quantum)
        noise = _mix(self._noise, noise, config.fixed_share)
        ripple = np.sin(np.float32(2 * np.pi) * disparity)
        error = np.float32(config.subpixel) * noise + np.float32(config.ripple) * ripple
        return np.asarray(quantum * np.rint((disparity + error) / quantum))

    def _to_depth(self, disparity: FloatImage, lost: BoolArray) -> DepthImage:
        config = self._config
        with np.errstate(divide="ignore"):
            depth = np.float32(self.depth_disparity) / disparity
        lost = lost | ~((depth >= config.min_range) & (depth <= config.max_range))
        depth_mm: DepthImage = np.rint(1000 * np.where(lost, 0, depth)).astype(
            np.uint16
        )
        return depth_mm


def correlated_noise(
    rng: np.random.Generator, shape: tuple[int, int], window: int
) -> FloatImage:
    """Draws Gaussian noise of unit variance whose neighbours are correlated.

    Args:
        rng: Generator.
        shape: Height and width, px.
        window: Edge of the box that white noise is averaged with twice, px.

    Returns:
        (H, W) float32; it joins up across opposite borders.
    """
    noise = rng.standard_normal(shape, dtype=np.float32)
    for _ in range(2):
        noise = uniform_filter(noise, window, mode="wrap")
    # Two boxes of n make a triangle, whose squares add up to (2 n² + 1) / (3 n³); once
    # along each axis, and the root of the product is the standard deviation.
    return noise / np.float32((2 * window**2 + 1) / (3 * window**3))


def _mix(fixed: FloatImage, temporal: FloatImage, share: float) -> FloatImage:
    """Adds two noises to unit variance, of which `share` is the fixed one's."""
    return np.float32(share**0.5) * fixed + np.float32((1 - share) ** 0.5) * temporal


def _elsewhere(noise: FloatImage, share: float) -> FloatImage:
    """Returns the noise shifted by a share of the picture."""
    height, width = noise.shape
    return np.roll(noise, (round(share * height), round(share * width)), (0, 1))


def _slope(image: FloatImage, axis: int) -> FloatImage:
    """Returns the change per pixel, zero at the border.

    Of the differences to both sides the smaller one: a depth edge is no slope.
    """
    change = np.moveaxis(np.diff(image, axis=axis), axis, 0)
    slope = np.moveaxis(np.zeros_like(image), axis, 0)
    before, after = change[:-1], change[1:]
    slope[1:-1] = np.where(np.abs(before) < np.abs(after), before, after)
    return np.moveaxis(slope, 0, axis)
