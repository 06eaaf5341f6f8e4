"""Reading scenes: by name, from a file, or drawn from a seed."""

from pydrake.common.yaml import yaml_dump_typed

from painter.errors import InputError
from painter.named_yaml import read_named
from painter.resources import models_path
from painter.scene.config import Scene
from painter.scene.random_scene import draw_random_scene
from painter.typed_yaml import read_typed
from perception.settings import validate

_SUFFIX = ".scene.yaml"


def named_scenes() -> list[str]:
    """Returns the names of the scenes that come with the package."""
    files = models_path("scenes").glob(f"*{_SUFFIX}")
    return sorted(path.name.removesuffix(_SUFFIX) for path in files)


def load_scene(name: str, seed: int) -> Scene:
    """Loads a scene.

    Args:
        name: A name from `named_scenes()`, the path of a YAML file whose single top key
            is the scene's name, or "random".
        seed: Seed of the random scene; named scenes and files do not use it.

    Returns:
        The scene, checked.

    Raises:
        InputError: There is no such scene, a key is unknown or a value is not allowed;
            names the file, the key, the value and the bound.
    """
    if name == "random":
        return draw_random_scene(seed)
    path, fields = read_named("scene", name, [*named_scenes(), "random"])
    try:
        scene = read_typed(Scene, fields)
        validate(scene)
    except ValueError as error:
        raise InputError(f"{path}: {error}", code="PNT-SCENE-001") from error
    return scene


def dump_scene(scene: Scene) -> str:
    """Returns the whole scene as YAML that `load_scene` reads back."""
    return yaml_dump_typed({scene.name: scene}, schema=dict[str, Scene])
