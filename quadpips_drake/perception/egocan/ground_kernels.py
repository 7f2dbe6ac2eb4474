"""The inner loops of the remembered ground (ground_memory.py). Cameras are packed by ``view_kernels.pack_camera``.

An image enters in two steps: ``collect_ground`` sums its points per cell, ``merge_ground`` holds the sums against what is
remembered.
"""

import numpy as np
from numba import njit

from quadpips_drake.perception.egocan.view_kernels import EXPOSED, HIDDEN, THROUGH, judge, locate_row, look_at

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


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "arcp"})
def _place_row(depth, normals, b, is_odd, lens, R, origin, limits, x, y, height, up):
    """Writes where the points of one image row lie: x, y in cells, height above the camera [m]; NaN where left out.

    ``up``: upward part of the normals; ``normals`` (3 columns,). ``b``: y/z of the row; ``is_odd``: whether its number is.
    ``limits``: depths below which every second column, and row, is enough. Free of branches, for many columns at once.
    """
    (r00, r01, r02), (r10, r11, r12), (r20, r21, r22) = R[0], R[1], R[2]
    pitch_u, cx, x0, y0 = lens[0], lens[2], origin[0], origin[1]
    dense, denser = limits
    bx, by, bz = r01 * b + r02, r11 * b + r12, r21 * b + r22
    for u in range(depth.shape[0]):
        z = depth[u]
        a = (np.float32(u) - cx) * pitch_u
        n0, n1, n2 = normals[3 * u], normals[3 * u + 1], normals[3 * u + 2]
        above = z * (r20 * a + bz)
        is_enough = (z < dense) & (((u & 1) == 1) | ((z < denser) & is_odd))
        taken = (z < np.inf) & (not is_enough) & (above < 0) & (n0 == n0)
        x[u] = x0 + z * (r00 * a + bx)
        y[u] = y0 + z * (r10 * a + by)
        up[u] = r20 * n0 + r21 * n1 + r22 * n2
        height[u] = above if taken else np.float32(np.nan)


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "arcp"})
def _link_row(depth, above, normals, b, lens, R, flat, x, y, height, pieces):
    """Writes the ways (x, y in cells, height) from the points of one image row to those of the row ``above``.

    ``pieces``: into how many pieces a way is to be cut; 1 where it is short, or not as ``flat`` [m] as the normal says, or
    leads nowhere because nothing is measured there.
    """
    (r00, r01, r02), (r10, r11, r12), (r20, r21, r22) = R[0], R[1], R[2]
    pitch_u, pitch_v, cx = lens[0], lens[1], lens[2]
    for u in range(depth.shape[0]):
        a = (np.float32(u) - cx) * pitch_u
        e2 = above[u] - depth[u]
        e0, e1 = e2 * a, e2 * b - above[u] * pitch_v
        off = normals[3 * u] * e0 + normals[3 * u + 1] * e1 + normals[3 * u + 2] * e2
        ex, ey = r00 * e0 + r01 * e1 + r02 * e2, r10 * e0 + r11 * e1 + r12 * e2
        cells = max(abs(ex), abs(ey)) * np.float32(1.5)
        linked = (abs(off) < flat) & (cells < MAX_SUBDIVISION)
        x[u], y[u], height[u] = ex, ey, r20 * e0 + r21 * e1 + r22 * e2
        pieces[u] = np.int32(cells if linked else np.float32(0.0)) + 1


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "arcp"})
def _add_ground(x, y, z, nx, ny, nz, up, label, layer, total, labels):
    """Adds one point (x, y in cells) to the totals [count, height, normal (3), upward part of the normal] of its cell.

    A higher layer displaces a lower one. Within a layer, points that face upward displace those of a wall: the wall below an
    edge does not tilt the edge.
    """
    bottom, right = np.float32(total.shape[0]), np.float32(total.shape[1])
    if not ((x >= 0) & (x < bottom) & (y >= 0) & (y < right)):
        return
    i, j = np.uint32(x), np.uint32(y)
    n = total[i, j, 0]
    above, reach = z * n - total[i, j, 1], layer * n
    if above < -reach:
        return
    if above <= reach:  # so, too, in an empty cell, the totals of which are 0
        faces_up, is_floor = up > np.float32(WALL), total[i, j, 5] > np.float32(WALL) * n
        if (is_floor == faces_up) | (n == 0):
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


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "arcp"})
def collect_ground(depth, normals, image_labels, camera, first_cell, cell_size, layer, total, labels):
    """Sums the points of an image per cell; points without a normal (edges, noise) are left out.

    ``total`` (n, n, 6): count, height above the camera, normal in C, its upward component. Close to the camera every second
    column and row is enough. Rows of pixels far ahead lie further apart on the ground than a cell. The sensor sees one
    unbroken surface between two neighbouring pixels, so the piece between them is added as well, as long as it is as flat as
    the normal says.
    """
    R, p, focal = camera
    rows, columns = depth.shape
    lens = (np.float32(1.0 / focal[0]), np.float32(1.0 / focal[1]), np.float32(focal[2]), np.float32(focal[3]))
    per_cell = 1.0 / cell_size
    # x and y in cells from here on
    origin = (np.float32(p[0] * per_cell - first_cell[0]), np.float32(p[1] * per_cell - first_cell[1]))
    R_cells = (R * np.array([[per_cell], [per_cell], [1.0]])).astype(np.float32)
    dense = np.float32(0.5 * cell_size * focal[0] / PIXELS_PER_CELL)
    limits, flat = (dense, np.float32(0.6) * dense), np.float32(0.5 * cell_size)
    x, y, height = np.empty(columns, np.float32), np.empty(columns, np.float32), np.empty(columns, np.float32)
    ex, ey, ez = np.empty(columns, np.float32), np.empty(columns, np.float32), np.empty(columns, np.float32)
    up, pieces = np.empty(columns, np.float32), np.ones(columns, np.int32)
    for v in range(rows):
        b, n = (np.float32(v) - lens[3]) * lens[1], normals[v].reshape(-1)
        _place_row(depth[v], n, b, v % 2 == 1, lens, R_cells, origin, limits, x, y, height, up)
        if v > 0:
            _link_row(depth[v], depth[v - 1], n, b, lens, R_cells, flat, ex, ey, ez, pieces)
        for u in range(columns):
            if np.isnan(height[u]):
                continue
            n0, n1, n2, label = n[3 * u], n[3 * u + 1], n[3 * u + 2], image_labels[v, u]
            _add_ground(x[u], y[u], height[u], n0, n1, n2, up[u], label, np.float32(layer), total, labels)
            for k in range(1, pieces[u]):
                t = np.float32(k) / np.float32(pieces[u])
                sx, sy, sz = x[u] + t * ex[u], y[u] + t * ey[u], height[u] + t * ez[u]
                _add_ground(sx, sy, sz, n0, n1, n2, up[u], label, np.float32(layer), total, labels)


