"""Drake's own view of a scene against the height field."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from pydrake.geometry import (
    ClippingRange,
    DepthRange,
    DepthRenderCamera,
    MakeRenderEngineVtk,
    QueryObject,
    RenderCameraCore,
    RenderEngineVtkParams,
)
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.sensors import CameraInfo

from painter.scene.config import BaseErrorConfig, ObjectConfig, Scene, WallConfig
from painter.scene.load import load_scene
from painter.scene.sdf import scene_sdf, wall_pose
from painter.scene.solids import SurfaceKind
from painter.scene.surface import surface_at
from painter.scene.texture import wall_picture
from perception.settings import validate

# The nominal tile 1.05 m before the base, its lower edge 0.2 m over the floor.
X_WT = RigidTransform(
    RotationMatrix(np.array([[0.0, 0, -1], [-1, 0, 0], [0, 1, 0]])), [1.05, 1.0, 0.2]
)
NAMES = ["blank", "cubes", "obstacles", "terrace", "room", "random"]


class World:
    """A scene welded into a plant at the pose it has for the robot."""

    def __init__(self, scene: Scene, folder: Path | None = None) -> None:
        builder = DiagramBuilder()
        plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.001)
        for name in ("scene", "with_glass"):
            engine = MakeRenderEngineVtk(RenderEngineVtkParams(backend="EGL"))
            scene_graph.AddRenderer(name, engine)
        parser = Parser(plant)
        parser.SetStrictParsing()
        parser.AddModelsFromString(scene_sdf(scene, folder), "sdf")
        self.X_WS = wall_pose(scene, X_WT)
        link = plant.GetModelInstanceByName("scene")
        plant.WeldFrames(
            plant.world_frame(), plant.GetFrameByName("scene", link), self.X_WS
        )
        plant.Finalize()
        self._diagram = builder.Build()
        self._context = self._diagram.CreateDefaultContext()
        context = scene_graph.GetMyContextFromRoot(self._context)
        self.query: QueryObject = scene_graph.get_query_output_port().Eval(context)
        self._world = scene_graph.world_frame_id()

    def depth(self, renderer: str, camera: CameraInfo, p_SC: list[float]) -> np.ndarray:
        """Depth picture from a point of S, looking squarely at the wall."""
        X_SC = RigidTransform(RotationMatrix.MakeXRotation(np.pi), p_SC)
        core = RenderCameraCore(
            renderer, camera, ClippingRange(0.05, 20.0), RigidTransform()
        )
        image = self.query.RenderDepthImage(
            DepthRenderCamera(core, DepthRange(0.1, 15.0)),
            self._world,
            self.X_WS @ X_SC,
        )
        return image.data[:, :, 0].copy()


def compare_depth(scene: Scene, folder: Path, renderer: str) -> dict[int, float]:
    """Largest difference of rendered and true height, for each kind that is seen.

    The camera is so far away and so narrow that its rays are nearly square to the wall;
    pixels next to a step of the truth are left out.
    """
    world = World(scene, folder)
    distance = 12.0
    camera = CameraInfo(400, 400, np.arctan(2.2 / 2 / distance) * 2)
    depth = world.depth(renderer, camera, [1.0, 1.0, distance])
    rows, columns = np.indices(depth.shape)
    # Each pixel's ray meets the surface at this point of S.
    x = 1.0 + (columns - camera.center_x()) / camera.focal_x() * depth
    y = 1.0 - (rows - camera.center_y()) / camera.focal_y() * depth
    steps = 0.0, 0.01, -0.01  # A pixel is 5.5 mm; the first look is straight at it.
    looks = [surface_at(scene, x + dx, y + dy) for dx in steps for dy in steps]
    heights = np.array([height for height, _ in looks])
    kinds = np.array([kind for _, kind in looks])
    clear = (np.ptp(heights, axis=0) < 0.02) & (kinds == kinds[0]).all(axis=0)
    error = np.abs(distance - depth - heights[0])
    assert clear.mean() > 0.85
    seen = np.unique(kinds[0][clear])
    return {int(k): float(error[clear & (kinds[0] == k)].max()) for k in seen}


@pytest.mark.parametrize("name", NAMES)
def test_rendered_depth_agrees_with_the_truth(name: str, tmp_path: Path):
    errors = compare_depth(load_scene(name, 1), tmp_path, "with_glass")
    assert SurfaceKind.WALL in errors
    assert max(errors.values()) < 0.002  # VTK's depth buffer at 12 m: about 0.1 mm.


def test_rendered_depth_of_tilted_bodies_agrees_with_the_truth(tmp_path: Path):
    scene = Scene(
        objects=[
            ObjectConfig(
                size=[0.4, 0.3, 0.2], position=[0.5, 1.5, 0.1], rpy_deg=[20, -15, 30]
            ),
            ObjectConfig(
                shape="cylinder",
                size=[0.2, 0.5],
                position=[1.4, 1.4, 0.1],
                rpy_deg=[70, 10, 40],
            ),
            ObjectConfig(shape="sphere", size=[0.5], position=[1.0, 0.6, 0.0]),
        ]
    )
    validate(scene)
    errors = compare_depth(scene, tmp_path, "scene")
    # VTK draws cylinders and spheres as polyhedra: 0.25 m (1 - cos(pi/50)) is 0.5 mm,
    # more where the surface is steep.
    assert errors[SurfaceKind.OBJECT] < 0.004
    assert errors[SurfaceKind.WALL] < 0.002


@pytest.mark.parametrize(("name", "room"), [("room", 3.0), ("terrace", 2.5)])
def test_glass_is_seen_by_one_renderer_and_seen_through_by_the_other(name, room):
    scene = load_scene(name, 1)
    world = World(scene)
    pane = {"room": (0.7, 1.1), "terrace": (1.6, 1.0)}[name]
    height, kind = surface_at(scene, *pane)
    assert kind == SurfaceKind.GLASS
    camera = CameraInfo(41, 41, 0.02)  # Its middle pixel looks straight ahead.
    p_SC = [*pane, 0.7]
    glass = world.depth("with_glass", camera, p_SC)[20, 20]
    through = world.depth("scene", camera, p_SC)[20, 20]
    assert glass == pytest.approx(0.7 - float(height), abs=1e-3)
    assert through == pytest.approx(0.7 + scene.wall.thickness + room, abs=2e-3)


@pytest.mark.parametrize("name", ["obstacles", "terrace"])
def test_collision_geometry_is_where_the_truth_is(name: str):
    scene = load_scene(name, 1)
    world = World(scene)
    rng = np.random.default_rng(7)
    x, y = rng.uniform(0.02, 1.98, (2, 100))
    heights, _ = surface_at(scene, x, y)
    for above, expected in ((1e-4, True), (-1e-4, False)):
        p_SQs = np.stack([x, y, heights + above])
        outside = [
            min(d.distance for d in world.query.ComputeSignedDistanceToPoint(p_WQ)) > 0
            for p_WQ in (world.X_WS @ p_SQs).T
        ]
        assert outside == [expected] * len(x)


def test_wall_stands_at_its_nominal_pose_without_base_error():
    assert wall_pose(Scene(), X_WT).IsExactlyEqualTo(X_WT)


def test_base_error_moves_the_wall_along_and_about_the_axes_of_W():
    shifted = Scene(base_error=BaseErrorConfig(x=0.01, y=0.02, z=-0.005))
    np.testing.assert_allclose(
        wall_pose(shifted, X_WT).translation(), [1.06, 1.02, 0.195], atol=1e-12
    )
    turned = wall_pose(Scene(base_error=BaseErrorConfig(yaw_deg=1.0)), X_WT)
    expected = RotationMatrix(RollPitchYaw(0.0, 0.0, np.deg2rad(1.0)))
    np.testing.assert_allclose(
        turned.translation(), expected @ X_WT.translation(), atol=1e-12
    )
    # A wall turned about the base keeps its distance from the base axis.
    normal = turned.rotation().col(2)
    assert normal @ turned.translation() == pytest.approx(-1.05, abs=1e-12)


def test_textured_wall_is_flat_and_carries_its_picture(tmp_path: Path):
    scene = load_scene("terrace", 1)
    text = scene_sdf(scene, tmp_path)
    assert (tmp_path / "wall.obj").as_uri() in text
    with Image.open(tmp_path / "wall.png") as picture:
        assert picture.size[0] / picture.size[1] == pytest.approx(3.2 / 2.6, rel=0.01)
    # Without a folder nothing is written and the wall is plain.
    assert "wall.obj" not in scene_sdf(scene)


def test_bricks_have_the_format_of_the_norm():
    wall = WallConfig(width=2.0, height=1.66, texture="brick", color=[0.6, 0.2, 0.1])
    picture = wall_picture(wall)
    mortar = picture[:, :, 2] > 0.4
    # Joints: 12 mm in 83 mm flat; 10 mm in 250 mm upright over what is left. A joint is
    # rounded to whole pixels of 3.3 mm.
    share = 12 / 83 + (1 - 12 / 83) * 10 / 250
    assert mortar.mean() == pytest.approx(share, abs=0.02)
    np.testing.assert_array_equal(picture, wall_picture(wall))
