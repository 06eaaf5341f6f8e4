"""The truth against areas and heights worked out by hand."""

import math

import numpy as np
import pytest

from painter.scene.config import ObjectConfig, OpeningConfig, Scene
from painter.scene.load import load_scene
from painter.scene.solids import SurfaceKind
from painter.scene.surface import height_field, is_paintable, surface_at
from perception.settings import validate


def make_scene(*things: OpeningConfig | ObjectConfig) -> Scene:
    scene = Scene(
        openings=[thing for thing in things if isinstance(thing, OpeningConfig)],
        objects=[thing for thing in things if isinstance(thing, ObjectConfig)],
    )
    validate(scene)
    return scene


def area(scene: Scene, kind: SurfaceKind, cell: float = 0.01) -> float:
    field = height_field(scene, cell=cell)
    return np.count_nonzero(field.kind == kind) * field.cell**2


def test_blank_tile_is_all_wall_at_height_zero():
    field = height_field(Scene(), cell=0.01)
    assert field.height.shape == (200, 200)
    assert is_paintable(field.kind).all()
    np.testing.assert_array_equal(field.height, 0.0)


def test_grid_starts_at_the_margins_corner():
    field = height_field(Scene(), cell=0.02, margin=0.1)
    assert field.kind.shape == (110, 110)
    np.testing.assert_allclose(field.origin, [-0.1, -0.1])
    np.testing.assert_allclose(field.x[[0, -1]], [-0.09, 2.09])
    np.testing.assert_allclose(field.y[[0, -1]], [-0.09, 2.09])


def test_grid_covers_a_tile_of_another_size():
    field = height_field(Scene(), cell=0.03, width=1.0, height=0.5)
    assert field.kind.shape == (17, 34)


def test_nothing_is_there_beside_the_wall():
    height, kind = surface_at(Scene(), [-0.61, 1.0, 1.0], [1.0, -0.21, 2.39])
    assert kind.tolist() == [SurfaceKind.NONE, SurfaceKind.NONE, SurfaceKind.WALL]
    np.testing.assert_array_equal(np.isnan(height), [True, True, False])


def test_window_areas_are_those_of_its_rectangles():
    # All edges lie on multiples of the cell, so counting cells is exact.
    scene = make_scene(
        OpeningConfig(
            x=0.5,
            y=0.6,
            width=1.0,
            height=0.8,
            frame_width=0.05,
            vertical_bars=1,
            bar_width=0.04,
        )
    )
    glass = (1.0 - 2 * 0.05 - 0.04) * (0.8 - 2 * 0.05)
    assert area(scene, SurfaceKind.WALL) == pytest.approx(4.0 - 0.8)
    assert area(scene, SurfaceKind.GLASS) == pytest.approx(glass)
    assert area(scene, SurfaceKind.FRAME) == pytest.approx(0.8 - glass)


def test_door_to_the_floor_is_cut_by_the_tiles_edge():
    scene = make_scene(
        OpeningConfig(
            kind="door",
            x=0.3,
            y=-0.2,
            width=0.8,
            height=2.0,
            frame_width=0.1,
            panel_share=0.5,
        )
    )
    # Clear height -0.1 to 1.7; the joint at 0.8 is covered by a rail of 0.1.
    assert area(scene, SurfaceKind.WALL) == pytest.approx(4.0 - 0.8 * 1.8)
    assert area(scene, SurfaceKind.PANEL) == pytest.approx(0.6 * 0.75)
    assert area(scene, SurfaceKind.GLASS) == pytest.approx(0.6 * 0.85)


def test_depths_in_an_opening():
    scene = make_scene(
        OpeningConfig(
            kind="door",
            x=0.5,
            y=0.0,
            width=1.0,
            height=1.6,
            recess=0.12,
            frame_width=0.1,
            frame_depth=0.06,
            panel_share=0.5,
        )
    )
    x, y = [0.55, 1.0, 1.0, 1.0], [0.8, 0.8, 0.3, 1.3]
    height, kind = surface_at(scene, x, y)
    assert kind.tolist() == [
        SurfaceKind.FRAME,
        SurfaceKind.FRAME,
        SurfaceKind.PANEL,
        SurfaceKind.GLASS,
    ]
    # Panel and glass, 24 mm both, stand in the middle of the frame's 60 mm.
    np.testing.assert_allclose(height, [-0.12, -0.12, -0.138, -0.138], atol=1e-12)


def test_neighbouring_openings_leave_no_gap():
    left = OpeningConfig(x=0.3, y=0.4, width=0.7, height=0.6)
    right = OpeningConfig(x=0.3 + 0.7, y=0.5, width=0.4, height=0.6)
    scene = make_scene(left, right)
    x, y = np.meshgrid(np.linspace(0.0, 2.0, 201), np.linspace(0.0, 2.0, 201))
    _, kind = surface_at(scene, x, y)
    assert not (kind == SurfaceKind.NONE).any()


def test_sphere():
    x0, y0, z0, radius = 0.9, 1.1, 0.03, 0.05
    scene = make_scene(
        ObjectConfig(shape="sphere", size=[2 * radius], position=[x0, y0, z0])
    )
    r = np.array([0.0, 0.01, 0.03, 0.045])
    height, kind = surface_at(scene, x0 + 0.6 * r, y0 - 0.8 * r)
    expected = z0 + np.sqrt(radius**2 - r**2)
    np.testing.assert_allclose(height, expected, atol=1e-12)
    assert (kind == SurfaceKind.OBJECT).all()
    assert area(scene, SurfaceKind.OBJECT, 0.001) == pytest.approx(
        math.pi * radius**2,
        rel=0.01,  # 1 mm cells on a circumference of 314 mm.
    )


