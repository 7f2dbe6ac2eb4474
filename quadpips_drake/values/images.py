"""Images that travel between the stages of perception."""

from dataclasses import dataclass, field

import numpy as np

from quadpips_drake.values.immutable import ImmutableValue
from quadpips_drake.values.sensing import CameraIntrinsics


@dataclass(frozen=True, eq=False)
class AffordanceImage(ImmutableValue):
    """Depth, normals and steppability per pixel of one camera (QuadPiPS section V-C), with the camera's pose."""

    stamp: float
    """Time of exposure [s]."""
    X_WC: np.ndarray
    """Pose of the optical frame C in the world at that time, (4, 4)."""
    intrinsics: CameraIntrinsics
    depth: np.ndarray
    """Distance along the optical axis [m], float32 (height, width); NaN where there is none."""
    normals: np.ndarray
    """Unit normals in C, float32 (height, width, 3), pointing towards the camera; NaN where there is none."""
    labels: np.ndarray
    """Steppability, uint8 (height, width)."""

    @staticmethod
    def empty() -> "AffordanceImage":
        """Returns an image without a single pixel."""
        return AffordanceImage(
            stamp=-np.inf,
            X_WC=np.eye(4),
            intrinsics=CameraIntrinsics(width=0, height=0, fx=1.0, fy=1.0, cx=0.0, cy=0.0),
            depth=np.zeros((0, 0), np.float32),
            normals=np.zeros((0, 0, 3), np.float32),
            labels=np.zeros((0, 0), np.uint8),
        )


@dataclass(frozen=True, eq=False)
class LabelImage(ImmutableValue):
    """Steppability per pixel of one camera (QuadPiPS section V-B)."""

    stamp: float
    """Time of exposure of the depth image that was labelled [s]."""
    labels: np.ndarray
    """Values of values.steppability.Steppability, uint8 (height, width)."""
    depth: np.ndarray | None = None
    """The depth image that was labelled [m], float32 (height, width); None if it is not at hand."""
    X_WC: np.ndarray | None = None
    """Pose of the optical frame C in the world at that time, (4, 4); None if it is not at hand."""
    intrinsics: CameraIntrinsics | None = None
    """Of the camera; None if they are not at hand."""

    @staticmethod
    def empty() -> "LabelImage":
        """Returns an image without a single pixel."""
        return LabelImage(stamp=-np.inf, labels=np.zeros((0, 0), np.uint8))


