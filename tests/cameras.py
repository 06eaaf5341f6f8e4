"""Depth cameras other than the default one, and cells with the camera turned."""

from pathlib import Path

from painter.resources import models_path

# Overrides of a scenario. Source: Intel, "D400 series data sheet", 337029, tables of
# depth field of view, baseline and range; the nearest depth is f B / 126 px at 848 px.
CAMERAS = {
    "D435": [],
    "D415": [
        "wall_camera.stereo.hfov_deg=65",
        "wall_camera.stereo.baseline=0.055",
        "wall_camera.stereo.min_range=0.291",
    ],
    "D455": [
        "wall_camera.stereo.baseline=0.095",
        "wall_camera.stereo.min_range=0.337",
    ],
}
# For objects at 7 to 50 cm, so it scans from nearer by.
D405 = [
    "wall_camera.stereo.baseline=0.018",
    "wall_camera.stereo.min_range=0.07",
    "wall_camera.stereo.max_range=0.5",
]
D405_NEAR = [*D405, "scan.distance=0.45", "scan.look_distance=0.5"]

_LEVEL = "translation: [0.154, -0.0175, 0.06]"
# The left imager stays over the gun, 0.09 m above its axis: with 43.5 deg downwards it
# sees past the nozzle.
_UPRIGHT = """translation: [0.154, 0.0, {z}]
      rotation: !Rpy {{deg: [{roll_deg}, 0, 0]}}"""
MOUNTS = {
    "level": None,
    "C x up": {"roll_deg": -90, "z": 0.1075},
    "C x down": {"roll_deg": 90, "z": 0.0725},
}


def write_cell(folder: Path, mount: str) -> str:
    """Writes the robot's cell with a mount of `MOUNTS`; returns its directives."""
    cell = models_path("painter_cell.dmd.yaml")
    turned = MOUNTS[mount]
    if turned is None:
        return str(cell)
    text = cell.read_text()
    assert text.count(_LEVEL) == 1
    path = folder / "turned_cell.dmd.yaml"
    path.write_text(text.replace(_LEVEL, _UPRIGHT.format(**turned)))
    return str(path)