def test_box_pitched_about_y_is_a_ramp():
    angle = 0.3
    edges, center = np.array([0.2, 0.1, 0.06]), np.array([1.0, 1.0, 0.1])
    scene = make_scene(
        ObjectConfig(
            size=edges.tolist(),
            position=center.tolist(),
            rpy_deg=[0.0, math.degrees(angle), 0.0],
        )
    )
    # The top face goes through its centre p = center + R z h/2 with normal R z.
    normal = np.array([math.sin(angle), 0.0, math.cos(angle)])
    top = center + 0.5 * edges[2] * normal
    x = top[0] + np.array([-0.08, -0.03, 0.0, 0.05, 0.09]) * math.cos(angle)
    height, kind = surface_at(scene, x, np.full(5, 1.04))
    expected = top[2] - (x - top[0]) * math.tan(angle)
    np.testing.assert_allclose(height, expected, atol=1e-12)
    assert (kind == SurfaceKind.OBJECT).all()
    assert surface_at(scene, 1.0, 1.051)[1] == SurfaceKind.WALL


def test_box_on_its_corner_peaks_at_its_highest_vertex():
    rpy = [35.0, 20.0, 10.0]
    scene = make_scene(
        ObjectConfig(size=[0.1, 0.08, 0.06], position=[1.0, 1.0, 0.2], rpy_deg=rpy)
    )
    roll, pitch, yaw = np.deg2rad(rpy)
    c, s = np.cos, np.sin
    Rx = np.array([[1, 0, 0], [0, c(roll), -s(roll)], [0, s(roll), c(roll)]])
    Ry = np.array([[c(pitch), 0, s(pitch)], [0, 1, 0], [-s(pitch), 0, c(pitch)]])
    Rz = np.array([[c(yaw), -s(yaw), 0], [s(yaw), c(yaw), 0], [0, 0, 1]])
    signs = np.stack(np.meshgrid(*[[-1, 1]] * 3)).reshape(3, 8)
    vertices = Rz @ Ry @ Rx @ (signs * [[0.05], [0.04], [0.03]])
    vertices += [[1.0], [1.0], [0.2]]
    highest = vertices[:, vertices[2].argmax()]
    inward = 1e-9 * (np.array([1.0, 1.0]) - highest[:2])  # Off the exact edge.
    height, _ = surface_at(scene, *(highest[:2] + inward))
    assert height == pytest.approx(highest[2], abs=1e-8)


def test_cylinder_leaning_over():
    angle, radius, length = 0.5, 0.04, 0.4
    # Rolled by -90 deg + angle, its axis is (0, cos, sin): it rises along y.
    scene = make_scene(
        ObjectConfig(
            shape="cylinder",
            size=[2 * radius, length],
            position=[1.0, 1.0, 0.2],
            rpy_deg=[math.degrees(angle) - 90.0, 0.0, 0.0],
        )
    )
    x = np.array([-0.03, -0.01, 0.0, 0.02, 0.035])
    y = np.array([-0.05, 0.0, 0.02, 0.05, 0.08])
    height, _ = surface_at(scene, 1.0 + x, 1.0 + y)
    # A tilted cylinder's mantle: x² + (z cos a - y sin a)² = r².
    mantle = np.sqrt(radius**2 - x**2) + y * math.sin(angle)
    np.testing.assert_allclose(height, 0.2 + mantle / math.cos(angle), atol=1e-12)


def test_upright_cylinder_is_a_disc():
    scene = make_scene(
        ObjectConfig(shape="cylinder", size=[0.3, 0.1], position=[1.0, 1.0, 0.05])
    )
    height, _ = surface_at(scene, [1.0, 1.149, 1.151], [1.0, 1.0, 1.0])
    np.testing.assert_allclose(height, [0.1, 0.1, 0.0], atol=1e-12)
    assert area(scene, SurfaceKind.OBJECT, 0.002) == pytest.approx(
        math.pi * 0.15**2, rel=0.01
    )


def test_nearer_body_hides_the_farther_one():
    low = ObjectConfig(size=[0.4, 0.4, 0.02], position=[1.0, 1.0, 0.01])
    high = ObjectConfig(size=[0.1, 0.1, 0.10], position=[1.0, 1.0, 0.05])
    for scene in (make_scene(low, high), make_scene(high, low)):
        height, _ = surface_at(scene, [1.0, 1.15], [1.0, 1.0])
        np.testing.assert_allclose(height, [0.10, 0.02], atol=1e-12)


def test_cubes_cover_the_sum_of_their_squares():
    scene = load_scene("cubes", 1)
    expected = sum(body.size[0] ** 2 for body in scene.objects)
    # 5 mm cells: turned edges of some 5 m cut 1000 cells at random.
    assert area(scene, SurfaceKind.OBJECT, 0.005) == pytest.approx(expected, rel=0.01)


def test_bad_grids_are_refused():
    with pytest.raises(ValueError, match=r"cell must be > 0 m, got 0\.0"):
        height_field(Scene(), cell=0.0)
    with pytest.raises(ValueError, match="margin must be >= 0 m"):
        height_field(Scene(), cell=0.01, margin=-0.1)


def test_height_field_is_frozen():
    field = height_field(Scene(), cell=0.1)
    with pytest.raises(ValueError, match="read-only"):
        field.height[0, 0] = 1.0
