"""The inner loops of the remembered ground (ground_memory.py). Cameras are packed by ``view_kernels.pack_camera``.

An image enters in two steps: ``collect_ground`` sums its points per cell, ``merge_ground`` holds the sums against what is
remembered.
"""

import numpy as np
from numba import njit

from quadpips_drake.perception.egocan.view_kernels import EXPOSED, THROUGH, look_at

MAX_SUBDIVISION = 6
"""Most pieces into which the surface between two vertically neighbouring pixels is cut."""
WALL = 0.6
"""Points whose normals point upward by less than this are taken for a wall when they meet ground in one cell."""
PIXELS_PER_CELL = 1.4
"""Where an image has more pixels across a cell than twice this, some are left out."""
MAX_COUNT = 20
"""Images after which a cell's average no longer gets slower, and over which hits and misses are counted."""
MAX_VOTES = 5
"""Images that it takes at most to turn a label that has long been confirmed."""


@njit(cache=True, inline="always")
def _add_ground(x, y, z, nx, ny, nz, up, label, layer, total, labels):
    """Adds one point (x, y in cells) to the totals [count, height, normal (3), upward part of the normal] of its cell.

    A higher layer displaces a lower one. Within a layer, points that face upward displace those of a wall: the wall below an
    edge does not tilt the edge.
    """
    if not ((x >= 0) & (x < total.shape[0]) & (y >= 0) & (y < total.shape[1])):
        return
    i, j = np.int64(x), np.int64(y)
    n = total[i, j, 0]
    if n > 0:
        above, reach = z * n - total[i, j, 1], layer * n
        if above < -reach:
            return
        if above <= reach:
            faces_up, is_floor = up > np.float32(WALL), total[i, j, 5] > np.float32(WALL) * n
            if is_floor == faces_up:
                total[i, j, 0] = n + np.float32(1.0)
                total[i, j, 1] += z
                total[i, j, 2] += nx
                total[i, j, 3] += ny
                total[i, j, 4] += nz
                total[i, j, 5] += up
                labels[i, j] = max(label, labels[i, j])
                return
            if is_floor:
                return
    total[i, j, 0] = np.float32(1.0)
    total[i, j, 1] = z
    total[i, j, 2] = nx
    total[i, j, 3] = ny
    total[i, j, 4] = nz
    total[i, j, 5] = up
    labels[i, j] = label


@njit(cache=True, error_model="numpy", fastmath={"contract", "arcp"})
def collect_ground(depth, normals, image_labels, camera, first_cell, cell_size, layer, total, labels):
    """Sums the points of an image per cell; points without a normal (edges, noise) are left out.

    ``total`` (n, n, 6): count, height above the camera, normal in C, its upward component. Close to the camera every second
    column and row is enough. Rows of pixels far ahead lie further apart on the ground than a cell. The sensor sees one
    unbroken surface between two neighbouring pixels, so the piece between them is added as well, as long as it is as flat as
    the normal says.
    """
    R, p, focal = camera
    rows, columns = depth.shape
    pitch_u, pitch_v = np.float32(1.0 / focal[0]), np.float32(1.0 / focal[1])
    cx, cy = np.float32(focal[2]), np.float32(focal[3])
    per_cell = 1.0 / cell_size
    x0, y0 = np.float32(p[0] * per_cell - first_cell[0]), np.float32(p[1] * per_cell - first_cell[1])
    # x and y in cells from here on
    (r00, r01, r02), (r10, r11, r12), (r20, r21, r22) = (R * np.array([[per_cell], [per_cell], [1.0]])).astype(np.float32)
    dense = np.float32(0.5 * cell_size * focal[0] / PIXELS_PER_CELL)
    denser = np.float32(0.6) * dense
    flat, thin_layer = np.float32(0.5 * cell_size), np.float32(layer)
    for v in range(rows):
        b = (np.float32(v) - cy) * pitch_v
        bx, by, bz = r01 * b + r02, r11 * b + r12, r21 * b + r22
        for u in range(columns):
            z = depth[v, u]
            if not z < np.inf or (z < dense and (u % 2 == 1 or (z < denser and v % 2 == 1))):
                continue
            a = (np.float32(u) - cx) * pitch_u
            n0, n1, n2 = normals[v, u, 0], normals[v, u, 1], normals[v, u, 2]
            height = z * (r20 * a + bz)
            if height >= 0 or n0 != n0:
                continue
            x, y = x0 + z * (r00 * a + bx), y0 + z * (r10 * a + by)
            up = r20 * n0 + r21 * n1 + r22 * n2
            label = image_labels[v, u]
            _add_ground(x, y, height, n0, n1, n2, up, label, thin_layer, total, labels)
            if v == 0:
                continue
            e2 = depth[v - 1, u] - z  # (e0, e1, e2) leads to the point of the pixel above
            e0, e1 = e2 * a, e2 * b - depth[v - 1, u] * pitch_v
            if not abs(n0 * e0 + n1 * e1 + n2 * e2) < flat:  # so, too, if nothing is measured there
                continue
            ex, ey = r00 * e0 + r01 * e1 + r02 * e2, r10 * e0 + r11 * e1 + r12 * e2
            pieces = int(max(abs(ex), abs(ey)) * np.float32(1.5)) + 1
            if 1 < pieces <= MAX_SUBDIVISION:
                ez = r20 * e0 + r21 * e1 + r22 * e2
                for k in range(1, pieces):
                    t = np.float32(k) / np.float32(pieces)
                    sx, sy, sz = x + t * ex, y + t * ey, height + t * ez
                    _add_ground(sx, sy, sz, n0, n1, n2, up, label, thin_layer, total, labels)


