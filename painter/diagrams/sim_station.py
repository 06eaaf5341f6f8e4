"""The simulated body: plant, drives, depth camera and paint film."""

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
    Meshcat,
    MeshcatVisualizer,
    RenderCameraCore,
    RenderEngineVtkParams,
    SceneGraph,
)
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import AddMultibodyPlant, CoulombFriction, MultibodyPlant
from pydrake.systems.framework import Diagram, DiagramBuilder
from pydrake.systems.sensors import RgbdSensor

from painter.config import Scenario
from painter.diagrams.arm_model import (
    FLOOR,
    ROBOT_MODELS,
    X_W_FLOOR,
    AddRobot,
    GetArmKinematics,
)
from painter.diagrams.joint_loop import AddJointLoop
from painter.planning.tile import nominal_tile_pose
from painter.scene.config import Scene
from painter.scene.load import load_scene
from painter.scene.sdf import scene_sdf, wall_pose
from painter.scene.surface import height_field
from painter.systems.clearance_monitor import ClearanceMonitor
from painter.systems.gun_pose import GunPose
from painter.systems.joint_encoder import JointEncoder
from painter.systems.paint_film import FilmState, PaintFilm
from painter.systems.simulated_drives import SimulatedDrives
from painter.systems.stereo_camera import StereoCamera, render_camera_info
from perception.depth import CameraIntrinsics

# Renderers: what light sees, and the same with panes of glass opaque.
SCENE_RENDERER = "scene"
GLASS_RENDERER = "with_glass"
FILM_CELL = 0.01
FILM_MARGIN = 0.35


def MakeSimStation(
    scenario: Scenario,
    *,
    film: FilmState | None = None,
    meshcat: Meshcat | None = None,
) -> Diagram:
    """Makes the simulated station of a scenario.

    The arm stands at its nominal pose in W; the errors of the base placement move the
    scene instead, which comes to the same for the robot.

    Args:
        scenario: Robot, scene, camera and gun.
        film: What is on the wall already; None = nothing.
        meshcat: Where to show robot and scene, or None.

    Returns:
        A diagram with the ports of `painter.diagrams.station` and these `cheat.*`
        outputs: `state` (10,) true q, v; `X_WG` true gun pose; `film` FilmState;
        `clearance` (1,) m, from the scene, and `floor_clearance` from floor and frame;
        `query_object`.
    """
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlant(scenario.plant_config, builder)
    AddRobot(Parser(plant), scenario.directives)
    scene = load_scene(scenario.scene, scenario.random_seed)
    X_WS = wall_pose(scene, nominal_tile_pose(scenario.tile))
    _AddScene(plant, scene, X_WS)
    plant.Finalize()
    arm = plant.GetModelInstanceByName("arm")
    plant.SetDefaultPositions(arm, np.deg2rad(scenario.motion.home_deg))
    _AddDrives(builder, plant, scenario)
    camera = _AddWallCamera(builder, plant, scene_graph, scenario)
    _AddGun(builder, plant, scenario, camera, scene, X_WS, film)
    _AddClearance(builder, plant, scene_graph)
    builder.ExportOutput(plant.get_state_output_port(arm), "cheat.state")
    if meshcat is not None:
        MeshcatVisualizer.AddToBuilder(builder, scene_graph, meshcat)
    diagram = builder.Build()
    diagram.set_name("station")
    return diagram


@functools.cache
def _SceneFiles() -> tempfile.TemporaryDirectory:
    """Returns the folder for scenes' meshes; it goes when the process ends."""
    return tempfile.TemporaryDirectory(prefix="painter-scene-")


def _AddScene(plant: MultibodyPlant, scene: Scene, X_WS: RigidTransform) -> None:
    # Renderers and Meshcat read the mesh and picture of a textured wall later on.
    folder = tempfile.mkdtemp(dir=_SceneFiles().name)
    Parser(plant).AddModelsFromString(scene_sdf(scene, Path(folder)), "sdf")
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("scene"), X_WS)
    plant.RegisterCollisionGeometry(
        plant.world_body(), X_W_FLOOR, FLOOR, "floor", CoulombFriction(0.8, 0.8)
    )


def _AddClearance(
    builder: DiagramBuilder, plant: MultibodyPlant, scene_graph: SceneGraph
) -> None:
    """Adds monitors of the robot's distance from the scene, and from floor and frame.

    The base stands on the frame, so that one is not asked about.
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


def _AddDrives(
    builder: DiagramBuilder, plant: MultibodyPlant, scenario: Scenario
) -> None:
    """Adds encoders, the drives' joint loops and what the drives report."""
    arm = plant.GetModelInstanceByName("arm")
    encoder = builder.AddNamedSystem(
        "joint_encoder", JointEncoder(bits=scenario.arm.encoder_bits)
    )
    faults = [(fault.time, fault.joint, fault.code) for fault in scenario.arm.faults]
    drives = builder.AddNamedSystem("drives", SimulatedDrives(faults=faults))
    builder.Connect(plant.get_state_output_port(arm), encoder.GetInputPort("state"))
    estimated = encoder.GetOutputPort("state_estimated")
    builder.Connect(estimated, drives.GetInputPort("state_estimated"))
    desired = AddJointLoop(builder, plant, scenario, estimated)
    builder.ExportInput(desired, "arm.desired_state")
    builder.ConnectInput("arm.desired_state", drives.GetInputPort("desired_state"))
    builder.ExportOutput(estimated, "arm.state_estimated")
    builder.ExportOutput(drives.GetOutputPort("status"), "arm.status")


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


def _AddGun(
    builder: DiagramBuilder,
    plant: MultibodyPlant,
    scenario: Scenario,
    camera: StereoCamera,
    scene: Scene,
    X_WS: RigidTransform,
    before: FilmState | None,
) -> None:
    """Adds the paint film on the scene's true surface."""
    arm = plant.GetModelInstanceByName("arm")
    surface = height_field(
        scene,
        cell=FILM_CELL,
        margin=FILM_MARGIN,
        width=scenario.tile.width,
        height=scenario.tile.height,
    )
    film = builder.AddNamedSystem(
        "paint_film",
        PaintFilm(
            height=surface.height,
            cell=surface.cell,
            origin=surface.origin,
            X_WS=X_WS,
            tip=scenario.gun.tip,
            before=before,
        ),
    )
    gun = builder.AddNamedSystem(
        "gun_pose", GunPose(kinematics=GetArmKinematics(plant))
    )
    builder.Connect(plant.get_state_output_port(arm), gun.GetInputPort("state"))
    builder.Connect(gun.GetOutputPort("X_WG"), film.GetInputPort("X_WG"))
    builder.ExportInput(film.GetInputPort("trigger"), "gun.trigger")
    builder.ConnectInput("gun.trigger", camera.GetInputPort("gun_trigger"))
    builder.ExportOutput(gun.GetOutputPort("X_WG"), "cheat.X_WG")
    builder.ExportOutput(film.GetOutputPort("film"), "cheat.film")
