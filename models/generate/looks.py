"""What every link looks like; the shapes keep within the collision geometry."""

import math

from painter_models.generate.description import MODELS
from painter_models.generate.mesh import Piece, Point, block, hose, plate, rod, turned

_JOINTS = {joint.name: joint for joint in MODELS["arm"].joints}
UPPER_ARM = _JOINTS["elbow_pitch"].xyz[0]
FOREARM = _JOINTS["wrist_pitch"].xyz[0]
SIDE = 0.115  # The upper arm runs this far beside the forearm.
MAST_TOP = MODELS["frame"].frames[0].xyz[2]

Outline = list[tuple[float, float]]


def _arc(
    center: tuple[float, float], radius: float, first: float, last: float, count: int
) -> Outline:
    """Points on an arc, counter-clockwise, angles in degrees."""
    angles = [
        math.radians(first + (last - first) * i / (count - 1)) for i in range(count)
    ]
    return [
        (center[0] + radius * math.cos(a), center[1] + radius * math.sin(a))
        for a in angles
    ]


def _bolts(
    center: Point, axis: str, circle: float, count: int, *, size: float = 0.0045
) -> list[Piece]:
    """Bolt heads on a circle, their heads towards the positive axis."""
    n = "xyz".index(axis)
    pieces = []
    for i in range(count):
        angle = 2.0 * math.pi * (i + 0.5) / count
        point = list(center)
        point[(n + 1) % 3] += circle * math.cos(angle)
        point[(n + 2) % 3] += circle * math.sin(angle)
        start = (point[0], point[1], point[2])
        pieces.append(rod("steel", start, 0.003, size, axis=axis, bevel=8e-4, sides=8))
    return pieces


def _base() -> list[Piece]:
    return [
        rod("anodised", (0, 0, 0), 0.014, 0.085, axis="z"),
        turned(
            "paint_white",
            [(0.014, 0), (0.014, 0.076), (0.026, 0.082), (0.135, 0.082), (0.15, 0.075)],
            axis="z",
        ),
        rod("paint_orange", (0, 0, 0.15), 0.008, 0.079, axis="z", bevel=0.001),
        rod("anodised", (0, 0, 0.158), 0.022, 0.083, axis="z", bevel=0.002),
        block("abs", (-0.078, 0, 0.06), (0.014, 0.06, 0.05)),
    ]


def _shoulder() -> list[Piece]:
    fins = [
        rod("anodised", (0, -0.140 + 0.012 * i, 0), 0.008, 0.064, axis="y", bevel=0.002)
        for i in range(6)
    ]
    return [
        rod("anodised", (0, 0, -0.158), 0.018, 0.075, axis="z", bevel=0.002),
        turned(
            "paint_white",
            [(-0.14, 0.073), (-0.125, 0.073), (-0.075, 0.06), (-0.03, 0.066)],
            axis="z",
        ),
        rod("paint_white", (0, -0.068, 0), 0.118, 0.084, axis="y", bevel=0.01),
        rod("anodised", (0, 0.048, 0), 0.014, 0.072, axis="y", bevel=0.001),
        rod("abs", (0, -0.145, 0), 0.08, 0.05, axis="y"),
        *fins,
    ]


def _upper_arm() -> list[Piece]:
    return [
        rod("paint_white", (0, 0.066, 0), 0.098, 0.08, axis="y", bevel=0.012),
        rod("paint_orange", (0, 0.162, 0), 0.01, 0.058, axis="y"),
        *_bolts((0, 0.171, 0), "y", 0.046, 8),
        turned(
            "paint_white",
            [(0.05, 0.048), (0.075, 0.052), (0.12, 0.052), (0.13, 0.0505)],
            start=(0, SIDE, 0),
        ),
        turned(
            "aluminium",
            [(0.13, 0.049), (UPPER_ARM - 0.12, 0.046)],
            start=(0, SIDE, 0),
        ),
        turned(
            "paint_white",
            [(-0.13, 0.0475), (-0.12, 0.05), (-0.07, 0.05), (-0.045, 0.046)],
            start=(UPPER_ARM, SIDE, 0),
        ),
        rod("paint_white", (UPPER_ARM, 0.066, 0), 0.098, 0.07, axis="y", bevel=0.012),
        rod("paint_orange", (UPPER_ARM, 0.162, 0), 0.008, 0.052, axis="y"),
        *_bolts((UPPER_ARM, 0.169, 0), "y", 0.044, 8, size=0.004),
        rod("anodised", (UPPER_ARM, 0.168, 0), 0.05, 0.034, axis="y"),
        rod("anodised", (UPPER_ARM, 0.061, 0), 0.008, 0.06, axis="y", bevel=0.001),
    ]


