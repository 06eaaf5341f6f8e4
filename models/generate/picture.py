"""Renders models/arm/arm.png: `python -m painter_models.generate.picture`."""

from pathlib import Path

import numpy as np
from PIL import Image
from pydrake.geometry import (
    Box,
    ClippingRange,
    ColorRenderCamera,
    DepthRange,
    DepthRenderCamera,
    LightParameter,
    MakeRenderEngineVtk,
    RenderCameraCore,
    RenderEngineVtkParams,
    SsaoParameter,
)
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.sensors import CameraInfo, RgbdSensor

from painter.robot.arm_model import AddRobot, GetArmKinematics, MakeArmPlant

CELL = "package://painter_models/painter_cell.dmd.yaml"
WALL_DISTANCE = 1.05
_BACKGROUND = np.array([0.90, 0.92, 0.93])
_FLOOR = np.array([0.52, 0.53, 0.53, 1.0])
_WALL = np.array([0.80, 0.78, 0.73, 1.0])
# Key, fill from the camera's side, rim from behind, and a weak one from below.
_LIGHTS = [
    ((0.75, 0.4, -0.7), 2.2),
    ((0.35, 0.95, -0.15), 1.1),
    ((-0.9, 0.3, -0.25), 0.7),
    ((0.1, 0.2, 1.0), 0.35),
]
_OVERSAMPLE = 2


def look_at(eye: list[float], target: list[float]) -> RigidTransform:
    """Returns the pose in W of a camera (x right, y down, z ahead), m."""
    ahead = np.subtract(target, eye)
    ahead = ahead / np.linalg.norm(ahead)
    right = np.cross(ahead, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    axes = np.stack([right, np.cross(ahead, right), ahead], axis=1)
    return RigidTransform(RotationMatrix(axes), eye)


def RenderRobot(
    q: np.ndarray, X_WC: RigidTransform, *, width: int, height: int, fov_y: float
) -> Image.Image:
    """Renders the robot before a wall.

    Args:
        q: (5,) rad.
        X_WC: Pose of the camera.
        width: Of the picture, px.
        height: Of the picture, px.
        fov_y: Vertical field of view, rad.
    """
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.001)
    AddRobot(Parser(plant), CELL)
    for name, size, center, color in (
        ("floor", (4.0, 8.0, 0.02), (-0.9, 0.0, -0.01), _FLOOR),
        ("wall", (0.05, 8.0, 3.4), (WALL_DISTANCE + 0.025, 0.0, 1.7), _WALL),
    ):
        plant.RegisterVisualGeometry(
            plant.world_body(), RigidTransform(center), Box(*size), name, color
        )
    plant.Finalize()
    params = RenderEngineVtkParams(
        backend="EGL",
        default_clear_color=_BACKGROUND,
        ssao=SsaoParameter(),
        lights=[
            LightParameter(
                type="directional", frame="world", direction=way, intensity=intensity
            )
            for way, intensity in _LIGHTS
        ],
    )
    scene_graph.AddRenderer("vtk", MakeRenderEngineVtk(params))
    core = RenderCameraCore(
        "vtk",
        CameraInfo(width * _OVERSAMPLE, height * _OVERSAMPLE, fov_y),
        ClippingRange(0.05, 30.0),
        RigidTransform(),
    )
    sensor = builder.AddNamedSystem(
        "camera",
        RgbdSensor(
            scene_graph.world_frame_id(),
            X_WC,
            ColorRenderCamera(core, False),
            DepthRenderCamera(core, DepthRange(0.1, 20.0)),
        ),
    )
    builder.Connect(
        scene_graph.get_query_output_port(), sensor.query_object_input_port()
    )
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    plant.SetPositions(plant.GetMyContextFromRoot(context), q)
    port = sensor.color_image_output_port()
    pixels = port.Eval(sensor.GetMyContextFromRoot(context)).data[:, :, :3]
    image = Image.fromarray(pixels)
    return image.resize((width, height), Image.Resampling.LANCZOS)


def draw_robot() -> Image.Image:
    """Returns the robot painting, and a close view of its wrist, side by side."""
    arm = GetArmKinematics(MakeArmPlant(CELL))
    p_WG = np.array([WALL_DISTANCE - 0.30, 0.05, 1.30])
    q = arm.solve(p_WG, np.array([1.0, 0.0, 0.0]))[0]
    views = [
        (look_at([-1.75, -3.5, 1.9], [0.1, 0.0, 1.05]), 720, 0.62),
        (look_at([0.98, -1.12, 1.64], [0.625, 0.05, 1.34]), 560, 0.38),
    ]
    height = 860
    pictures = [
        RenderRobot(q, X_WC, width=width, height=height, fov_y=fov_y)
        for X_WC, width, fov_y in views
    ]
    gap = 8
    sheet = Image.new("RGB", (sum(p.width for p in pictures) + gap, height), "white")
    sheet.paste(pictures[0], (0, 0))
    sheet.paste(pictures[1], (pictures[0].width + gap, 0))
    return sheet


if __name__ == "__main__":
    target = Path(__file__).resolve().parents[1] / "arm" / "arm.png"
    draw_robot().quantize(256, dither=Image.Dither.NONE).save(target, optimize=True)