@dataclass(frozen=True, eq=False)
class EgocanImage(ImmutableValue):
    """The legged egocan (QuadPiPS sections IV-A, V-C): cylinder and floor cap around the camera.

    Frame E: origin at the camera's optical centre, gravity-aligned, yaw of the base; x right, y down, z forward.
    """

    stamp: float
    """Time of the newest depth image in it [s]."""
    X_WE: np.ndarray
    """Pose of E in the world at that time, (4, 4)."""
    cap_height: np.ndarray
    """Depth below E along gravity, |y| [m], float32 (h_cap, w_cap); NaN where unknown."""
    cap_normals: np.ndarray
    """Unit normals in E, float32 (h_cap, w_cap, 3); on flat ground (0, -1, 0)."""
    cap_labels: np.ndarray
    """Steppability, uint8 (h_cap, w_cap)."""
    cap_focal: float
    """Pixels per unit of x/|y| on the cap: u = cap_focal x/|y| + w_cap/2, v = cap_focal z/|y| + h_cap/2, where integers are
    the centres of pixels."""
    cap_pixel: float = 0.0
    """Side of a pixel [m] of a cap that is drawn straight down (parallel projection): u = x/cap_pixel + w_cap/2, v likewise
    with z. 0: central projection with ``cap_focal``."""
    cylinder_points_W: np.ndarray = field(default_factory=lambda: np.zeros((0, 0, 3), np.float32))
    """The point that each pixel of the cylinder holds, in W [m], float32 (h_cyl, w_cyl, 3); NaN where unknown."""
    cylinder_normals_W: np.ndarray = field(default_factory=lambda: np.zeros((0, 0, 3), np.float32))
    """Their unit normals, in W, float32 (h_cyl, w_cyl, 3); NaN where unknown."""
    cylinder_labels: np.ndarray = field(default_factory=lambda: np.zeros((0, 0), np.uint8))
    """Their steppability, uint8 (h_cyl, w_cyl)."""

    @property
    def cylinder_range(self) -> np.ndarray:
        """Horizontal range of the points from E [m], float32 (h_cyl, w_cyl); NaN where unknown. Computed when it is read."""
        p_E = (self.cylinder_points_W - self.X_WE[:3, 3].astype(np.float32)) @ self.X_WE[:3, :3].astype(np.float32)
        return np.hypot(p_E[..., 0], p_E[..., 2])

    @property
    def cylinder_normals(self) -> np.ndarray:
        """Unit normals in E, float32 (h_cyl, w_cyl, 3); NaN where unknown. Computed when it is read."""
        return self.cylinder_normals_W @ self.X_WE[:3, :3].astype(np.float32)

    @property
    def cap_rays(self) -> np.ndarray:
        """(a, b) [m, 1], (2,): pixel (u, v) shows x = (u - w_cap/2) (a + b |y|) and z = (v - h_cap/2) (a + b |y|)."""
        return np.array([self.cap_pixel, 0.0]) if self.cap_pixel > 0 else np.array([0.0, 1.0 / self.cap_focal])

    @staticmethod
    def empty() -> "EgocanImage":
        """Returns a can without a single pixel."""
        return EgocanImage(
            stamp=-np.inf,
            X_WE=np.eye(4),
            cap_height=np.zeros((0, 0), np.float32),
            cap_normals=np.zeros((0, 0, 3), np.float32),
            cap_labels=np.zeros((0, 0), np.uint8),
            cap_focal=1.0,
        )


@dataclass(frozen=True, eq=False)
class SuperpixelImage(ImmutableValue):
    """Over-segmentation of the egocan's floor cap (QuadPiPS section V-D)."""

    stamp: float
    X_WE: np.ndarray
    """Pose of the egocan frame E in the world, (4, 4)."""
    assignment: np.ndarray
    """Cluster of each pixel, int32 (h_cap, w_cap); -1 where none."""
    points: np.ndarray
    """3-D point of each pixel in E [m], float32 (h_cap, w_cap, 3); NaN where unknown."""
    centers: np.ndarray
    """Cluster centroids in E [m], (k, 3)."""
    normals: np.ndarray
    """Cluster normals in E, unit, (k, 3)."""
    labels: np.ndarray
    """Steppability per cluster, uint8 (k,)."""
    cap_rays: np.ndarray = field(default_factory=lambda: np.array([0.0, 1.0]))
    """Where the pixels' rays run (see EgocanImage), (2,)."""
    healthy: np.ndarray | None = None
    """Whether a pixel passed the health check, bool (h_cap, w_cap)."""
    clusters: np.ndarray = field(default_factory=lambda: np.zeros((0, 7)))
    """Points [m], normals (in W) and numbers of pixels of the clusters before they were split, (m, 7): where the next frame
    begins."""
    ids: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int64))
    """Id of each superpixel, int64 (k,): it stays with its piece of ground from frame to frame."""
    homes: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    """Where each superpixel's centroid was when it got its id, in W [m], (k, 3)."""
    next_id: int = 0
    """The least id that has never been given."""

    @staticmethod
    def empty() -> "SuperpixelImage":
        """Returns an image without a single pixel or cluster."""
        return SuperpixelImage(
            stamp=-np.inf,
            X_WE=np.eye(4),
            assignment=np.zeros((0, 0), np.int32),
            points=np.zeros((0, 0, 3), np.float32),
            centers=np.zeros((0, 3)),
            normals=np.zeros((0, 3)),
            labels=np.zeros(0, np.uint8),
            healthy=np.zeros((0, 0), bool),
        )