def _forearm() -> list[Piece]:
    pieces = [
        rod("paint_white", (0, -0.058, 0), 0.117, 0.066, axis="y", bevel=0.01),
        rod("paint_orange", (0, -0.061, 0), 0.006, 0.048, axis="y", bevel=0.002),
        block("paint_white", (-0.06, 0, 0), (0.06, 0.104, 0.05), bevel=0.008),
        turned(
            "paint_white",
            [(0.045, 0.045), (0.11, 0.045), (0.13, 0.042)],
        ),
        turned("aluminium", [(0.13, 0.0405), (0.64, 0.034)]),
        rod("paint_orange", (0.632, 0, 0), 0.012, 0.0365, bevel=0.002),
        block("abs", (0.67, 0, 0), (0.06, 0.12, 0.043), bevel=0.006),
    ]
    for side in (1.0, -1.0):
        pieces += [
            rod("anodised", (-0.168, side * 0.028, 0), 0.09, 0.024),
            rod("abs", (-0.17, side * 0.028, 0), 0.012, 0.02),
            plate(
                "abs",
                # z x, from the centre of the plate: straight flanks, round end.
                [
                    (-0.017, -0.06),
                    (0.017, -0.06),
                    (0.017, 0.02),
                    *_arc((0.0, 0.06), 0.033, 0.0, 180.0, 13),
                    (-0.017, 0.02),
                ],
                normal="y",
                center=(FOREARM - 0.06, side * 0.053, 0),
                thickness=0.017,
            ),
            rod("steel", (FOREARM, side * 0.053 - 0.0095, 0), 0.019, 0.016, axis="y"),
        ]
    return pieces


def _wrist() -> list[Piece]:
    pieces = [
        rod("abs", (0, -0.016, 0), 0.032, 0.032, axis="y"),
        rod("abs", (0, 0, -0.036), 0.05, 0.022, axis="z"),
        turned("steel", [(-0.043, 0.0), (-0.043, 0.03), (-0.03, 0.016)], axis="z"),
    ]
    for side in (1.0, -1.0):
        cone = [(0.016, 0.014), (0.034, 0.031), (0.041, 0.028), (0.041, 0.0)]
        pieces.append(turned("steel", cone, axis=(0.0, side, 0.0)))
    return pieces


def _tool() -> list[Piece]:
    return [
        rod("anodised", (0, 0, -0.057), 0.013, 0.028, axis="z", bevel=0.002),
        block("paint_orange", (0.06, 0, -0.051), (0.1, 0.034, 0.01), bevel=0.004),
        block("paint_orange", (0.1, 0, -0.036), (0.018, 0.034, 0.03), bevel=0.004),
        block("anodised", (0.15, 0, 0.028), (0.016, 0.026, 0.014), bevel=0.003),
        block("anodised", (0.158, 0, 0.04), (0.02, 0.026, 0.014), bevel=0.003),
    ]


def _gun() -> list[Piece]:
    return [
        block("aluminium", (0.04, 0, 0), (0.078, 0.042, 0.044), bevel=0.005),
        block("paint_grey", (0.03, 0, 0), (0.03, 0.045, 0.0455), bevel=0.004),
        turned(
            "steel",
            [
                (0.078, 0.0),
                (0.078, 0.018),
                (0.11, 0.018),
                (0.12, 0.013),
                (0.135, 0.013),
            ],
        ),
        rod("anodised", (0.118, 0, 0), 0.016, 0.016, sides=6, bevel=0.001),
        turned(
            "brass",
            [(0.13, 0.011), (0.155, 0.011), (0.166, 0.005), (0.17, 0.004), (0.17, 0)],
        ),
        block("paint_orange", (0.152, 0, 0.0), (0.03, 0.012, 0.026), bevel=0.003),
        rod("brass", (0.03, 0.02, 0.0), 0.016, 0.007, axis="y", sides=6, bevel=0.001),
        hose(
            "hose",
            [
                (0.03, 0.034, 0.0),
                (0.027, 0.043, -0.004),
                (0.005, 0.043, -0.03),
                (-0.035, 0.025, -0.05),
                (-0.065, 0.008, -0.056),
            ],
            0.0055,
        ),
    ]


