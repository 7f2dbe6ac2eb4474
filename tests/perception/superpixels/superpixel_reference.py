"""The steps of the superpixels as readable NumPy, one pixel or cluster after the other: what the kernels must agree with."""

import numpy as np

from quadpips_drake.values.steppability import Steppability


def points_of(can):
    """The point of each pixel of the cap in E."""
    rows, columns = can.cap_height.shape
    v, u = np.mgrid[:rows, :columns]
    base, growth = can.cap_rays
    pixel = base + growth * can.cap_height
    return np.stack([pixel * (u - columns // 2), can.cap_height, pixel * (v - rows // 2)], axis=-1)


def neighbours(v, u, shape):
    """The up to four pixels beside (v, u)."""
    beside = ((v - 1, u), (v + 1, u), (v, u - 1), (v, u + 1))
    return [(b, a) for b, a in beside if 0 <= b < shape[0] and 0 <= a < shape[1]]


def healthy_pixels(can, config):
    """The health check, section V-D.1, and two neighbours that continue the pixel's plane."""
    points, normals = points_of(can), can.cap_normals
    with np.errstate(invalid="ignore"):
        plausible = (can.cap_height > 0) & (can.cap_height <= config.max_depth) & (-normals[..., 1] >= config.min_upward)
    plausible &= np.isin(can.cap_labels, (Steppability.UNKNOWN, Steppability.STEPPABLE))
    healthy = np.zeros_like(plausible)
    for v, u in np.argwhere(plausible):
        beside = [q for q in neighbours(v, u, plausible.shape) if plausible[q]]
        healthy[v, u] = sum(abs((points[q] - points[v, u]) @ normals[v, u]) <= config.max_step for q in beside) >= 2
    return healthy


def distances(points, normals, cluster, weights):
    """Equation 10, for pixels (n, 3) and one cluster [u, v, p, n]; without the distance in the image."""
    off = cluster[2:5] - points
    tilt = 1.0 - normals @ cluster[5:8]
    return weights[0] * tilt + weights[1] * abs(off @ cluster[5:8]) + weights[2] * np.linalg.norm(off, axis=-1)


def assign(points, normals, healthy, clusters, step, weights):
    """Each healthy pixel's distance to each cluster that reaches it, (n, k); inf where it does not."""
    v, u = np.nonzero(healthy)
    table = np.full((len(v), len(clusters)), np.inf)
    for c, cluster in enumerate(clusters):
        near = (abs(u - int(cluster[0])) <= step) & (abs(v - int(cluster[1])) <= step)
        table[near, c] = distances(points[v[near], u[near]], normals[v[near], u[near]], cluster, weights)
    return table


def split(points, normals, assignment, max_step, min_pixels):
    """Connected components by flooding; numbered in the order of their first pixels."""
    pieces, count = np.full_like(assignment, -1), 0
    todo = assignment >= 0
    for start in map(tuple, np.argwhere(assignment >= 0)):
        if not todo[start]:
            continue
        todo[start] = False
        piece, queue = [start], [start]
        while queue:
            p = queue.pop()
            for q in neighbours(*p, assignment.shape):
                step = points[q] - points[p]
                close = max(abs(step @ normals[p]), abs(step @ normals[q])) <= max_step
                if todo[q] and assignment[q] == assignment[p] and close:
                    todo[q] = False
                    piece.append(q)
                    queue.append(q)
        if len(piece) >= min_pixels:
            pieces[tuple(np.transpose(piece))] = count
            count += 1
    return pieces, count
