"""A scene as an SDF model for Drake, and where it stands in the world."""

from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw

from painter.scene.config import Scene
from painter.scene.solids import Solid, SurfaceKind, scene_solids
from painter.scene.texture import write_textured_wall

_DRAKE = "{http://drake.mit.edu}"
ElementTree.register_namespace("drake", "http://drake.mit.edu")


def wall_pose(scene: Scene, X_WT_nominal: RigidTransform) -> RigidTransform:
    """Returns the true pose of the scene, given where the job expects the tile.

    Args:
        scene: The scene; its base error moves the wall about and along W's axes.
        X_WT_nominal: Nominal tile pose in W.

    Returns:
        X_WS, pose of the scene frame in W.
    """
    error = scene.base_error
    angles = np.deg2rad([error.roll_deg, error.pitch_deg, error.yaw_deg])
    X_error = RigidTransform(RollPitchYaw(angles), [error.x, error.y, error.z])
    return X_error @ X_WT_nominal


def scene_sdf(scene: Scene, folder: Path | None = None) -> str:
    """Returns the scene as SDF: a model "scene" whose one link "scene" has frame S.

    The caller welds the link to the world at `wall_pose`. Only a renderer named
    "with_glass" draws glass; all renderers draw everything else. All but the room
    behind the glass has collision geometry.

    Args:
        scene: The scene.
        folder: Existing folder for the mesh and picture of a textured wall; the SDF
            points to them, so it must outlive the renderer. None = a plain wall.

    Returns:
        The SDF document.
    """
    sdf = ElementTree.Element("sdf", version="1.9")
    model = ElementTree.SubElement(sdf, "model", name="scene")
    link = ElementTree.SubElement(model, "link", name="scene")
    solids = scene_solids(scene)
    pieces = [solid for solid in solids if solid.kind == SurfaceKind.WALL]
    textured = folder is not None and scene.wall.texture != "none"
    if folder is not None and textured:
        mesh = write_textured_wall(scene.wall, pieces, folder)
        visual = ElementTree.SubElement(link, "visual", name="wall")
        geometry = ElementTree.SubElement(visual, "geometry")
        uri = ElementTree.SubElement(ElementTree.SubElement(geometry, "mesh"), "uri")
        uri.text = mesh.resolve().as_uri()
    for solid in solids:
        if not (textured and solid.kind == SurfaceKind.WALL):
            _add_visual(link, solid)
        if solid.kind != SurfaceKind.NONE:
            _add_shape(link, "collision", solid)
    ElementTree.indent(sdf)
    return ElementTree.tostring(sdf, encoding="unicode")


def _add_visual(link: ElementTree.Element, solid: Solid) -> None:
    visual = _add_shape(link, "visual", solid)
    if solid.kind == SurfaceKind.GLASS:
        renderer = ElementTree.SubElement(visual, f"{_DRAKE}accepting_renderer")
        renderer.text = "with_glass"
    material = ElementTree.SubElement(visual, "material")
    ElementTree.SubElement(material, "diffuse").text = _numbers(solid.rgba)


def _add_shape(
    link: ElementTree.Element, tag: str, solid: Solid
) -> ElementTree.Element:
    element = ElementTree.SubElement(link, tag, name=solid.name)
    rpy = RollPitchYaw(solid.X_SP.rotation()).vector()
    pose = (*solid.X_SP.translation(), *rpy)
    ElementTree.SubElement(element, "pose").text = _numbers(pose)
    geometry = ElementTree.SubElement(element, "geometry")
    shape = ElementTree.SubElement(geometry, solid.shape)
    if solid.shape == "box":
        ElementTree.SubElement(shape, "size").text = _numbers(solid.size)
    else:
        ElementTree.SubElement(shape, "radius").text = _numbers([0.5 * solid.size[0]])
    if solid.shape == "cylinder":
        ElementTree.SubElement(shape, "length").text = _numbers([solid.size[1]])
    return element


def _numbers(values: "np.typing.ArrayLike") -> str:
    # Twelve digits keep a nanometre and hide the rounding of sums of decimal fractions.
    return " ".join(f"{value:.12g}" for value in np.asarray(values, dtype=float))
