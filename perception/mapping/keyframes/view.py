"""The large data of a keyframe: mean depths, corners, thinned pixels."""

import io
import zlib
from dataclasses import dataclass, field
from typing import Self

import cv2
import numpy as np
import numpy.typing as npt

from perception.depth_camera.depth import CameraIntrinsics
from perception.ground import BoolArray, FloatArray, FrozenValue
from perception.io.frames import ColorImage, DepthImage


@dataclass(frozen=True, eq=False)
class Features(FrozenValue):
    """Corners with depth.

    Attributes:
        uv: (n, 2) px, column and row.
        p_Cs: (n, 3) m, in C.
        descriptors: (n, 32) uint8, ORB's.
    """

    uv: FloatArray
    p_Cs: FloatArray
    descriptors: npt.NDArray[np.uint8]

    @classmethod
    def none(cls) -> Self:
        """Makes an empty set."""
        return cls(np.zeros((0, 2)), np.zeros((0, 3)), np.zeros((0, 32), np.uint8))


@dataclass(frozen=True, eq=False)
class ThinPicture(FrozenValue):
    """Every `stride`-th pixel and row of a picture, compressed.

    Attributes:
        stride: Of the pixels kept.
        shape: (h, w) of what is kept.
        depth: Usable depth, uint16, mm, 0 = none; zlib.
        color: Its colours, JPEG; None = not kept.
    """

    stride: int
    shape: tuple[int, int]
    depth: bytes
    color: bytes | None = None

    @classmethod
    def of(
        cls,
        depth_mm: DepthImage,
        usable: BoolArray,
        stride: int,
        color: ColorImage | None = None,
    ) -> Self:
        """Packs a picture.

        Args:
            depth_mm: (H, W) uint16, mm.
            usable: (H, W) bool, the pixels whose depth is kept.
            stride: Every so many-th pixel and row is kept.
            color: (H, W, 3) uint8, RGB; None = not kept.
        """
        thin = np.s_[::stride, ::stride]
        kept = np.where(usable[thin], depth_mm[thin], np.uint16(0))
        jpeg = None
        if color is not None:
            _, data = cv2.imencode(".jpg", color[thin][:, :, ::-1])
            jpeg = data.tobytes()
        shape = (kept.shape[0], kept.shape[1])
        return cls(stride, shape, zlib.compress(kept.tobytes(), 1), jpeg)

    def camera(self, intrinsics: CameraIntrinsics) -> CameraIntrinsics:
        """Returns the intrinsics of the thinned picture.

        Args:
            intrinsics: Of the full picture.
        """
        return CameraIntrinsics(
            fx=intrinsics.fx / self.stride,
            fy=intrinsics.fy / self.stride,
            cx=intrinsics.cx / self.stride,
            cy=intrinsics.cy / self.stride,
            width=self.shape[1],
            height=self.shape[0],
        )

    @property
    def depth_mm(self) -> DepthImage:
        """Unpacks (h, w) uint16, mm, 0 = none."""
        return np.frombuffer(zlib.decompress(self.depth), np.uint16).reshape(self.shape)

    @property
    def colors(self) -> ColorImage:
        """Unpacks (h, w, 3) uint8, RGB; black if none were kept."""
        if self.color is None:
            return np.zeros((*self.shape, 3), np.uint8)
        image = cv2.imdecode(np.frombuffer(self.color, np.uint8), cv2.IMREAD_COLOR)
        return np.asarray(image)[:, :, ::-1].astype(np.uint8)


@dataclass(frozen=True, eq=False)
class View(FrozenValue):
    """The large data of a keyframe.

    Attributes:
        z: (h, w) float32, m, mean depth of blocks of pixels, 0 = none.
        features: Corners.
        picture: Pixels for the fusion; None = kept elsewhere.
    """

    z: npt.NDArray[np.float32]
    features: Features = field(default_factory=Features.none)
    picture: ThinPicture | None = None

    def view(self) -> Self:
        """Returns itself."""
        return self

    def packed(self) -> bytes:
        """Returns the view as bytes of an NPZ file."""
        arrays: dict[str, npt.ArrayLike] = {"z": self.z, **vars(self.features)}
        if self.picture is not None:
            arrays["stride"] = self.picture.stride
            arrays["shape"] = self.picture.shape
            arrays["depth"] = np.frombuffer(self.picture.depth, np.uint8)
            if self.picture.color is not None:
                arrays["color"] = np.frombuffer(self.picture.color, np.uint8)
        file = io.BytesIO()
        np.savez(file, **arrays)  # type: ignore[arg-type]
        return file.getvalue()

    @classmethod
    def unpacked(cls, data: bytes) -> Self:
        """Returns the view from the bytes of `packed`."""
        with np.load(io.BytesIO(data)) as arrays:
            picture = None
            if "depth" in arrays:
                height, width = arrays["shape"].tolist()
                picture = ThinPicture(
                    stride=int(arrays["stride"]),
                    shape=(height, width),
                    depth=arrays["depth"].tobytes(),
                    color=arrays["color"].tobytes() if "color" in arrays else None,
                )
            features = Features(arrays["uv"], arrays["p_Cs"], arrays["descriptors"])
            return cls(arrays["z"], features, picture)
