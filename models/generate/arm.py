"""The arm: five driven joints from the yaw drive to the tool bracket.

Every figure here is explained in models/arm/README.md.
"""

from painter_models.generate.solids import Box, Cylinder, Part
from painter_models.generate.urdf import Joint, Link, Model

BASE_HEIGHT = 0.18  # Mounting face to the top of the yaw drive.
SHOULDER_HEIGHT = 0.16  # From there to the shoulder axis.
UPPER_ARM = 0.76
FOREARM = 0.81
# The upper arm runs beside the forearm, so that the elbow folds almost flat.
SIDE = 0.115

BASE = Link(
    name="base",
    parts=[
        Part(
            "housing",
            Cylinder(
                center=(0, 0, 0.09), axis="z", radius=0.085, length=0.18, bore=0.055
            ),
            7.2,
        ),
        Part(
            "harmonic drive, size 32",
            Cylinder(center=(0, 0, 0.14), axis="z", radius=0.055, length=0.06),
            3.2,
        ),
        Part(
            "servo motor, 400 W",
            Cylinder(center=(0, 0, 0.055), axis="z", radius=0.03, length=0.1),
            1.6,
        ),
    ],
    collisions=[Cylinder(center=(0, 0, 0.09), axis="z", radius=0.085, length=0.18)],
)
SHOULDER = Link(
    name="shoulder",
    parts=[
        Part(
            "yoke",
            Cylinder(center=(0, 0, -0.085), axis="z", radius=0.075, length=0.15),
            4.0,
        ),
        Part(
            "housing",
            Cylinder(
                center=(0, -0.01, 0), axis="y", radius=0.085, length=0.13, bore=0.06
            ),
            2.1,
        ),
        Part(
            "harmonic drive, size 40",
            Cylinder(center=(0, 0.02, 0), axis="y", radius=0.06, length=0.07),
            5.0,
        ),
        Part(
            "servo motor, 750 W",
            Cylinder(center=(0, -0.08, 0), axis="y", radius=0.04, length=0.13),
            2.9,
        ),
    ],
    collisions=[
        Cylinder(center=(0, 0, -0.085), axis="z", radius=0.075, length=0.15),
        Cylinder(center=(0, -0.045, 0), axis="y", radius=0.085, length=0.2),
    ],
)
UPPER_ARM_LINK = Link(
    name="upper_arm",
    parts=[
        Part(
            "shoulder hub",
            Cylinder(center=(0, SIDE, 0), axis="y", radius=0.08, length=0.1, bore=0.04),
            2.6,
        ),
        Part(
            "tube, 100 x 4 mm",
            Cylinder(
                center=(UPPER_ARM / 2, SIDE, 0),
                axis="x",
                radius=0.05,
                length=0.62,
                bore=0.046,
            ),
            2.2,
        ),
        Part(
            "elbow hub",
            Cylinder(
                center=(UPPER_ARM, SIDE, 0),
                axis="y",
                radius=0.07,
                length=0.1,
                bore=0.045,
            ),
            2.4,
        ),
        Part(
            "harmonic drive, size 32",
            Cylinder(
                center=(UPPER_ARM, SIDE - 0.02, 0), axis="y", radius=0.055, length=0.06
            ),
            3.2,
        ),
        Part(
            "servo motor, 400 W",
            Cylinder(
                center=(UPPER_ARM, SIDE + 0.04, 0), axis="y", radius=0.03, length=0.1
            ),
            1.6,
        ),
        Part(
            "cables and half of the paint hose",
            Cylinder(
                center=(UPPER_ARM / 2, SIDE, 0), axis="x", radius=0.02, length=0.6
            ),
            0.5,
        ),
    ],
    collisions=[
        Cylinder(center=(0, SIDE + 0.005, 0), axis="y", radius=0.08, length=0.11),
        Cylinder(center=(UPPER_ARM / 2, SIDE, 0), axis="x", radius=0.052, length=0.7),
        Cylinder(
            center=(UPPER_ARM, SIDE + 0.005, 0), axis="y", radius=0.07, length=0.11
        ),
        Cylinder(
            center=(UPPER_ARM, SIDE + 0.08, 0), axis="y", radius=0.035, length=0.05
        ),
    ],
)
FOREARM_LINK = Link(
    name="forearm",
    parts=[
        Part(
            "elbow hub",
            Cylinder(center=(0, 0, 0), axis="y", radius=0.065, length=0.12, bore=0.035),
            2.1,
        ),
        Part(
            "left wrist motor and planetary gearbox",
            Cylinder(center=(-0.09, 0.028, 0), axis="x", radius=0.022, length=0.14),
            1.2,
        ),
        Part(
            "right wrist motor and planetary gearbox",
            Cylinder(center=(-0.09, -0.028, 0), axis="x", radius=0.022, length=0.14),
            1.2,
        ),
        Part(
            "tapered tube, 90 to 68 mm, 3 mm wall",
            Cylinder(
                center=(0.38, 0, 0), axis="x", radius=0.04, length=0.66, bore=0.037
            ),
            1.6,
        ),
        Part("fork", Box(center=(0.745, 0, 0), size=(0.15, 0.12, 0.03)), 1.3),
        Part(
            "cables, drive shafts and half of the paint hose",
            Cylinder(center=(0.38, 0, 0), axis="x", radius=0.02, length=0.7),
            0.6,
        ),
    ],
    collisions=[
        Cylinder(center=(0, 0, 0), axis="y", radius=0.067, length=0.122),
        Box(center=(-0.1, 0, 0), size=(0.14, 0.108, 0.054)),
        Cylinder(center=(0.22, 0, 0), axis="x", radius=0.046, length=0.36),
        Cylinder(center=(0.535, 0, 0), axis="x", radius=0.038, length=0.27),
        Box(center=(0.682, 0, 0), size=(0.036, 0.124, 0.044)),
        Box(center=(0.755, 0.053, 0), size=(0.11, 0.018, 0.034)),
        Box(center=(0.755, -0.053, 0), size=(0.11, 0.018, 0.034)),
        Cylinder(center=(FOREARM, 0.053, 0), axis="y", radius=0.034, length=0.018),
        Cylinder(center=(FOREARM, -0.053, 0), axis="y", radius=0.034, length=0.018),
    ],
)
WRIST = Link(
    name="wrist",
    parts=[
        Part(
            "ABS carrier",
            Cylinder(center=(0, 0, 0), axis="y", radius=0.032, length=0.08),
            0.5,
        ),
        Part(
            "bevel gears and bearings",
            Cylinder(center=(0, 0, -0.01), axis="z", radius=0.028, length=0.06),
            0.7,
        ),
    ],
    collisions=[Cylinder(center=(0, 0, 0), axis="y", radius=0.034, length=0.084)],
)
TOOL = Link(
    name="tool",
    parts=[
        Part(
            "yaw flange",
            Cylinder(center=(0, 0, -0.051), axis="z", radius=0.028, length=0.014),
            0.2,
        ),
        Part("bracket", Box(center=(0.06, 0, -0.048), size=(0.1, 0.034, 0.014)), 0.3),
        Part(
            "camera post", Box(center=(0.152, 0, 0.034), size=(0.03, 0.026, 0.026)), 0.2
        ),
    ],
    collisions=[
        Cylinder(center=(0, 0, -0.051), axis="z", radius=0.028, length=0.014),
        Box(center=(0.055, 0, -0.051), size=(0.11, 0.036, 0.014)),
        Box(center=(0.098, 0, -0.034), size=(0.024, 0.036, 0.024)),
        Box(center=(0.152, 0, 0.034), size=(0.032, 0.028, 0.028)),
    ],
)