@njit(cache=True, nogil=True, error_model="numpy")
def flies(x, y, z, cell_size, depth, camera, margin):
    """Whether the image itself sees through all corners of the cell around (x, y, z): what hit it was an outlier."""
    half = 0.5 * cell_size
    for sx in (-half, half):
        for sy in (-half, half):
            if look_at(x + sx, y + sy, z, depth, camera, margin) != THROUGH:
                return False
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def _forget(i, j, ground):
    """Makes a cell unknown."""
    height, normal, label, votes, count, missed = ground
    height[i, j] = np.nan
    normal[i, j, :] = np.nan
    label[i, j], votes[i, j], count[i, j], missed[i, j] = 0, 0, 0, 0


@njit(cache=True, nogil=True, error_model="numpy")
def _miss(i, j, count, missed):
    """Notes that an image shows the place of a cell's surface, but not the surface."""
    if count[i, j] == 0:  # assumed: nothing has measured it
        return
    missed[i, j] += 1
    _age(i, j, count, missed)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _age(i, j, count, missed):
    """Lets newer images outweigh older ones."""
    if count[i, j] + missed[i, j] > MAX_COUNT:
        count[i, j] = (count[i, j] + 1) // 2
        missed[i, j] //= 2


@njit(cache=True, nogil=True, error_model="numpy")
def _average(size, R, sums, old, z, shares):
    """Averages heights ``z`` (k,) and normals of cells with what they hold, in place; free of branches.

    Args:
        size: how many of the columns count.
        R: of the camera, (3, 3).
        sums: sums of new normals in C, (3, k), of any length.
        old: height and normal that each cell holds, (4, k); unit normals in W afterwards.
        z: new heights [m], (k,); averages afterwards.
        shares: of the new ones in the average, (k,); 1 takes the new ones as they are.
    """
    r00, r01, r02, r10, r11, r12 = R[0, 0], R[0, 1], R[0, 2], R[1, 0], R[1, 1], R[1, 2]
    r20, r21, r22 = R[2, 0], R[2, 1], R[2, 2]
    for k in range(size):
        m0, m1, m2 = sums[0, k], sums[1, k], sums[2, k]
        n0 = r00 * m0 + r01 * m1 + r02 * m2
        n1 = r10 * m0 + r11 * m1 + r12 * m2
        n2 = r20 * m0 + r21 * m1 + r22 * m2
        scale = 1.0 / np.sqrt(n0 * n0 + n1 * n1 + n2 * n2)
        n0, n1, n2 = n0 * scale, n1 * scale, n2 * scale
        share = shares[k]
        a0 = old[1, k] + share * (n0 - old[1, k])
        a1 = old[2, k] + share * (n1 - old[2, k])
        a2 = old[3, k] + share * (n2 - old[3, k])
        scale = 1.0 / max(np.sqrt(a0 * a0 + a1 * a1 + a2 * a2), 1e-6)
        is_new = share == 1.0
        z[k] = z[k] if is_new else old[0, k] + share * (z[k] - old[0, k])
        old[1, k] = n0 if is_new else a0 * scale
        old[2, k] = n1 if is_new else a1 * scale
        old[3, k] = n2 if is_new else a2 * scale