@njit(cache=True, error_model="numpy")
def _flies(x, y, z, half, depth, camera, margin):
    """Whether the image itself sees through all corners of the cell around (x, y, z): what hit it was an outlier."""
    for sx in (-half, half):
        for sy in (-half, half):
            if look_at(x + sx, y + sy, z, depth, camera, margin) != THROUGH:
                return False
    return True


@njit(cache=True, error_model="numpy")
def _forget(i, j, ground):
    """Makes a cell unknown."""
    height, normal, label, votes, count, missed = ground
    height[i, j] = np.nan
    normal[i, j, :] = np.nan
    label[i, j], votes[i, j], count[i, j], missed[i, j] = 0, 0, 0, 0


@njit(cache=True, error_model="numpy")
def _miss(i, j, count, missed):
    """Notes that an image shows the place of a cell's surface, but not the surface."""
    if count[i, j] == 0:  # assumed: nothing has measured it
        return
    missed[i, j] += 1
    _age(i, j, count, missed)


@njit(cache=True, error_model="numpy", inline="always")
def _age(i, j, count, missed):
    """Lets newer images outweigh older ones."""
    if count[i, j] + missed[i, j] > MAX_COUNT:
        count[i, j] = (count[i, j] + 1) // 2
        missed[i, j] //= 2


@njit(cache=True, error_model="numpy", inline="always")
def _vote(i, j, new, label, votes):
    """Lets an image vote for the label of a surface that is already known; UNKNOWN abstains."""
    if new == 0:
        return
    if label[i, j] == new:
        votes[i, j] = min(votes[i, j] + 1, MAX_VOTES)
    elif votes[i, j] > 1:
        votes[i, j] -= 1
    else:
        label[i, j], votes[i, j] = new, 1


