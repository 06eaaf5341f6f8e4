"""Pictures are drawn and show what the scene holds."""

from io import BytesIO

import matplotlib.image
import numpy as np
from matplotlib.colors import to_rgb

from painter.scene.load import load_scene
from painter.scene.pictures import KIND_COLORS, draw_contact_sheet, draw_scene
from painter.scene.solids import SurfaceKind


def shown_colors(figure) -> np.ndarray:
    """All colours of the figure as drawn, (n, 3), 0 to 1."""
    file = BytesIO()
    figure.savefig(file, format="png", dpi=50)
    file.seek(0)
    return matplotlib.image.imread(file)[..., :3].reshape(-1, 3)


def test_front_view_and_truth_stand_side_by_side():
    figure = draw_scene(load_scene("terrace", 1))
    view, truth = figure.axes
    assert view.get_title() == "terrace: seen from the robot"
    # Door 0.9 x 1.85 m and window 0.5 x 0.95 m of 4 m² are not wall.
    expected = 100 * (1 - (0.9 * 1.85 + 0.5 * 0.95) / 4.0)
    assert truth.get_title().startswith(f"truth: {expected:.0f} %")
    colors = shown_colors(figure)
    for kind in (SurfaceKind.FRAME, SurfaceKind.GLASS, SurfaceKind.PANEL):
        distance = np.abs(colors - to_rgb(KIND_COLORS[kind])).max(axis=1)
        assert (distance < 0.01).sum() > 100


def test_contact_sheet_has_two_pictures_a_scene():
    scenes = [load_scene("cubes", 1), load_scene("random", 3)]
    figure = draw_contact_sheet(scenes)
    assert len(figure.axes) == 4
    assert len(np.unique(shown_colors(figure), axis=0)) > 100
