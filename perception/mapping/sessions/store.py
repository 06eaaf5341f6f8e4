"""A mapping session in one SQLite file, to be resumed or mapped again.

Every keyframe is one transaction with its raw pictures, poses and constraints, so a
process that is killed loses no finished keyframe.
"""

import dataclasses
import json
import sqlite3
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Self

import cv2
import numpy as np
import numpy.typing as npt
from pydrake.math import RigidTransform, RotationMatrix

from perception.depth_camera.depth import CameraIntrinsics
from perception.errors import CloudReadError
from perception.io.frames import Frame
from perception.mapping.config import MapperConfig
from perception.mapping.pose_graph.constraints import ConstraintKind, PoseConstraint

SCHEMA = """
CREATE TABLE IF NOT EXISTS info (key TEXT PRIMARY KEY, value TEXT NOT NULL);
CREATE TABLE IF NOT EXISTS keyframes (
    k INTEGER PRIMARY KEY, number INTEGER, time REAL, depth BLOB, color BLOB,
    arm BLOB, pose BLOB);
CREATE TABLE IF NOT EXISTS links (
    i INTEGER, j INTEGER, kind TEXT, inliers INTEGER, pose BLOB, information BLOB);
CREATE TABLE IF NOT EXISTS frames (
    number INTEGER PRIMARY KEY, time REAL, outcome TEXT, k INTEGER, pose BLOB);
CREATE TABLE IF NOT EXISTS statistics (k INTEGER PRIMARY KEY, seconds REAL);
"""


