"""Painter: a robot that scans a wall, finds out what to paint, and paints it.

`import painter` loads nothing; each name below loads what it needs when it is first
used. With them a notebook does what the commands do.

Jobs: `simulate`, `segment`, `map_sequence`, `calibrate`, `plan`, `propose_base`.
Scenarios and scenes: `Scenario`, `load_scenario`, `named_scenarios`, `load_scene`,
`named_scenes`, `draw_scene`.
Runs: `Run` opens a run folder; `EarlierRun` is one to resume or touch up.
Diagram: `MakePaintCycle`, to be simulated and taken apart with Drake.
Pictures: `map_picture`, `label_picture`, `mask_picture`, `stroke_picture`,
`film_picture`, `segmentation_picture`; `png` renders one.
Made-up clouds: `example_wall`. Errors: `PainterError`, `PerceptionError`.

Lengths are in m, angles in rad and times in s, unless a name ends in another unit.
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from painter.config import Scenario, load_scenario
    from painter.cycle.earlier_run import EarlierRun
    from painter.diagrams.paint_cycle import MakePaintCycle
    from painter.errors import PainterError
    from painter.jobs.calibrate_mount import calibrate_mount as calibrate
    from painter.jobs.plan_tile import plan_tile as plan
    from painter.jobs.propose_base import propose_base
    from painter.jobs.run_simulation import simulate
    from painter.resources import named_scenarios
    from painter.run.pictures.pictures import (
        film_picture,
        label_picture,
        map_picture,
        mask_picture,
        stroke_picture,
    )
    from painter.run.pictures.segmentation_picture import segmentation_picture
    from painter.run.pictures.style import png
    from painter.run.run import Run
    from painter.scene.load import load_scene, named_scenes
    from painter.scene.pictures import draw_scene
    from perception.errors import PerceptionError
    from perception.mapping.sessions.map_sequence import map_sequence
    from perception.recorded.segment_file import segment_file as segment
    from perception.synthetic.patch_wall import example_wall

    __version__: str

# Where each name lives; the attribute follows a colon where it has another name there.
_HOMES = {
    "EarlierRun": "painter.cycle.earlier_run",
    "MakePaintCycle": "painter.diagrams.paint_cycle",
    "PainterError": "painter.errors",
    "PerceptionError": "perception.errors",
    "Run": "painter.run.run",
    "Scenario": "painter.config",
    "calibrate": "painter.jobs.calibrate_mount:calibrate_mount",
    "draw_scene": "painter.scene.pictures",
    "example_wall": "perception.synthetic.patch_wall",
    "film_picture": "painter.run.pictures.pictures",
    "label_picture": "painter.run.pictures.pictures",
    "load_scenario": "painter.config",
    "load_scene": "painter.scene.load",
    "map_picture": "painter.run.pictures.pictures",
    "map_sequence": "perception.mapping.sessions.map_sequence",
    "mask_picture": "painter.run.pictures.pictures",
    "named_scenarios": "painter.resources",
    "named_scenes": "painter.scene.load",
    "plan": "painter.jobs.plan_tile:plan_tile",
    "png": "painter.run.pictures.style",
    "propose_base": "painter.jobs.propose_base",
    "segment": "perception.recorded.segment_file:segment_file",
    "segmentation_picture": "painter.run.pictures.segmentation_picture",
    "simulate": "painter.jobs.run_simulation",
    "stroke_picture": "painter.run.pictures.pictures",
}

__all__ = [
    "EarlierRun",
    "MakePaintCycle",
    "PainterError",
    "PerceptionError",
    "Run",
    "Scenario",
    "__version__",
    "calibrate",
    "draw_scene",
    "example_wall",
    "film_picture",
    "label_picture",
    "load_scenario",
    "load_scene",
    "map_picture",
    "map_sequence",
    "mask_picture",
    "named_scenarios",
    "named_scenes",
    "plan",
    "png",
    "propose_base",
    "segment",
    "segmentation_picture",
    "simulate",
    "stroke_picture",
]


def __getattr__(name: str) -> Any:
    """Imports a public name when it is first used (PEP 562)."""
    if name == "__version__":
        from importlib.metadata import version

        value: Any = version("painter")
    elif name in _HOMES:
        module, _, attribute = _HOMES[name].partition(":")
        value = getattr(importlib.import_module(module), attribute or name)
    else:
        raise AttributeError(f"module 'painter' has no attribute {name!r}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """Returns the public names."""
    return list(__all__)
