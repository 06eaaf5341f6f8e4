"""The examples of docs/own-stage.md run as they stand there."""

import ast
import re
from pathlib import Path

import numpy as np
import pytest

from painter.systems.values import Phase

PAGE = Path(__file__).parents[2] / "docs/own-stage.md"
BLOCKS = re.findall(r"```python\n(.*?)```", PAGE.read_text(), re.DOTALL)


@pytest.mark.parametrize("block", BLOCKS[:2])
def test_own_stages_have_20_lines(block):
    (stage,) = (
        node for node in ast.parse(block).body if isinstance(node, ast.ClassDef)
    )
    assert stage.end_lineno - stage.lineno + 1 <= 20


@pytest.mark.timeout(1800)
def test_the_page_runs_a_whole_cycle_with_them():
    names = {}
    for block in BLOCKS:
        exec(compile(block, str(PAGE), "exec"), names)
    log, job = names["log"], names["job"]
    assert log.status.phase == Phase.DONE, log.status.cause
    # A blank wall: all of the tile within 15 mm of its plane, but for unseen cells.
    assert log.segmentation.cell == 0.02
    assert log.segmentation.wall_mask.shape == (30, 35)
    assert log.segmentation.wall_mask.mean() > 0.95
    (stroke,) = log.program.strokes
    assert stroke.length == pytest.approx(0.6 * job.tile.width)
    # Paint lies along the middle of the tile and not at its top.
    sprayed = log.time[np.flatnonzero(log.trigger)]
    planned = stroke.length / job.raster.speed
    assert sprayed[-1] - sprayed[0] == pytest.approx(planned, abs=0.05)
    ny, _ = log.film.thickness.shape
    rows = log.film.thickness.sum(axis=1)
    y = log.film.origin[1] + log.film.cell * (np.arange(ny) + 0.5)
    assert (rows @ y) / rows.sum() == pytest.approx(0.5 * job.tile.height, abs=0.02)
