"""The replay's paint lies where the strokes are."""

import numpy as np
from pydrake.geometry import Meshcat
from pydrake.math import RigidTransform

from painter.planning.spray_path import Motion, PaintProgram, Stroke
from painter.run.pictures.replay import add_paint, set_view


def test_each_stroke_becomes_pieces_in_the_published_scene():
    stroke = Stroke(
        start_T=np.array([0.5, 0.2]),
        end_T=np.array([0.5, 0.7]),
        speed=0.5,
        kind="body",
        column=0,
    )
    motion = Motion(
        time=np.array([0.0, 2.0]),
        q=np.zeros((2, 5)),
        v=np.zeros((2, 5)),
        spray_on=np.array([[0.5, 1.5]]),
    )
    program = PaintProgram(
        strokes=(stroke,),
        motion=motion,
        X_WT=RigidTransform([1.0, 1.0, 0.2]),
        standoff=0.3,
        nominal_thickness=1e-4,
    )
    meshcat = Meshcat()
    set_view(meshcat)
    meshcat.StartRecording(frames_per_second=10.0)
    add_paint(meshcat, program, pitch=0.13, start=3.0)
    meshcat.PublishRecording()
    # 0.5 m in pieces of 0.1 m.
    present = [meshcat.HasPath(f"/drake/paint/0/{index}") for index in range(6)]
    assert present == [True] * 5 + [False]