def _camera() -> list[Piece]:
    def pill(half: float, radius: float) -> Outline:
        flat = half - radius
        return _arc((flat, 0), radius, -90, 90, 9) + _arc(
            (-flat, 0), radius, 90, 270, 9
        )

    # The imagers look out of the front: left, right, projector and colour.
    places = {0.0175: 0.0042, -0.0325: 0.0042, -0.0115: 0.003, 0.0325: 0.0034}
    lenses = [
        rod("steel", (0.0243, y, 0), 0.0008, radius, bevel=2e-4, sides=20)
        for y, radius in places.items()
    ]
    return [
        plate(
            "aluminium",
            pill(0.045, 0.0125),
            normal="x",
            center=(0.0115, 0, 0),
            thickness=0.023,
        ),
        plate(
            "glass",
            pill(0.0425, 0.0105),
            normal="x",
            center=(0.0235, 0, 0),
            thickness=0.0018,
            bevel=4e-4,
        ),
        *lenses,
    ]


def _frame() -> list[Piece]:
    pieces = [
        block("paint_grey", (-0.3, 0, 0.15), (0.8, 0.5, 0.07), bevel=0.015),
        block("paint_white", (-0.38, 0, 0.222), (0.56, 0.46, 0.074), bevel=0.015),
        block("paint_white", (-0.55, 0, 0.5), (0.24, 0.4, 0.48), bevel=0.02),
        block("paint_orange", (-0.55, 0, 0.3), (0.246, 0.406, 0.02), bevel=0.021),
        block("abs", (-0.55, -0.201, 0.6), (0.16, 0.008, 0.2), bevel=0.002),
        block("glass", (-0.55, -0.204, 0.65), (0.12, 0.006, 0.07), bevel=0.001),
        rod("paint_orange", (-0.59, -0.203, 0.55), 0.016, 0.014, axis=(0, -1, 0)),
        rod("steel", (-0.51, -0.203, 0.55), 0.012, 0.012, axis=(0, -1, 0)),
        rod("steel", (-0.24, -0.14, 0.26), 0.2, 0.085, axis="z", bevel=0.01),
        rod("paint_orange", (-0.24, -0.14, 0.46), 0.03, 0.087, axis="z", bevel=0.006),
        rod("anodised", (-0.24, -0.14, 0.49), 0.08, 0.035, axis="z"),
        block("aluminium", (0, 0, 0.515), (0.08, 0.08, 0.67), bevel=0.006),
        rod("anodised", (0, 0, MAST_TOP - 0.015), 0.015, 0.085, axis="z"),
        hose(
            "hose",
            [
                (-0.24, -0.14, 0.57),
                (-0.23, -0.12, 0.66),
                (-0.14, -0.06, 0.62),
                (-0.07, -0.02, 0.66),
                (-0.05, 0, 0.76),
                (-0.075, 0, 0.9),
            ],
            0.008,
        ),
    ]
    for x in (-0.03, -0.57):
        for side in (1.0, -1.0):
            pieces += [
                rod("rubber", (x, side * 0.285 - 0.025, 0.065), 0.05, 0.065, axis="y"),
                rod("steel", (x, side * 0.285 - 0.028, 0.065), 0.056, 0.03, axis="y"),
            ]
    for side in (1.0, -1.0):
        pieces.append(
            plate(
                "paint_grey",
                [(-0.09, -0.09), (0.13, -0.09), (0.0, 0.13), (-0.09, 0.13)],
                normal="y",
                center=(-0.05, side * 0.044, 0.35),
                thickness=0.006,
            )
        )
    return pieces


LOOKS = {
    "base": _base,
    "shoulder": _shoulder,
    "upper_arm": _upper_arm,
    "forearm": _forearm,
    "wrist": _wrist,
    "tool": _tool,
    "gun": _gun,
    "camera": _camera,
    "frame": _frame,
}
