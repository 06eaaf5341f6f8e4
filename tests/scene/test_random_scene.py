"""Random scenes: valid, apart from each other, repeatable."""

import itertools

import pytest

from painter.scene.config import ObjectConfig, Scene
from painter.scene.load import dump_scene, load_scene
from painter.scene.solids import SurfaceKind, scene_solids
from painter.scene.surface import cast_rays, height_field
from perception.settings import validate

SEEDS = range(30)
# Four bytes of a seed are usual; nothing may depend on its being small.
LARGE_SEED = 2**32 - 1


@pytest.mark.parametrize("seed", [*SEEDS, LARGE_SEED])
def test_random_scene_is_valid_and_within_its_promises(seed: int):
    scene = load_scene("random", seed)
    validate(scene)
    assert len(scene.openings) <= 2
    assert len(scene.objects) <= 6
    error = scene.base_error
    assert max(map(abs, (error.x, error.y, error.z))) <= 0.02
    assert max(map(abs, (error.roll_deg, error.pitch_deg, error.yaw_deg))) <= 1.0
    field = height_field(scene, cell=0.01)
    assert field.height.max() < 0.16
    assert (field.kind == SurfaceKind.WALL).mean() > 0.2


@pytest.mark.parametrize("seed", SEEDS)
def test_things_do_not_overlap(seed: int):
    scene = load_scene("random", seed)
    shadows = [shadow(scene, body) for body in range(len(scene.objects))]
    for a, b in itertools.combinations(shadows, 2):
        assert not (a & b).any()
    bare = Scene(wall=scene.wall, openings=scene.openings)
    on_wall = height_field(bare, cell=0.01).kind == SurfaceKind.WALL
    for a in shadows:
        assert a.any()
        assert on_wall[a].all()


def shadow(scene: Scene, number: int):
    """Cells of the tile behind one object."""
    alone = Scene(wall=scene.wall, objects=[scene.objects[number]])
    return height_field(alone, cell=0.01).kind == SurfaceKind.OBJECT


def test_objects_rest_on_the_wall():
    bodies = [body for seed in SEEDS for body in load_scene("random", seed).objects]
    assert {body.shape for body in bodies} == {"box", "cylinder", "sphere"}
    for body in bodies:
        assert highest(body) == pytest.approx(2 * body.position[2], abs=2e-4)


def highest(body: ObjectConfig) -> float:
    """Top of a body over its centre; it is as far below it, by symmetry."""
    solid = scene_solids(Scene(objects=[body]))[-1]
    height, _ = cast_rays([solid], *body.position[:2])
    return float(height)


def test_same_seed_same_scene_other_seed_other_scene():
    texts = [dump_scene(load_scene("random", seed)) for seed in SEEDS]
    assert texts == [dump_scene(load_scene("random", seed)) for seed in SEEDS]
    assert len(set(texts)) == len(SEEDS)
