"""Gun-off motions of the cycle: home, first look, scan, retract."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform
from pydrake.planning import CollisionChecker

from painter.errors import CollisionError
from painter.planning.arm.kinematics import ArmKinematics, ArmLimits
from painter.planning.arm.scan_camera import ScanCamera
from painter.planning.clearance.obstacles import ClearSpace, wall_box
from painter.planning.config import (
    MotionConfig,
    RasterConfig,
    ScanConfig,
    TileConfig,
)
from painter.planning.motion.gun_path import WallIk
from painter.planning.motion.joint_motion import Segment, chain, planning_limits
from painter.planning.motion.reach import require_reach, tile_points
from painter.planning.motion.transitions import TransitionPlanner
from painter.planning.motion.verify import verify_motion
from painter.planning.scan.camera_poses import CameraPoses
from painter.planning.scan.first_look import look_segments
from painter.planning.scan.more_looks import more_looks
from painter.planning.scan.scan_path import check_scan, scan_segments
from painter.planning.spray_path import Motion
from perception.fine_steps.shadows import Relief
from perception.ground import FloatArray

GOALS = ("home", "look", "scan", "retract")


@dataclass(frozen=True, eq=False)
class FreeMotionPlanner:
    """Plans motions with the gun closed for one robot with one set of settings.

    Attributes:
        kinematics: Of the arm.
        limits: Of its joints.
        checker: Of the robot's cell: arm, frame and floor.
        tile: Size of the tile and its expected pose.
        scan: Settings of first look, scan and more looks.
        motion: Settings of the motion.
        camera: On the tool.
        standoff: Of the gun when it paints, m.
        time_limit: Of the whole cycle, s.
    """

    kinematics: ArmKinematics
    limits: ArmLimits
    checker: CollisionChecker
    tile: TileConfig
    scan: ScanConfig
    motion: MotionConfig
    camera: ScanCamera
    standoff: float = RasterConfig.standoff
    time_limit: float = math.inf

    def plan(self, goal: str, q0: FloatArray, X_WT: RigidTransform) -> Motion:
        """Plans a motion of the cycle.

        Until the wall has been scanned the arm keeps `motion.wall_keepout` and the
        clearance from it. "look" and "scan" first check the scan's settings against the
        camera, and that the gun reaches the whole tile, so that a job that cannot be
        done ends at once.

        Args:
            goal: "home" or "retract": to the home pose; "look": over two quarters of
                the tile; "scan": along rows over the tile.
            q0: (5,) rad, start, at rest.
            X_WT: Tile frame T in W, as expected or as found.

        Returns:
            The motion, verified.

        Raises:
            ValueError: There is no such goal.
            InputError: The camera cannot scan the tile with these settings.
            ReachError: The tile, or the wall, is out of the arm's reach.
            CollisionError: There is no clear route.
            MotionLimitError: The finished motion fails its verification.
        """
        if goal not in GOALS:
            raise ValueError(f"goal must be one of {', '.join(GOALS)}, got {goal!r}.")
        tile = self.tile
        if goal in ("look", "scan"):
            points = tile_points(tile.width, tile.height, self.standoff)
            what = f"tile of {tile.width:.2f} x {tile.height:.2f} m"
            ik = WallIk(self.kinematics, X_WT)
            require_reach(points, ik=ik, limits=self.limits, what=what)
            check_scan(tile, self.scan, self.camera, time_limit=self.time_limit)
        # After painting or a stop the gun may be within the keepout.
        keepouts = (0.0,) if goal == "retract" else (self.motion.wall_keepout, 0.0)
        transitions = self._transition_planner(q0, X_WT, keepouts)
        path: Sequence[Segment]
        poses = CameraPoses(self.camera, transitions)
        if goal == "scan":
            path = scan_segments(q0, tile, self.scan, poses, time_limit=self.time_limit)
        elif goal == "look":
            path = look_segments(q0, tile, self.scan, poses)
        else:
            path = transitions.free_motion(q0, transitions.q_home)
        return self._verified(path, transitions.space, what=f"motion {goal!r}")

    def more_looks(
        self, q0: FloatArray, relief: Relief, X_WT: RigidTransform
    ) -> Motion | None:
        """Plans looks at wall that the scan left in shadow.

        The arm keeps the clearance from the highest object that the scan found, and at
        least as much from the wall as in the scan.

        Args:
            q0: (5,) rad, start, at rest.
            relief: What the scan has found.
            X_WT: Tile frame T in W, as found.

        Returns:
            The motion, verified; None if nothing is worth a look, or if the arm is
            nearer to the wall than the highest object on it.

        Raises:
            MotionLimitError: The finished motion fails its verification.
            CollisionError: The same, for its clearance.
        """
        if not relief.hidden.any():
            return None
        keepout = max(self.motion.wall_keepout, float(relief.height.max()))
        try:
            transitions = self._transition_planner(q0, X_WT, (keepout,))
        except CollisionError:
            return None
        poses = CameraPoses(self.camera, transitions)
        path = more_looks(q0, relief, self.scan, poses)
        if not path:
            return None
        return self._verified(path, transitions.space, what="motion 'more looks'")

    def _transition_planner(
        self, q0: FloatArray, X_WT: RigidTransform, keepouts: Sequence[float]
    ) -> TransitionPlanner:
        """Returns a planner with the largest keep-out that excludes the arm."""
        motion = self.motion
        for keepout in keepouts:
            space = ClearSpace(
                self.checker,
                X_WT=X_WT,
                boxes=[wall_box(self.tile.width, self.tile.height, keepout=keepout)],
                clearance=motion.clearance,
                floor_clearance=motion.floor_clearance,
            )
            if space.all_free(q0[None]):
                return TransitionPlanner(
                    ik=WallIk(self.kinematics, X_WT),
                    limits=planning_limits(self.limits, motion.limit_share),
                    space=space,
                    q_home=np.deg2rad(motion.home_deg),
                )
        raise CollisionError(
            f"the arm starts in collision: {space.worst_pair(q0)}.",
            code="PNT-SCAN-001",
        )

    def _verified(
        self, path: Sequence[Segment], space: ClearSpace, *, what: str
    ) -> Motion:
        """Chains the segments and verifies the result."""
        planned = chain(path, period=self.motion.sample_period)
        verify_motion(
            planned,
            kinematics=self.kinematics,
            limits=self.limits,
            limit_share=self.motion.limit_share,
            space=space,
            what=what,
        )
        return planned
