"""Writing URDF text from descriptions of links and joints."""

import math

from painter_models.generate.description import FixedFrame, Joint, Link, Model
from painter_models.generate.solids import central_inertia

_AXES = {"x": "1 0 0", "y": "0 1 0", "z": "0 0 1"}


def write_urdf(model: Model) -> str:
    """Returns the text of a model's URDF file."""
    blocks = [_link(link, model.folder) for link in model.links]
    blocks += [_joint(joint) for joint in model.joints]
    blocks += [_frame(frame) for frame in model.frames]
    return (
        '<?xml version="1.0"?>\n'
        "<!-- Written by `python -m painter_models.generate`: edit that. -->\n"
        f'<robot name="{model.folder}" xmlns:drake="http://drake.mit.edu">\n'
        + "".join(blocks)
        + "</robot>\n"
    )


def _origin(xyz: tuple[float, ...], rpy: tuple[float, ...]) -> str:
    return f'<origin xyz="{_numbers(xyz)}" rpy="{_numbers(rpy)}"/>'


def _numbers(values: tuple[float, ...]) -> str:
    return " ".join(f"{value + 0.0:.15g}" for value in values)


def _link(link: Link, folder: str) -> str:
    mass, com, inertia = central_inertia(link.parts)
    mesh = f"package://painter_models/{folder}/meshes/{link.name}.gltf"
    terms = " ".join(
        f'i{"xyz"[i]}{"xyz"[j]}="{inertia[i, j] + 0.0:.6g}"'
        for i in range(3)
        for j in range(i, 3)
    )
    lines = [
        f'  <link name="{link.name}">',
        "    <inertial>",
        f"      {_origin(tuple(com.round(6)), (0.0, 0.0, 0.0))}",
        f'      <mass value="{mass:.6g}"/>',
        f"      <inertia {terms}/>",
        "    </inertial>",
        "    <visual>",
        f'      <geometry><mesh filename="{mesh}"/></geometry>',
        "    </visual>",
    ]
    for number, shape in enumerate(link.collisions, start=1):
        lines += [
            f'    <collision name="{link.name}_{number}">',
            f"      {_origin(shape.center, shape.rpy)}",
            f"      <geometry>{shape.urdf}</geometry>",
            "    </collision>",
        ]
    return "\n".join([*lines, "  </link>\n"])


def _joint(joint: Joint) -> str:
    limit = (
        f'lower="{joint.lower:g}" upper="{joint.upper:g}" '
        f'velocity="{joint.velocity:g}" effort="{joint.effort:g}" '
        f'drake:acceleration="{joint.acceleration:g}"'
    )
    lines = [
        f'  <joint name="{joint.name}" type="revolute">',
        f"    {_origin(joint.xyz, (0.0, 0.0, 0.0))}",
        f'    <parent link="{joint.parent}"/>',
        f'    <child link="{joint.child}"/>',
        f'    <axis xyz="{_AXES[joint.axis]}"/>',
        f"    <limit {limit}/>",
        f'    <dynamics damping="{joint.damping:g}"/>',
        "  </joint>",
        f'  <transmission name="{joint.name}_transmission">',
        "    <type>transmission_interface/SimpleTransmission</type>",
        f'    <joint name="{joint.name}"/>',
        f'    <actuator name="{joint.name}">',
        f'      <drake:gear_ratio value="{joint.gear_ratio:g}"/>',
        f'      <drake:rotor_inertia value="{joint.rotor_inertia:g}"/>',
        "    </actuator>",
        "  </transmission>\n",
    ]
    return "\n".join(lines)


def _frame(frame: FixedFrame) -> str:
    rpy = tuple(math.radians(angle) for angle in frame.rpy_deg)
    return (
        f'  <frame name="{frame.name}" link="{frame.link}" '
        f'xyz="{_numbers(frame.xyz)}" rpy="{_numbers(rpy)}"/>\n'
    )
