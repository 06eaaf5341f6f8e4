"""Recordings of `shared/data/real`: the words to segment them, and what is right.

What is right is from the recordings' README and `expected.json`. The words are those of
`painter segment`, as a user who knows the recording would give them.
"""

import dataclasses

Rectangle = tuple[float, float, float, float]  # Left, bottom, right, top.


@dataclasses.dataclass(frozen=True, kw_only=True)
class Case:
    """A recording and what is right.

    Attributes:
        name: File or folder.
        truth: What a correct result is, in words.
        distance: Of the wall's plane from the frame's origin, m; None = no wall.
        tolerance: Of that, m.
        words: Of `painter segment`; {data} is the recordings' folder.
        wall: Rectangles that are surely wall, in the README's wall frame (X right, Y
            up, from the foot of the perpendicular from the sensor).
        not_wall: Rectangles that surely are not.
        share: Least and most share of the points that may be in the wall's plane.
        least_filled: Least share of the seen cells that is wall ("all of it").
        table: Which of the point labels are wall, and least precision and recall.
    """

    name: str
    truth: str
    distance: float | None
    tolerance: float = 0.02
    words: tuple[str, ...] = ()
    wall: tuple[Rectangle, ...] = ()
    not_wall: tuple[Rectangle, ...] = ()
    share: tuple[float, float] = (0.0, 1.0)
    least_filled: float = 0.0
    labels: tuple[int, ...] = ()
    least: tuple[float, float] = (0.0, 0.0)


SCANS = "painting_robot_wall_scans"
ARM = "d415_on_robot_arm"
ROOM = "d435_room"
FACADE = ("--up=z", "--set-back=0.25")
TABLE = tuple(range(1, 10))
CASES = (
    Case(
        name=f"{SCANS}/02_protruding_wall.pcd",
        truth="lower wall alone; upper part, fixture, floor excluded",
        distance=1.840,
        words=("--up=-z",),
        wall=((-1.5, -1.6, 1.4, 0.35),),
        not_wall=((-1.5, 0.5, 1.4, 1.15),),
    ),
    Case(
        name=f"{SCANS}/03_wall_between_two_windows.pcd",
        truth="the strip alone",
        distance=0.997,
        words=("--up=-z",),
        wall=((-0.2, -1.65, 0.95, 0.5),),
        not_wall=((-0.55, -1.6, -0.3, 0.5), (1.25, -1.6, 1.75, 0.5)),
    ),
    Case(
        name=f"{SCANS}/05_wall_and_door.pcd",
        truth="one wall, though the scan sways; the box excluded",
        distance=1.510,
        words=("--up=-z", "--inlier-distance=0.08"),
        wall=((-0.2, -1.6, 1.0, 0.5),),
        not_wall=((-0.34, -1.1, -0.27, -0.8),),
    ),
    Case(
        name=f"{SCANS}/09_plain_wall.pcd",
        truth="nearly all below Y 1.05; no obstacle invented",
        distance=1.429,
        words=("--up=-z",),
        wall=((-1.1, -1.65, 0.8, 1.0),),
    ),
    Case(
        name=f"{SCANS}/10_wall_with_small_columns.pcd",
        truth="wall left of the column; both flanges excluded",
        distance=1.134,
        words=("--up=-z",),
        wall=((-0.8, -1.65, 0.45, 1.0),),
        not_wall=((0.52, -1.6, 0.63, 1.0), (0.87, -1.6, 0.91, 1.0)),
    ),
    Case(
        name="facade_laser_scans_labelled/building_1.ply",
        truth="wall class: precision and recall 0.85, mean of both façades 0.92",
        distance=93.109,
        tolerance=0.05,
        words=FACADE,
        labels=(0,),
        least=(0.85, 0.85),
    ),
    Case(
        name="facade_laser_scans_labelled/building_3.ply",
        truth="the same",
        distance=124.372,
        tolerance=0.05,
        words=FACADE,
        labels=(0,),
        least=(0.85, 0.85),
    ),
    Case(
        name="tabletop_objects_labelled/test0.pcd",
        truth="table: precision and recall 0.99",
        distance=0.586,
        labels=TABLE,
        least=(0.99, 0.99),
    ),
    Case(
        name="tabletop_objects_labelled/test50.pcd",
        truth="the same; a thin book",
        distance=0.587,
        labels=TABLE,
        least=(0.99, 0.99),
    ),
    *(
        Case(
            name=f"{ARM}/{scene}/depth_{view}.png",
            truth="one plane, all of it wall",
            distance=distance,
            words=(f"--intrinsics={{data}}/{ARM}/intrinsics.json",),
            least_filled=filled,
        )
        for scene, distance, filled in (
            ("table_0p50m", 0.504, 0.85),
            ("table_0p80m_empty", 0.796, 0.97),
            ("table_0p80m_cable", 0.796, 0.95),
        )
        for view in (0, 1)
    ),
    Case(
        name="d415_static_table",
        truth="table 79 % of the depth below 1 m",
        distance=0.631,
        words=("--max-range=1",),
        share=(0.70, 1.0),
    ),
    Case(
        name="d435_tabletop/data1_depth_0.png",
        truth="desk 76 % of the points; the toy excluded",
        distance=0.151,
        words=("--max-range=0.55",),
        share=(0.66, 0.86),
    ),
    Case(
        name=f"{ROOM}/wall_close_with_bag.ply",
        truth="wall 47 % of the points, not the floor",
        distance=0.990,
        words=("--up=y",),
        share=(0.40, 0.54),
    ),
    Case(
        name=f"{ROOM}/wall_with_open_doorway.ply",
        truth="back wall about 3 m away; the doorway not filled in",
        distance=2.95,
        tolerance=0.15,
        words=(
            "--up=y",
            "--distance=2.95",
            "--inlier-distance=0.06",
            "--set=segmentation.min_wall_share=0.05",
        ),
        # The rays that end 4 to 7 m away, through the wall's plane.
        not_wall=((0.6, -0.5, 1.0, 1.0),),
    ),
    Case(
        name=f"{ROOM}/room_corner.ply",
        truth="back wall 3.1 to 3.2 m away, not the floor",
        distance=3.15,
        tolerance=0.06,
        words=("--up=y", "--inlier-distance=0.06"),
    ),
    Case(
        name="realsense_floor_objects/one_cube.ply",
        truth="mat 91 % within 2 cm, 81 % within 1 cm; the cube excluded",
        distance=0.534,
        share=(0.76, 0.96),
    ),
    Case(
        name="d435_fused_map/room_map.pcd",
        truth="long wall at z = 1.93, smeared over 15 cm",
        distance=1.93,
        tolerance=0.075,
        words=("--up=-y",),
        share=(0.10, 0.30),
    ),
    Case(
        name="rgbd_sequence_with_poses",
        truth="cupboard fronts 40 % of the points; table and chairs before them",
        distance=2.867,
        share=(0.30, 0.50),
    ),
    *(
        Case(
            name=f"kinect_office_views/capture000{view}.pcd",
            truth=f"wall {share:.0%} of the points",
            distance=distance,
            share=(share - 0.05, share + 0.05),
        )
        for view, distance, share in ((1, 2.45, 0.35), (3, 2.52, 0.30), (5, 2.61, 0.22))
    ),
    Case(name="depth_camera_box/caixa.ply", truth="no wall", distance=None),
    Case(
        name="d435i_no_wall/plants_day_depth.png",
        truth="no wall",
        distance=None,
        words=("--intrinsics=guessed_intrinsics.json",),
    ),
)
