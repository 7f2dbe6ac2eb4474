"""Analytic scenes: boxes on (or over) a floor, ray-cast in NumPy."""

import numpy as np

from quadpips_drake.perception.egocan.egocan import begin_memory, draw_egocan, update_memory
from quadpips_drake.perception.normals.normals import measure_surface
from quadpips_drake.perception.regions.region_extraction import extract_regions
from quadpips_drake.perception.superpixels.superpixels import segment_superpixels
from quadpips_drake.values.images import AffordanceImage
from quadpips_drake.values.sensing import CameraIntrinsics

FOOT_RADIUS = 0.03
FEET = np.array([[0.36, 0.26, 0.0], [0.36, -0.26, 0.0], [-0.36, 0.26, 0.0], [-0.36, -0.26, 0.0]])
"""Ground points under the feet of a robot at the origin."""

INTRINSICS = CameraIntrinsics(width=640, height=480, fx=347.997, fy=347.997, cx=319.5, cy=239.5)
MEDIUM = CameraIntrinsics(width=320, height=240, fx=174.0, fy=174.0, cx=159.5, cy=119.5)
SMALL = CameraIntrinsics(width=160, height=120, fx=87.0, fy=87.0, cx=79.5, cy=59.5)


class Scene:
    """Axis-aligned boxes [x0, x1, y0, y1, z0, z1] and a floor at height ``floor`` (None: a void)."""

    def __init__(self, boxes, floor=0.0):
        self.boxes = np.asarray(boxes, float).reshape(-1, 6)
        self.floor = floor

    def depth(self, X_WC, intrinsics):
        """Returns the depth image [m] (height, width), +inf where a ray meets nothing."""
        v, u = np.mgrid[: intrinsics.height, : intrinsics.width]
        ray_C = np.stack(
            [(u - intrinsics.cx) / intrinsics.fx, (v - intrinsics.cy) / intrinsics.fy, np.ones(u.shape)], axis=-1
        )
        ray = ray_C @ X_WC[:3, :3].T
        origin = X_WC[:3, 3]
        depth = np.full(u.shape, np.inf)
        with np.errstate(divide="ignore", invalid="ignore"):
            if self.floor is not None:
                t = (self.floor - origin[2]) / ray[..., 2]
                depth = np.where(t > 0, t, depth)
            for box in self.boxes:
                low, high = (box[::2] - origin) / ray, (box[1::2] - origin) / ray
                enter, leave = np.minimum(low, high).max(-1), np.maximum(low, high).min(-1)
                depth = np.where((enter < leave) & (enter > 0) & (enter < depth), enter, depth)
        return depth.astype(np.float32)

    def height(self, x, y):
        """Returns the height of the highest surface at (x, y) [m]; NaN over a void."""
        z = np.full(np.shape(x), np.nan if self.floor is None else self.floor)
        for x0, x1, y0, y1, _, z1 in self.boxes:
            inside = (x >= x0) & (x <= x1) & (y >= y0) & (y <= y1)
            z = np.where(inside & ~(z > z1), z1, z)
        return z

    def edge_distance(self, x, y):
        """Returns how far (x, y) is inside the top of its box [m]; negative off all boxes."""
        return float(self.edge_distances(np.array([[x, y]]))[0])

    def edge_distances(self, points):
        """The same for ``points`` (n, 2 or more)."""
        x, y = points[:, :1], points[:, 1:2]
        x0, x1, y0, y1 = self.boxes[:, :4].T
        return np.min([x - x0, x1 - x, y - y0, y1 - y], axis=0).max(axis=1)


def stepping_stones(size=0.30, gap=0.10, rows=7, columns=5, start=0.75, floor=-0.4):
    """A platform up to x = ``start``, then stones of ``size`` with ``gap`` between them, tops at z = 0."""
    boxes = [[-2.0, start, -1.0, 1.0, -0.4, 0.0]]
    pitch = size + gap
    for i in range(rows):
        for j in range(columns):
            x, y = start + gap + i * pitch, (j - (columns - 1) / 2) * pitch - size / 2
            boxes.append([x, x + size, y, y + size, -0.4, 0.0])
    return Scene(boxes, floor)


def rotation(roll, pitch, yaw):
    """Returns R_WB of roll, pitch, yaw [rad]."""
    cr, sr, cp, sp, cy, sy = np.cos(roll), np.sin(roll), np.cos(pitch), np.sin(pitch), np.cos(yaw), np.sin(yaw)
    rx = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    ry = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    rz = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    return rz @ ry @ rx


def camera_mount(x=0.48, z=0.04, pitch_down=0.5236):
    """Returns X_BC of a camera ahead of the base origin that looks forward and down."""
    c, s = np.cos(pitch_down), np.sin(pitch_down)
    X_BC = np.eye(4)
    X_BC[:3, :3] = np.array([[0, -s, c], [-1, 0, 0], [0, -c, -s]])
    X_BC[:3, 3] = [x, 0.0, z]
    return X_BC


def walking_poses(distance, speed=0.3, rate=30.0, height=0.5, bob=0.02, pitch=0.035):
    """Yields (t, X_WB, yaw) of a base that walks along x, bobbing and pitching, with a little sway and yaw."""
    for k in range(int(distance / speed * rate) + 1):
        t = k / rate
        yaw = 0.05 * np.sin(0.9 * t)
        X_WB = np.eye(4)
        X_WB[:3, :3] = rotation(0.02 * np.sin(7 * t), pitch * np.sin(2 * np.pi * 2 * t), yaw)
        X_WB[:3, 3] = [speed * t, 0.03 * np.sin(3 * t), height + bob * np.sin(2 * np.pi * 1.7 * t)]
        yield t, X_WB, yaw


def affordance(depth, X_WC, stamp, config, intrinsics, labels=None):
    """Returns the affordance image of a depth image, as NormalEstimator makes it."""
    surface, normals = measure_surface(depth, intrinsics, config.normals)
    labels = np.zeros(depth.shape, np.uint8) if labels is None else labels
    return AffordanceImage(stamp, X_WC, intrinsics, surface, normals, labels)


def base_pose(x=0.0, y=0.0, height=0.5, yaw=0.0):
    """Returns X_WB of a level base."""
    X_WB = np.eye(4)
    X_WB[:3, :3] = rotation(0.0, 0.0, yaw)
    X_WB[:3, 3] = [x, y, height]
    return X_WB


def look(scene, poses, config, intrinsics=MEDIUM, memory=None, noise=None):
    """Returns the egocan's memory after looking at ``scene`` from ``poses`` (t, X_WB, yaw); ``noise`` spoils depth."""
    for stamp, X_WB, yaw in poses:
        X_WC = X_WB @ camera_mount()
        depth = scene.depth(X_WC, intrinsics)
        image = affordance(depth if noise is None else noise(depth), X_WC, stamp, config, intrinsics)
        if memory is None:
            memory = begin_memory([image], yaw, X_WB, FEET, config.egocan)
        else:
            memory = update_memory(memory, [image], yaw, config.egocan)
    return memory


def regions_of(memory, config):
    """Returns (can, superpixels, regions) of a memory."""
    can = draw_egocan(memory, config.egocan)
    superpixels = segment_superpixels(can, config.superpixels)
    return can, superpixels, extract_regions(superpixels, FOOT_RADIUS, config.regions)


def corners_in_world(region, polygon):
    """Returns the vertices of ``polygon`` of a region in W [m], (n, 3)."""
    return polygon @ region.X_WR[:3, :2].T + region.center
