"""The robot's surroundings in simulation: scene, camera, paint film, clearances.

The simulated station adds them to a plant that moves, the world of a rehearsal to an
arm that is posed.
"""

import dataclasses
import functools
import tempfile
from pathlib import Path

import numpy as np
from pydrake.geometry import (
    ClippingRange,
    ColorRenderCamera,
    DepthRange,
    DepthRenderCamera,
    MakeRenderEngineVtk,
    RenderCameraCore,
    RenderEngineVtkParams,
    SceneGraph,
)
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import CoulombFriction, MultibodyPlant
from pydrake.systems.framework import DiagramBuilder, OutputPort
from pydrake.systems.sensors import RgbdSensor

from painter.config import Scenario
from painter.robot.arm_model import (
    FLOOR,
    ROBOT_MODELS,
    X_W_FLOOR,
    GetArmKinematics,
)
from painter.robot.true_scene import true_scene
from painter.scene.sdf import scene_sdf
from painter.scene.surface import height_field
from painter.systems.simulated.clearance_monitor import ClearanceMonitor
from painter.systems.simulated.gun_pose import GunPose
from painter.systems.simulated.paint_film import FilmState, PaintFilm
from painter.systems.simulated.stereo_camera import StereoCamera, render_camera_info
from perception.depth_camera.depth import CameraIntrinsics

# Renderers: glass transparent, and glass opaque.
SCENE_RENDERER = "scene"
GLASS_RENDERER = "with_glass"
FILM_CELL = 0.01
FILM_MARGIN = 0.35


@functools.cache
def _SceneFiles() -> tempfile.TemporaryDirectory:
    """Returns the folder for scenes' meshes, removed when the process ends."""
    return tempfile.TemporaryDirectory(prefix="painter-scene-")


def AddScene(plant: MultibodyPlant, scenario: Scenario) -> None:
    """Adds the scene, welded to W, and the floor.

    Args:
        plant: Not finalised, with the robot in it.
        scenario: Names the scene.
    """
    scene, X_WS = true_scene(scenario)
    # Renderers and Meshcat read the mesh and texture of a wall later on.
    folder = tempfile.mkdtemp(dir=_SceneFiles().name)
    Parser(plant).AddModelsFromString(scene_sdf(scene, Path(folder)), "sdf")
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("scene"), X_WS)
    plant.RegisterCollisionGeometry(
        plant.world_body(), X_W_FLOOR, FLOOR, "floor", CoulombFriction(0.8, 0.8)
    )


def AddSurroundings(
    builder: DiagramBuilder,
    plant: MultibodyPlant,
    scene_graph: SceneGraph,
    scenario: Scenario,
    *,
    state: OutputPort,
    film: FilmState | None,
) -> None:
    """Adds the wall camera, the gun's paint and the monitors of clearance.

    Exports the input `gun.trigger` and the outputs `wall_camera.*`, `cheat.X_WG`,
    `cheat.film`, `cheat.clearance`, `cheat.floor_clearance` and `cheat.query_object`.

    Args:
        builder: Holds `scene_graph`.
        plant: With robot and scene; need not be in the builder.
        scene_graph: With the geometry of the plant.
        scenario: Scene, camera and gun.
        state: (10,) true q, v of the arm; rad, rad/s.
        film: Film that is on the wall already; None = none.
    """
    camera = _AddWallCamera(builder, plant, scene_graph, scenario)
    _AddClearance(builder, plant, scene_graph)
    scene, X_WS = true_scene(scenario)
    surface = height_field(
        scene,
        cell=FILM_CELL,
        margin=FILM_MARGIN,
        width=scenario.tile.width,
        height=scenario.tile.height,
    )
    paint = builder.AddNamedSystem(
        "paint_film",
        PaintFilm(
            height=surface.height,
            cell=surface.cell,
            origin=surface.origin,
            X_WS=X_WS,
            tip=scenario.gun.tip,
            before=film,
        ),
    )
    gun = builder.AddNamedSystem(
        "gun_pose", GunPose(kinematics=GetArmKinematics(plant))
    )
    builder.Connect(state, gun.GetInputPort("state"))
    builder.Connect(gun.GetOutputPort("X_WG"), paint.GetInputPort("X_WG"))
    builder.ExportInput(paint.GetInputPort("trigger"), "gun.trigger")
    builder.ConnectInput("gun.trigger", camera.GetInputPort("gun_trigger"))
    builder.ExportOutput(gun.GetOutputPort("X_WG"), "cheat.X_WG")
    builder.ExportOutput(paint.GetOutputPort("film"), "cheat.film")


