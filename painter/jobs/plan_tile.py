"""The paint program of one segmented tile, with the predicted film."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from painter.config import Scenario, load_scenario
from painter.errors import InputError
from painter.planning.film.film_model import margin_cells
from painter.planning.film.preview import FilmPreview, preview_film
from painter.planning.program.program import strokes_from
from painter.planning.program.store import program_summary, save_program
from painter.planning.spray_path import PaintProgram
from painter.planning.tile import nominal_tile_pose
from painter.planning.zones import marked_cells
from painter.robot.planners import MakeProgramPlanner
from painter.run.figures.film_on_tile import film_around
from painter.run.folder.folder import RunFolder
from painter.run.pictures.film_preview import preview_picture
from painter.run.pictures.pictures import stroke_picture
from painter.run.pictures.style import png
from perception.ground import FloatArray
from perception.io.segmentations import load_segmentation
from perception.values import WallSegmentation

PICTURE_FILE = "program.png"
PREVIEW_FILE = "film.png"


@dataclass(frozen=True, eq=False)
class PlannedTile:
    """A paint program and what it was planned for.

    Attributes:
        program: Strokes, motion and what was skipped, with reasons.
        preview: Film after the strokes.
        wall: The tile as segmented.
        paintable: The same, with the cells to be painted as its mask.
        nominal: Wet film thickness that is aimed at, m.
        planning_time: Time that planning took, s.
    """

    program: PaintProgram
    preview: FilmPreview
    wall: WallSegmentation
    paintable: WallSegmentation
    nominal: float
    planning_time: float

    def figures(self) -> dict[str, Any]:
        """Returns counts, lengths (m), durations (s) and the predicted film."""
        return program_summary(self.program) | {
            "planning_time": self.planning_time,
            "predicted": self.preview.figures._asdict(),
        }

    def save(self, folder: Path) -> None:
        """Writes program.json, trajectory.npz, program.png and film.png."""
        save_program(folder, self.program, self.preview)
        strokes = stroke_picture(self.program, self.wall)
        (folder / PICTURE_FILE).write_bytes(png(strokes))
        film = preview_picture(self.preview, self.paintable, self.nominal)
        (folder / PREVIEW_FILE).write_bytes(png(film))


def plan_tile(
    segmentation: WallSegmentation | Path | str,
    scenario: Scenario | str = "cubes",
    *,
    expected_wall: bool = False,
    from_stroke: float = 1.0,
    touch_up: Path | str | None = None,
    area: Sequence[Sequence[float]] | None = None,
    show: Callable[[float, str], None] = lambda share, text: None,
) -> PlannedTile:
    """Plans the paint program of a segmented tile, from home to home.

    Example: `plan("runs/wall/segmentation.npz", expected_wall=True).program.strokes`.

    Args:
        segmentation: The tile, or its segmentation.npz.
        scenario: Robot, tip, tile and settings; a `Scenario`, a name or a path.
        expected_wall: Whether the tile is moved to where the scenario expects it, for
            recorded walls, whose frame is not the robot's.
        from_stroke: Stroke to begin with, from 1; 12.4 begins where four tenths of the
            twelfth are done.
        touch_up: Run folder whose film is touched up where it is thin.
        area: Corners [x, y], m in T, of the only area to paint: two opposite ones of a
            rectangle or all of a polygon.
        show: Called with the share of the work that is done, 0 to 1, and its step.

    Returns:
        The program, the predicted film, and figures.

    Raises:
        InputError: A file cannot be read, or options exclude each other.
        ReachError: The tile is out of the arm's reach.
    """
    if touch_up is not None and area is not None:
        raise InputError(
            "touch-up and mark: give only one of them.", code="PNT-USE-036"
        )
    job = load_scenario(scenario) if isinstance(scenario, str) else scenario
    wall = segmentation
    if not isinstance(wall, WallSegmentation):
        wall = load_segmentation(Path(wall))
    if expected_wall:
        wall = wall.replace(X_WT=nominal_tile_pose(job.tile))
    show(0.0, "robot")
    planner = MakeProgramPlanner(job)
    show(0.4, "strokes and motions")
    start = time.perf_counter()
    home = np.deg2rad(job.motion.home_deg)
    nominal = planner.nominal_film(wall)
    film = _film_before(wall, touch_up, area, nominal)
    if film is None:
        strokes = planner.strokes(wall)
    else:
        strokes = planner.touch_up_strokes(wall, film)
    program = planner.program(strokes, wall, home)
    if from_stroke != 1.0:
        rest = strokes_from(program.strokes, from_stroke)
        program = planner.program(rest, wall, home)
    planning_time = time.perf_counter() - start
    show(0.8, "film")
    paintable = wall.replace(wall_mask=planner.paintable(wall))
    preview = preview_film(
        program.strokes, paintable, tip=planner.tip, nominal=nominal, before=film
    )
    return PlannedTile(program, preview, wall, paintable, nominal, planning_time)


def _film_before(
    wall: WallSegmentation,
    touch_up: Path | str | None,
    area: Sequence[Sequence[float]] | None,
    nominal: float,
) -> FloatArray | None:
    """Returns the film on the tile and its margin, m; None = the tile is bare."""
    if touch_up is not None:
        return film_around(RunFolder(Path(touch_up)), wall)
    if area is None:
        return None
    mask = np.asarray(wall.wall_mask)
    corners = [list(corner) for corner in area]
    bare = marked_cells(corners, mask.shape, wall.cell) | ~mask
    return np.pad(np.where(bare, 0.0, nominal), margin_cells(wall.cell))