# Rotor and brake, plus the wave generator or gearbox input, kg m².
_ROTOR_400W = 0.30e-4 + 1.69e-4
_ROTOR_750W = 1.06e-4 + 4.50e-4
_ROTOR_100W = 0.051e-4 + 0.02e-4

MODEL = Model(
    folder="arm",
    links=[BASE, SHOULDER, UPPER_ARM_LINK, FOREARM_LINK, WRIST, TOOL],
    joints=[
        Joint(
            name="base_yaw",
            parent="base",
            child="shoulder",
            xyz=(0.0, 0.0, BASE_HEIGHT + SHOULDER_HEIGHT),
            axis="z",
            lower=-2.9,
            upper=2.9,
            velocity=2.0,
            acceleration=5.0,
            effort=286.0,
            gear_ratio=100.0,
            rotor_inertia=_ROTOR_400W,
            damping=12.0,
        ),
        Joint(
            name="shoulder_pitch",
            parent="shoulder",
            child="upper_arm",
            xyz=(0.0, 0.0, 0.0),
            axis="y",
            lower=-2.9,
            upper=1.5,
            velocity=2.0,
            acceleration=5.0,
            effort=841.0,
            gear_ratio=160.0,
            rotor_inertia=_ROTOR_750W,
            damping=25.0,
        ),
        Joint(
            name="elbow_pitch",
            parent="upper_arm",
            child="forearm",
            xyz=(UPPER_ARM, 0.0, 0.0),
            axis="y",
            lower=-0.3,
            upper=3.02,
            velocity=2.5,
            acceleration=8.0,
            effort=286.0,
            gear_ratio=100.0,
            rotor_inertia=_ROTOR_400W,
            damping=12.0,
        ),
        Joint(
            name="wrist_pitch",
            parent="forearm",
            child="wrist",
            xyz=(FOREARM, 0.0, 0.0),
            axis="y",
            lower=-2.75,
            upper=1.6,
            velocity=3.5,
            acceleration=15.0,
            effort=24.0,
            gear_ratio=40.0,
            rotor_inertia=2 * _ROTOR_100W,
            damping=0.5,
        ),
        Joint(
            name="wrist_yaw",
            parent="wrist",
            child="tool",
            xyz=(0.0, 0.0, 0.0),
            axis="z",
            lower=-1.7,
            upper=1.7,
            velocity=3.5,
            acceleration=15.0,
            effort=12.0,
            gear_ratio=40.0,
            rotor_inertia=2 * _ROTOR_100W,
            damping=0.5,
        ),
    ],
)
