import numpy as np
import pytest

from perception.depth_camera.windows import moving_max, moving_min


@pytest.mark.parametrize("size", [1, 3, 5, 7, 9])
def test_window_extremes_equal_a_search_by_hand(size):
    image = np.random.default_rng(1).integers(0, 1000, (13, 17))
    half = size // 2
    for row, column in np.ndindex(image.shape):
        window = image[
            max(row - half, 0) : row + half + 1,
            max(column - half, 0) : column + half + 1,
        ]
        assert moving_max(image, size)[row, column] == window.max()
        assert moving_min(image, size)[row, column] == window.min()


@pytest.mark.parametrize("size", [0, -3, 4])
def test_even_or_empty_windows_are_refused(size):
    with pytest.raises(ValueError, match="size must be odd"):
        moving_max(np.zeros((4, 4)), size)