@njit(cache=True, error_model="numpy", inline="always")
def _measure(i, j, z, n0, n1, n2, new_label, same, ground):
    """Writes height and normal (n0, n1, n2; of any length) into a cell, averaged with its own if of the ``same`` surface."""
    height, normal, label, votes, count, missed = ground
    scale = 1.0 / np.sqrt(n0 * n0 + n1 * n1 + n2 * n2)
    n0, n1, n2 = n0 * scale, n1 * scale, n2 * scale
    if same:
        share = 1.0 / (count[i, j] + 1.0)
        height[i, j] += share * (z - height[i, j])
        n0 = normal[i, j, 0] + share * (n0 - normal[i, j, 0])
        n1 = normal[i, j, 1] + share * (n1 - normal[i, j, 1])
        n2 = normal[i, j, 2] + share * (n2 - normal[i, j, 2])
        scale = 1.0 / max(np.sqrt(n0 * n0 + n1 * n1 + n2 * n2), 1e-6)
        n0, n1, n2 = n0 * scale, n1 * scale, n2 * scale
        _vote(i, j, new_label, label, votes)
        count[i, j] += 1
        _age(i, j, count, missed)
    else:
        height[i, j] = z
        label[i, j], votes[i, j] = new_label, min(new_label, 1)
        count[i, j], missed[i, j] = 1, 0
    normal[i, j, 0], normal[i, j, 1], normal[i, j, 2] = n0, n1, n2


@njit(cache=True, error_model="numpy")
def merge_ground(total, new_label, depth, camera, first_cell, cell_size, rule, ground):
    """Writes the sums of one image into the memory, cell by cell, and forgets what the image disproves.

    ``ground``: height, normal, label, votes, count, missed; all are written to. ``rule``: blend_height, see_through,
    trusted_share of GroundMemoryConfig. What happens:

    - no new point in a cell: its surface is forgotten when the camera sees through it, and missed when the image shows the
      place and has a point for every cell there;
    - ground seen below a measured surface (a view under a slab, from the side) does not disprove it: it takes the cell only
      when the camera also sees through the old one, or when the old one is not trusted;
    - a new or higher surface is an outlier when the camera sees through all of its cell.
    """
    R, p = camera[0], camera[1]
    blend_height, margin, trusted_share = rule
    height, normal, _, _, count, missed = ground
    for i in range(height.shape[0]):
        x = (first_cell[0] + i + 0.5) * cell_size
        for j in range(height.shape[1]):
            n, old = total[i, j, 0], height[i, j]
            known = old == old
            if n == 0 and not known:
                continue
            y = (first_cell[1] + j + 0.5) * cell_size
            if n == 0:
                seen = look_at(x, y, old, depth, camera, margin)
                if seen == THROUGH:
                    _forget(i, j, ground)
                elif seen == EXPOSED and _resolves(x, y, old, camera, cell_size):
                    _miss(i, j, count, missed)
                continue
            z = p[2] + total[i, j, 1] / n
            measured = known and count[i, j] > 0
            same = measured and abs(z - old) <= blend_height
            below = measured and z < old - blend_height
            # Points of a wall just under an edge are no hits of the ground that the edge bounds.
            wall = same and normal[i, j, 2] > WALL and not total[i, j, 5] > WALL * n
            trusted = count[i, j] >= trusted_share * (count[i, j] + missed[i, j])
            if wall or (below and trusted):
                seen = look_at(x, y, old, depth, camera, margin)
                if seen == EXPOSED and _resolves(x, y, old, camera, cell_size):
                    _miss(i, j, count, missed)
                if wall or seen != THROUGH:
                    continue
            elif not same and _flies(x, y, z, 0.5 * cell_size, depth, camera, margin):
                continue
            m0, m1, m2 = total[i, j, 2], total[i, j, 3], total[i, j, 4]
            if abs(m0) + abs(m1) + abs(m2) > 0:
                n0 = R[0, 0] * m0 + R[0, 1] * m1 + R[0, 2] * m2
                n1 = R[1, 0] * m0 + R[1, 1] * m1 + R[1, 2] * m2
                n2 = R[2, 0] * m0 + R[2, 1] * m1 + R[2, 2] * m2
                _measure(i, j, z, n0, n1, n2, new_label[i, j], same, ground)


@njit(cache=True, error_model="numpy")
def _resolves(x, y, z, camera, cell_size):
    """Whether rows of pixels lie no further apart than a cell on level ground at (x, y, z) of W."""
    R, p, focal = camera
    dx, dy, dz = x - p[0], y - p[1], z - p[2]
    z_C = R[0, 2] * dx + R[1, 2] * dy + R[2, 2] * dz
    return z_C * z_C < -dz * focal[1] * cell_size
