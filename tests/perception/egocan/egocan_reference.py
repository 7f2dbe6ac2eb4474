"""The rules of the egocan as readable Python, one place after the other: what the kernels must agree with, to the bit."""

import numpy as np

from quadpips_drake.perception.egocan.egocan_kernels import NEAREST
from quadpips_drake.perception.egocan.ground_kernels import MAX_COUNT, MAX_VOTES


def cylinder_of(image, X_WE, config):
    """Points in W and labels of a cylinder that takes in one image (equations 1 and 2; the smallest range wins)."""
    rows, columns, k = config.cylinder_height, config.cylinder_width, image.intrinsics
    points, labels = np.full((rows, columns, 3), np.nan, np.float32), np.zeros((rows, columns), np.uint8)
    ranges = np.full((rows, columns), np.inf, np.float32)
    R, p = image.X_WC[:3, :3], image.X_WC[:3, 3]
    for v in range(0, k.height, config.cylinder_stride):
        for u in range(0, k.width, config.cylinder_stride):
            d = float(image.depth[v, u])
            if not d < np.inf:
                continue
            a, b = (u - k.cx) / k.fx, (v - k.cy) / k.fy
            p_W = [p[i] + d * (R[i, 0] * a + R[i, 1] * b + R[i, 2]) for i in range(3)]
            dx, dy, down = p_W[0] - X_WE[0, 3], p_W[1] - X_WE[1, 3], X_WE[2, 3] - p_W[2]
            x, z = X_WE[0, 0] * dx + X_WE[1, 0] * dy, X_WE[0, 2] * dx + X_WE[1, 2] * dy
            rho = np.sqrt(x * x + z * z)
            if not rho > NEAREST or abs(down) >= 0.5 * config.v_fov * rho:
                continue
            column = int(np.arctan2(x, z) * columns / (2 * np.pi) + 0.5 * columns) % columns
            row = int(down / rho * rows / config.v_fov + 0.5 * rows)
            if 0 <= row < rows and rho < ranges[row, column]:
                ranges[row, column], points[row, column], labels[row, column] = rho, p_W, image.labels[v, u]
    return points, labels


def note(new, same, label, votes, count, missed):
    """A cell's label, votes, count and missed after a measurement with the label ``new``."""
    if not same:
        return new, min(new, 1), 1, 0
    if new != 0:
        if label == new:
            votes = min(votes + 1, MAX_VOTES)
        elif votes > 1:
            votes -= 1
        else:
            label, votes = new, 1
    count += 1
    if count + missed > MAX_COUNT:
        count, missed = (count + 1) // 2, missed // 2
    return label, votes, count, missed


def average(new_z, new_normal, height, normal, count):
    """Height and normal of a cell that was measured ``count`` times before, in W; 0: what it holds does not count."""
    n = new_normal / np.linalg.norm(new_normal)
    if count == 0:
        return new_z, n
    share = 1.0 / (count + 1.0)
    blend = normal + share * (n - normal)
    return height + share * (new_z - height), blend / max(np.linalg.norm(blend), 1e-6)