@njit(cache=True, nogil=True, error_model="numpy")
def merge_ground(total, new_label, depth, camera, first_cell, cell_size, rule, ground):
    """Writes the sums of one image into the memory, cell by cell, and forgets what the image disproves.

    ``ground``: height, normal, label, votes, count, missed; all are written to. ``rule``: blend_height, see_through,
    trusted_share of GroundMemoryConfig. What happens:

    - no new point in a cell: its surface is forgotten when the camera sees through it, and missed when the image shows the
      place and has a point for every cell there;
    - ground seen below a measured surface (a view under a slab, from the side) does not disprove it: it takes the cell only
      when the camera also sees through the old one, or when the old one is not trusted;
    - a new or higher surface is an outlier when the camera sees through all of its cell.

    The cells of a row that take a new point are listed first, and then averaged all at once.
    """
    R, p, focal = camera
    blend_height, margin, trusted_share = rule
    height, normal, label, votes, count, missed = ground
    rows, columns = height.shape
    pixel, distance, pixels = np.empty(columns, np.int32), np.empty(columns), depth.ravel()
    listed, z, shares = np.empty(columns, np.int64), np.empty(columns), np.empty(columns)
    sums, old_surface = np.empty((3, columns), np.float32), np.empty((4, columns))
    for i in range(rows):
        x = (first_cell[0] + i + 0.5) * cell_size
        locate_row(x, first_cell[1] + 0.5, cell_size, height[i], camera, *depth.shape, pixel, distance)
        size = 0
        for j in range(columns):
            n, old = total[i, j, 0], height[i, j]
            if n == 0 and pixel[j] < 0:  # neither measured nor in view, or unknown
                continue
            known = old == old
            new = p[2] + total[i, j, 1] / n
            measured = known and count[i, j] > 0
            same = measured and abs(new - old) <= blend_height
            below = measured and new < old - blend_height
            # Points of a wall just under an edge are no hits of the ground that the edge bounds.
            wall = same and normal[i, j, 2] > WALL and not total[i, j, 5] > WALL * n
            if n == 0 or wall or (below and count[i, j] >= trusted_share * (count[i, j] + missed[i, j])):
                seen = _seen(pixels, pixel[j], depth.shape[1], distance[j], margin)
                if n == 0 and seen == THROUGH:
                    _forget(i, j, ground)
                # Only where rows of pixels lie no further apart than a cell on level ground.
                elif seen == EXPOSED and distance[j] * distance[j] < (p[2] - old) * focal[1] * cell_size:
                    _miss(i, j, count, missed)
                if n == 0 or wall or seen != THROUGH:
                    continue
            elif not same and flies(x, (first_cell[1] + j + 0.5) * cell_size, new, cell_size, depth, camera, margin):
                continue
            m0, m1, m2 = total[i, j, 2], total[i, j, 3], total[i, j, 4]
            if abs(m0) + abs(m1) + abs(m2) > 0:
                listed[size], z[size], shares[size] = j, new, 1.0 / (count[i, j] + 1.0) if same else 1.0
                sums[0, size], sums[1, size], sums[2, size] = m0, m1, m2
                old_surface[0, size], old_surface[1, size] = old, normal[i, j, 0]
                old_surface[2, size], old_surface[3, size] = normal[i, j, 1], normal[i, j, 2]
                size += 1
        _average(size, R, sums, old_surface, z, shares)
        for k in range(size):
            j = listed[k]
            height[i, j] = z[k]
            normal[i, j, 0], normal[i, j, 1], normal[i, j, 2] = old_surface[1, k], old_surface[2, k], old_surface[3, k]
            _note(i, j, new_label[i, j], shares[k] < 1.0, label, votes, count, missed)


@njit(cache=True, nogil=True, error_model="numpy")
def _seen(pixels, pixel, width, distance, margin):
    """HIDDEN, EXPOSED or THROUGH for a place that ``locate_row`` has located."""
    if pixel < 0:
        return HIDDEN
    a = np.uint32(pixel)
    c = a + np.uint32(width)
    return judge(pixels[a], pixels[a + np.uint32(1)], pixels[c], pixels[c + np.uint32(1)], distance, margin)


@njit(cache=True, nogil=True, error_model="numpy")
def _note(i, j, new, same, label, votes, count, missed):
    """Counts a measurement of a cell: one more of the ``same`` surface, or the first of a new one.

    A measurement of the same surface votes for its label ``new``; UNKNOWN abstains. Newer images outweigh older ones.
    Written with choices instead of branches, of which a processor would mispredict many.
    """
    old, v, n, m = label[i, j], votes[i, j], count[i, j] + 1, missed[i, j]
    agrees, gives_way = old == new, v <= 1
    backing = min(v + 1, MAX_VOTES) if agrees else (1 if gives_way else v - 1)
    kept = old if agrees | (not gives_way) else new
    backing, kept = (v, old) if new == 0 else (backing, kept)
    is_old = n + m > MAX_COUNT
    n, m = (n + 1) >> 1 if is_old else n, m >> 1 if is_old else m
    label[i, j] = kept if same else new
    votes[i, j] = backing if same else min(new, 1)
    count[i, j] = n if same else 1
    missed[i, j] = m if same else 0