def _AddClearance(
    builder: DiagramBuilder, plant: MultibodyPlant, scene_graph: SceneGraph
) -> None:
    """Adds monitors of the robot's clearance from the scene, and from floor and frame.

    The base is left out: it stands on the frame.
    """
    base = plant.GetBodyByName("base", plant.GetModelInstanceByName("arm"))

    def geometries(*models: str) -> frozenset:
        return frozenset(
            geometry
            for model in models
            for body in plant.GetBodyIndices(plant.GetModelInstanceByName(model))
            if body != base.index()
            for geometry in plant.GetCollisionGeometriesForBody(plant.get_body(body))
        )

    floor = frozenset(plant.GetCollisionGeometriesForBody(plant.world_body()))
    query_port = scene_graph.get_query_output_port()
    for name, surroundings in (
        ("clearance", geometries("scene")),
        ("floor_clearance", geometries("frame") | floor),
    ):
        monitor = builder.AddNamedSystem(
            f"{name}_monitor",
            ClearanceMonitor(
                robot=geometries(*ROBOT_MODELS), surroundings=surroundings
            ),
        )
        builder.Connect(query_port, monitor.GetInputPort("query_object"))
        builder.ExportOutput(monitor.GetOutputPort("clearance"), f"cheat.{name}")
    builder.ExportOutput(query_port, "cheat.query_object")


def _AddWallCamera(
    builder: DiagramBuilder,
    plant: MultibodyPlant,
    scene_graph: SceneGraph,
    scenario: Scenario,
) -> StereoCamera:
    """Adds the renderers, the ideal cameras and the stereo camera's errors."""
    config = scenario.wall_camera
    for name in (SCENE_RENDERER, GLASS_RENDERER):
        engine = MakeRenderEngineVtk(RenderEngineVtkParams(backend="EGL"))
        scene_graph.AddRenderer(name, engine)
    mount = plant.GetFrameByName("camera_depth")
    X_error = RigidTransform(
        RollPitchYaw(np.deg2rad(config.mount_error_deg)), config.mount_error_m
    )
    X_BC = mount.GetFixedPoseInBodyFrame() @ X_error
    frame_id = plant.GetBodyFrameIdOrThrow(mount.body().index())

    depth_intrinsics = CameraIntrinsics.from_stereo(config.stereo)
    color_intrinsics = CameraIntrinsics.from_stereo(
        dataclasses.replace(
            config.stereo, width=config.color_width, height=config.color_height
        )
    )

    def core(renderer: str, intrinsics: CameraIntrinsics) -> RenderCameraCore:
        return RenderCameraCore(
            renderer,
            render_camera_info(intrinsics),
            ClippingRange(0.02, 20.0),
            RigidTransform(),
        )

    def sensor(renderer: str) -> RgbdSensor:
        color = ColorRenderCamera(core(GLASS_RENDERER, color_intrinsics))
        depth = DepthRenderCamera(
            core(renderer, depth_intrinsics), DepthRange(0.05, 15.0)
        )
        return RgbdSensor(frame_id, X_BC, color, depth)

    stereo = builder.AddNamedSystem(
        "stereo_camera",
        StereoCamera(config=config.stereo, seed=scenario.random_seed, rate=config.rate),
    )
    query_port = scene_graph.get_query_output_port()
    for renderer, port in (
        (SCENE_RENDERER, "ideal_depth"),
        (GLASS_RENDERER, "ideal_depth_with_glass"),
    ):
        camera = builder.AddNamedSystem(f"camera_{renderer}", sensor(renderer))
        builder.Connect(query_port, camera.query_object_input_port())
        builder.Connect(camera.depth_image_32F_output_port(), stereo.GetInputPort(port))
    builder.ExportOutput(camera.color_image_output_port(), "wall_camera.color_image")
    for port in ("depth_image", "image_time"):
        builder.ExportOutput(stereo.GetOutputPort(port), f"wall_camera.{port}")
    return stereo
