"""What the arm carries and stands on: gun, camera and frame.

Every figure here is explained in the README of the model's folder.
"""

import math

from painter_models.generate.solids import Box, Cylinder, Part
from painter_models.generate.urdf import FixedFrame, Link, Model

# Turns a frame whose x looks ahead and z up into one whose z looks ahead, y down.
OPTICAL_RPY = (-math.pi / 2, 0.0, -math.pi / 2)

NOZZLE = 0.17  # Rear face of the gun's block to the tip's orifice.

GUN = Model(
    folder="gun",
    links=[
        Link(
            name="gun",
            parts=[
                Part(
                    "block", Box(center=(0.04, 0, 0), size=(0.08, 0.044, 0.044)), 0.75
                ),
                Part(
                    "needle housing and air cylinder",
                    Cylinder(center=(0.105, 0, 0), axis="x", radius=0.018, length=0.05),
                    0.2,
                ),
                Part(
                    "tip and guard",
                    Cylinder(center=(0.15, 0, 0), axis="x", radius=0.014, length=0.04),
                    0.15,
                ),
            ],
            collisions=[
                Box(center=(0.04, 0, 0), size=(0.08, 0.046, 0.046)),
                Cylinder(center=(0.105, 0, 0), axis="x", radius=0.019, length=0.05),
                Cylinder(center=(0.15, 0, 0), axis="x", radius=0.014, length=0.04),
            ],
        )
    ],
    frames=[
        FixedFrame(
            name="gun_nozzle", link="gun", xyz=(NOZZLE, 0.0, 0.0), rpy=OPTICAL_RPY
        )
    ],
)

# The camera's link is its body: x ahead, z up, origin in the middle of the back.
CAMERA_DEPTH = 0.025
LEFT_IMAGER = 0.0175

CAMERA = Model(
    folder="camera",
    links=[
        Link(
            name="camera",
            parts=[
                Part(
                    "body",
                    Box(center=(CAMERA_DEPTH / 2, 0, 0), size=(0.025, 0.09, 0.025)),
                    0.072,
                )
            ],
            collisions=[
                Box(center=(CAMERA_DEPTH / 2, 0, 0), size=(0.025, 0.09, 0.025))
            ],
        )
    ],
    frames=[
        FixedFrame(
            name="camera_depth",
            link="camera",
            xyz=(CAMERA_DEPTH + 0.001, LEFT_IMAGER, 0.0),
            rpy=OPTICAL_RPY,
        )
    ],
)

MAST_TOP = 0.86

FRAME = Model(
    folder="frame",
    links=[
        Link(
            name="frame",
            parts=[
                Part(
                    "base, counterweight and paint pump",
                    Box(center=(-0.3, 0, 0.16), size=(0.8, 0.64, 0.2)),
                    150.0,
                ),
                Part(
                    "mast",
                    Box(center=(0, 0, 0.55), size=(0.08, 0.08, 0.62)),
                    14.0,
                ),
            ],
            collisions=[
                Box(center=(-0.3, 0, 0.13), size=(0.8, 0.64, 0.26)),
                Box(center=(-0.55, 0, 0.5), size=(0.26, 0.4, 0.48)),
                Cylinder(
                    center=(-0.24, -0.14, 0.415), axis="z", radius=0.088, length=0.31
                ),
                Box(center=(0, 0, 0.56), size=(0.08, 0.08, 0.6)),
            ],
        )
    ],
    frames=[FixedFrame(name="arm_mount", link="frame", xyz=(0.0, 0.0, MAST_TOP))],
)