class MapStore:
    """One session's file; a context manager."""

    def __init__(self, path: Path) -> None:
        """Opens the file; makes it if there is none.

        Args:
            path: The file.

        Raises:
            CloudReadError: It cannot be opened or is not an SQLite file.
        """
        self.path = path
        try:
            self._db = sqlite3.connect(path)
            self._db.execute("PRAGMA journal_mode=WAL")
            self._db.execute("PRAGMA synchronous=NORMAL")
            self._db.executescript(SCHEMA)
        except sqlite3.Error as error:
            raise CloudReadError(
                f"{path}: is not a map file: {error}.", code="PNT-MAP-005"
            ) from error

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()

    def close(self) -> None:
        """Closes the file."""
        self._db.close()

    def start(self, intrinsics: CameraIntrinsics, config: MapperConfig) -> None:
        """Stores camera and settings.

        Raises:
            CloudReadError: The file is of another camera.
        """
        known = self.intrinsics
        if known is not None and known != intrinsics:
            raise CloudReadError(
                f"{self.path}: was made with another camera, {known}, "
                f"not {intrinsics}; give the session a file of its own.",
                code="PNT-MAP-006",
            )
        with self._db:
            for key, value in (("camera", intrinsics), ("config", config)):
                self._db.execute(
                    "INSERT OR REPLACE INTO info VALUES (?, ?)",
                    (key, json.dumps(dataclasses.asdict(value))),
                )

    @property
    def intrinsics(self) -> CameraIntrinsics | None:
        """The camera; None in a new file."""
        camera = self._info("camera")
        return None if camera is None else CameraIntrinsics(**camera)

    @property
    def config(self) -> MapperConfig | None:
        """The settings of the last session; None in a new file."""
        config = self._info("config")
        return None if config is None else MapperConfig(**config)

    def save_keyframe(
        self,
        k: int,
        number: int,
        frame: Frame,
        X_WC: RigidTransform,
        constraints: list[PoseConstraint],
    ) -> None:
        """Stores a keyframe with its pictures and its constraints to older ones."""
        with self._db:
            self._db.execute(
                "INSERT OR REPLACE INTO keyframes VALUES (?, ?, ?, ?, ?, ?, ?)",
                (
                    k,
                    number,
                    frame.time,
                    _png(frame.depth_mm),
                    _png(frame.color[:, :, ::-1]),
                    None if frame.X_WC is None else _bytes(frame.X_WC),
                    _bytes(X_WC),
                ),
            )
            self._db.execute("DELETE FROM links WHERE j = ?", (k,))
            self._db.executemany(
                "INSERT INTO links VALUES (?, ?, ?, ?, ?, ?)",
                [
                    (
                        constraint.i,
                        constraint.j,
                        str(constraint.kind),
                        constraint.inliers,
                        _bytes(constraint.X_ij),
                        constraint.information.tobytes(),
                    )
                    for constraint in constraints
                ],
            )

    def save_frame(
        self,
        number: int,
        time: float,
        outcome: str,
        placed: tuple[int, RigidTransform] | None,
    ) -> None:
        """Stores a frame's outcome, and last keyframe and X_KC if it has a pose."""
        k, pose = (None, None) if placed is None else (placed[0], _bytes(placed[1]))
        with self._db:
            self._db.execute(
                "INSERT OR REPLACE INTO frames VALUES (?, ?, ?, ?, ?)",
                (number, time, outcome, k, pose),
            )

    def frames(self) -> Iterator[tuple[int, float, str, int | None, RigidTransform]]:
        """Reads the frames' number, time, outcome, last keyframe and X_KC."""
        rows = self._db.execute(
            "SELECT number, time, outcome, k, pose FROM frames ORDER BY number"
        )
        for number, time, outcome, k, pose in rows:
            X_KC = RigidTransform() if pose is None else _pose(pose)
            yield number, time, outcome, k, X_KC

    def save_answer(
        self, poses: Sequence[RigidTransform], seconds: Sequence[float]
    ) -> None:
        """Stores the optimised poses and the CPU time of the keyframes."""
        with self._db:
            self._db.executemany(
                "UPDATE keyframes SET pose = ? WHERE k = ?",
                [(_bytes(X), k) for k, X in enumerate(poses)],
            )
            self._db.executemany(
                "INSERT OR REPLACE INTO statistics VALUES (?, ?)",
                list(enumerate(seconds)),
            )

    def keyframes(
        self,
    ) -> Iterator[tuple[int, Frame, RigidTransform, list[PoseConstraint]]]:
        """Reads the keyframes: frame number, frame, X_WC and constraints."""
        rows = self._db.execute(
            "SELECT k, number, time, depth, color, arm, pose FROM keyframes ORDER BY k"
        )
        for k, number, time, depth, color, arm, pose in rows:
            frame = Frame(
                time=time,
                depth_mm=_picture(depth, cv2.IMREAD_UNCHANGED).astype(np.uint16),
                color=_picture(color, cv2.IMREAD_COLOR)[:, :, ::-1].copy(),
                X_WC=None if arm is None else _pose(arm),
            )
            yield number, frame, _pose(pose), self._links(k)

    def __len__(self) -> int:
        (count,) = self._db.execute("SELECT COUNT(*) FROM keyframes").fetchone()
        return int(count)

    def _links(self, j: int) -> list[PoseConstraint]:
        rows = self._db.execute(
            "SELECT i, kind, inliers, pose, information FROM links WHERE j = ?", (j,)
        )
        return [
            PoseConstraint(
                i=i,
                j=j,
                kind=ConstraintKind(kind),
                X_ij=_pose(pose),
                information=np.frombuffer(information).reshape(6, 6).copy(),
                inliers=inliers,
            )
            for i, kind, inliers, pose, information in rows
        ]

    def _info(self, key: str) -> dict[str, Any] | None:
        row = self._db.execute(
            "SELECT value FROM info WHERE key = ?", (key,)
        ).fetchone()
        return None if row is None else json.loads(row[0])


def _bytes(X: RigidTransform) -> bytes:
    return bytes(np.ascontiguousarray(X.GetAsMatrix34()).tobytes())


def _pose(data: bytes) -> RigidTransform:
    matrix = np.frombuffer(data).reshape(3, 4)
    R = RotationMatrix.ProjectToRotationMatrix(matrix[:, :3])
    return RigidTransform(R, matrix[:, 3])


def _png(image: npt.NDArray[Any]) -> bytes:
    # The fastest setting: half the time for a tenth more bytes.
    _, data = cv2.imencode(".png", image, [cv2.IMWRITE_PNG_COMPRESSION, 1])
    return data.tobytes()


def _picture(data: bytes, mode: int) -> npt.NDArray[Any]:
    image = cv2.imdecode(np.frombuffer(data, np.uint8), mode)
    if image is None:
        raise CloudReadError(
            "a picture in the map file is damaged; map the recording again.",
            code="PNT-MAP-007",
        )
    return np.asarray(image)
