"""The inner loops of the superpixels.

A row of ``clusters`` is [u, v, p (3), n (3), pixels]: pixel, point and unit normal in E, and its pixels. The loop
over all pixels and clusters runs on ``planes``, float32 (6, h, w): the channels x, y, z, n_x, n_y, n_z one after the other,
NaN where a pixel is not healthy, so that the compiler can handle several pixels at once. Everything else runs over the list
of healthy pixels only.
tests/perception/superpixels/superpixel_reference.py says the same in a few lines of NumPy.
"""

import numpy as np
from numba import njit

MAX_RANSAC_POINTS = 64
"""Points of a cluster against which a plane is tried; the final fit uses all of them."""
MERGE = 0.45
"""Of two propagated clusters that are closer to each other than this [grid steps], one is dropped."""
SPACING = 0.67
"""A new seed keeps this distance from propagated clusters [grid steps], so that there are as many as without them."""
SMALL = 0.3
"""Share of a full grid cell's pixels below which a propagated cluster gives way to a larger neighbour."""
RANSAC_MISS = 0.01
"""Chance of missing the best plane at which no further ones are tried."""
BLOCK = 16
"""Pixels whose distances are computed together: as many float32 numbers as one instruction of a new processor takes."""


@njit(cache=True, nogil=True)
def healthy_planes(points, normals, healthy):
    """Returns (planes (6, h, w), flat indices of the healthy pixels, ascending)."""
    rows, columns = healthy.shape
    planes = np.full((6, rows, columns), np.nan, np.float32)
    active = np.empty(rows * columns, np.int64)
    size = 0
    for v in range(rows):
        for u in range(columns):
            if healthy[v, u]:
                for k in range(3):
                    planes[k, v, u] = points[v, u, k]
                    planes[3 + k, v, u] = normals[v, u, k]
                active[size] = v * columns + u
                size += 1
    return planes, active[:size]


@njit(cache=True, nogil=True)
def nearest_healthy(healthy, u0, v0, reach):
    """Returns (u, v) of the healthy pixel nearest to the centroid of those within ``reach`` of (u0, v0), or (-1, -1)."""
    rows, columns = healthy.shape
    n, su, sv = 0, 0.0, 0.0
    v_first, v_last = max(0, v0 - reach), min(rows, v0 + reach + 1)
    u_first, u_last = max(0, u0 - reach), min(columns, u0 + reach + 1)
    for v in range(v_first, v_last):
        for u in range(u_first, u_last):
            if healthy[v, u]:
                n, su, sv = n + 1, su + u, sv + v
    best, best_u, best_v = np.inf, -1, -1
    for v in range(v_first, v_last):
        for u in range(u_first, u_last):
            if healthy[v, u]:
                off = (u - su / n) ** 2 + (v - sv / n) ** 2
                if off < best:
                    best, best_u, best_v = off, u, v
    return best_u, best_v


@njit(cache=True, nogil=True)
def seed_clusters(points, normals, healthy, step, previous, max_step):
    """Returns the clusters to begin with (section V-D.3): ``previous`` ones that still lie on healthy pixels, and seeds on a
    grid of ``step`` pixels, moved to the healthy pixel nearest to the local centroid, where no previous cluster is near.

    ``previous`` (k, 9): clusters of the last frame, brought into this one; none for a cold start. Of two that came closer
    to each other than MERGE steps in the image, the second is dropped; so is one that has become small, if another can take
    its pixels over. (Otherwise those that the rim of the cap squeezes would push all others along with the robot.)
    """
    rows, columns = healthy.shape
    clusters = np.zeros((len(previous) + (rows // step + 1) * (columns // step + 1), 9))
    count = 0
    for c in range(len(previous)):
        u, v = previous[c, 0], previous[c, 1]
        if not (0 <= u < columns and 0 <= v < rows) or _any_near(clusters, count, u, v, MERGE * step):
            continue
        if previous[c, 8] < SMALL * step * step and _can_be_taken_over(previous, c, step, max_step):
            continue
        if nearest_healthy(healthy, int(u), int(v), max(1, step // 4))[0] >= 0:
            clusters[count] = previous[c]
            count += 1
    kept = count
    for v0 in range(step // 2, rows, step):
        for u0 in range(step // 2, columns, step):
            if _any_near(clusters, kept, u0, v0, SPACING * step):
                continue
            u, v = nearest_healthy(healthy, u0, v0, max(1, step // 4))
            if u >= 0:
                clusters[count, 0], clusters[count, 1] = u, v
                clusters[count, 2:5] = points[v, u]
                clusters[count, 5:8] = normals[v, u]
                count += 1
    return clusters[:count].copy()


@njit(cache=True, nogil=True)
def _can_be_taken_over(clusters, c, step, max_step):
    """Whether a larger cluster lies within ``step`` pixels of cluster ``c``, in whose plane (to ``max_step`` [m]) c lies."""
    for k in range(len(clusters)):
        near = abs(clusters[k, 0] - clusters[c, 0]) <= step and abs(clusters[k, 1] - clusters[c, 1]) <= step
        if near and clusters[k, 8] > clusters[c, 8]:
            off = 0.0
            for i in range(3):
                off += (clusters[c, 2 + i] - clusters[k, 2 + i]) * clusters[k, 5 + i]
            if abs(off) <= max_step:
                return True
    return False


@njit(cache=True, nogil=True)
def _any_near(clusters, count, u, v, distance):
    found = False
    for c in range(count):
        found |= abs(clusters[c, 0] - u) < distance and abs(clusters[c, 1] - v) < distance
    return found


@njit(cache=True, nogil=True, error_model="numpy")
def assign_pixels(planes, clusters, step, weights, best, assignment):
    """Gives each healthy pixel to the cluster of least distance (equation 10) among those within ``step`` pixels.

    ``best``: float32 (h, w), work space. Distances are computed for BLOCK pixels at once, some of them beyond a window.
    """
    rows, columns = assignment.shape
    best[:] = np.inf
    assignment[:] = -1
    w_n, w_p, w_w = np.float32(weights[0]), np.float32(weights[1]), np.float32(weights[2])
    flat_planes, flat_best, flat_assignment = planes.ravel(), best.ravel(), assignment.ravel()
    distance = np.empty(min(columns, (2 * step + BLOCK) // BLOCK * BLOCK), np.float32)
    for c in range(len(clusters)):
        cluster = clusters[c].astype(np.float32)
        if not np.isfinite(cluster[5]):
            continue
        surface = (cluster[2], cluster[3], cluster[4], cluster[5], cluster[6], cluster[7])
        cu, cv = int(cluster[0]), int(cluster[1])
        first, last = max(0, cu - step), min(columns, cu + step + 1)
        begin = min(first, columns - len(distance))
        for v in range(max(0, cv - step), min(rows, cv + step + 1)):
            _row_distances(flat_planes, v * columns + begin, rows * columns, surface, w_n, w_p, w_w, distance)
            window = distance[first - begin : max(first, last) - begin]
            if weights[3] > 0:
                for k in range(len(window)):
                    window[k] += weights[3] * np.sqrt((cluster[0] - (first + k)) ** 2 + (cluster[1] - v) ** 2)
            _take_nearer(window, c, v * columns + first, flat_best, flat_assignment)


@njit(cache=True, nogil=True, error_model="numpy")
def _row_distances(planes, first, size, surface, w_n, w_p, w_w, distance):
    """Writes the distances (equation 10, without the one in the image) of neighbouring pixels; free of branches.

    ``planes``: flat, each of ``size`` pixels; ``first``: index of the first pixel in each; ``surface``: point and normal.
    """
    px, py, pz, m0, m1, m2 = surface
    # Unsigned, because what might be negative counts from the end, which the compiler would check for each pixel.
    one, s = np.float32(1.0), np.uint64(size)
    i0 = np.uint64(first)
    i1, i2, i3, i4, i5 = i0 + s, i0 + s * np.uint64(2), i0 + s * np.uint64(3), i0 + s * np.uint64(4), i0 + s * np.uint64(5)
    for i in range(len(distance)):
        k = np.uint64(i)
        dx, dy, dz = px - planes[i0 + k], py - planes[i1 + k], pz - planes[i2 + k]
        tilt = one - m0 * planes[i3 + k] - m1 * planes[i4 + k] - m2 * planes[i5 + k]
        off_plane = abs(dx * m0 + dy * m1 + dz * m2)
        distance[i] = w_n * tilt + w_p * off_plane + w_w * np.sqrt(dx * dx + dy * dy + dz * dz)


@njit(cache=True, nogil=True, error_model="numpy")
def _take_nearer(distance, c, first, best, assignment):
    """Hands the pixels from ``first`` on that are nearer to cluster ``c`` than ``best`` over to it; free of branches."""
    for i in range(len(distance)):
        k = np.uint64(first) + np.uint64(i)
        nearer = distance[i] < best[k]  # False where a pixel is not healthy
        best[k] = distance[i] if nearer else best[k]
        assignment[k] = np.int32(c) if nearer else assignment[k]


@njit(cache=True, nogil=True)
def group_pixels(assignment, count, active):
    """Returns (first, pixels): the flat indices ``active`` sorted by cluster; cluster c has pixels[first[c]:first[c+1]]."""
    flat = assignment.ravel()
    first = np.zeros(count + 1, np.int64)
    for i in active:
        if flat[i] >= 0:
            first[flat[i] + 1] += 1
    for c in range(count):
        first[c + 1] += first[c]
    cursor = first[:-1].copy()
    pixels = np.empty(first[count], np.int64)
    for i in active:
        if flat[i] >= 0:
            pixels[cursor[flat[i]]] = i
            cursor[flat[i]] += 1
    return first, pixels


@njit(cache=True, nogil=True)
def update_clusters(points, normals, assignment, active, clusters, ransac):
    """Moves each cluster to the mean of its pixels and refines its normal by RANSAC; one without pixels becomes NaN.

    ``ransac``: (planes tried at most, points for each, threshold [m], seed).
    """
    columns = np.uint32(assignment.shape[1])
    first, pixels = group_pixels(assignment, len(clusters), active)
    flat_points, flat_normals = points.reshape(-1, 3), normals.reshape(-1, 3)
    for c in range(len(clusters)):
        members = pixels[first[c] : first[c + 1]]
        u = v = x = y = z = n0 = n1 = n2 = 0.0
        for i in members:
            row = np.uint32(i) // columns
            u, v = u + (i - row * columns), v + row
            x, y, z = x + flat_points[i, 0], y + flat_points[i, 1], z + flat_points[i, 2]
            n0, n1, n2 = n0 + flat_normals[i, 0], n1 + flat_normals[i, 1], n2 + flat_normals[i, 2]
        length = np.sqrt(n0 * n0 + n1 * n1 + n2 * n2)
        if len(members) == 0 or not length > 0:
            clusters[c, :] = np.nan
            continue
        n = len(members)
        clusters[c, 0], clusters[c, 1] = u / n, v / n
        clusters[c, 2], clusters[c, 3], clusters[c, 4] = x / n, y / n, z / n
        clusters[c, 5], clusters[c, 6], clusters[c, 7] = n0 / length, n1 / length, n2 / length
        clusters[c, 8] = n
        if ransac[0] > 0 and n > ransac[1]:
            _refine_plane(flat_points, members, clusters[c], ransac, c)


@njit(cache=True, nogil=True)
def _refine_plane(points, members, cluster, ransac, stream):
    """Replaces normal and point of ``cluster`` by the plane y = a x + b z + d that most of its points agree on (eqs. 11-14).

    The point stays at the centroid in x and z, and moves onto the plane along gravity. Planes are tried until a better one
    is unlikely (Fischler and Bolles, 1981): on clean ground that is after the first.
    """
    tries, samples, threshold, seed = ransac
    state = np.uint64(seed) * np.uint64(2654435761) + np.uint64(stream + 1) * np.uint64(40503)
    tested = members[:: max(1, len(members) // MAX_RANSAC_POINTS)]
    best_count, best_a, best_b, best_d = 0, 0.0, 0.0, 0.0
    chosen = np.empty(samples, np.int64)
    for k in range(tries):
        for s in range(samples):
            state = state * np.uint64(6364136223846793005) + np.uint64(1442695040888963407)
            chosen[s] = members[int((state >> np.uint64(33)) % np.uint64(len(members)))]
        ok, a, b, d = _fit_plane(points, chosen, cluster, np.inf, 0.0, 0.0, 0.0)
        if not ok:
            continue
        count = 0
        limit = threshold * np.sqrt(a * a + b * b + 1.0)
        for i in tested:
            x, y, z = points[i, 0] - cluster[2], points[i, 1] - cluster[3], points[i, 2] - cluster[4]
            count += abs(a * x + b * z + d - y) <= limit
        if count > best_count:
            best_count, best_a, best_b, best_d = count, a, b, d
        if (1.0 - (best_count / len(tested)) ** samples) ** (k + 1) <= RANSAC_MISS:
            break
    if best_count == 0:
        return
    ok, a, b, d = _fit_plane(points, members, cluster, threshold, best_a, best_b, best_d)
    if ok:
        length = np.sqrt(a * a + b * b + 1.0)
        cluster[3] += d
        cluster[5], cluster[6], cluster[7] = a / length, -1.0 / length, b / length


@njit(cache=True, nogil=True)
def _fit_plane(points, chosen, cluster, threshold, a0, b0, d0):
    """Returns (ok, a, b, d): least squares y = a x + b z + d around the cluster's point, over ``chosen`` points that lie
    within ``threshold`` of the plane (a0, b0, d0)."""
    n = 0
    sx = sy = sz = sxx = sxz = szz = sxy = szy = 0.0
    limit = threshold * np.sqrt(a0 * a0 + b0 * b0 + 1.0)
    for i in chosen:
        x, y, z = points[i, 0] - cluster[2], points[i, 1] - cluster[3], points[i, 2] - cluster[4]
        if abs(a0 * x + b0 * z + d0 - y) > limit:
            continue
        n += 1
        sx, sy, sz = sx + x, sy + y, sz + z
        sxx, sxz, szz = sxx + x * x, sxz + x * z, szz + z * z
        sxy, szy = sxy + x * y, szy + z * y
    if n < 3:
        return False, 0.0, 0.0, 0.0
    cxx, cxz, czz = sxx - sx * sx / n, sxz - sx * sz / n, szz - sz * sz / n
    cxy, czy = sxy - sx * sy / n, szy - sz * sy / n
    determinant = cxx * czz - cxz * cxz
    if determinant < 1e-3 * (cxx + czz) ** 2 or determinant <= 0:  # nearly on a line
        return False, 0.0, 0.0, 0.0
    a = (czz * cxy - cxz * czy) / determinant
    b = (cxx * czy - cxz * cxy) / determinant
    return True, a, b, (sy - a * sx - b * sz) / n


@njit(cache=True, nogil=True)
def _find_connected(points, normals, assignment, other_points, other_normals, other_assignment, max_step, connected):
    """Writes which pixels of a row are of the same cluster as the ``other`` ones and connected with them.

    Each has to lie within ``max_step`` [m] of the other's tangent plane. Points and normals (3 columns,). Free of branches,
    for many columns at once.
    """
    for c in range(len(connected)):
        x, y, z = 3 * c, 3 * c + 1, 3 * c + 2
        d0, d1, d2 = other_points[x] - points[x], other_points[y] - points[y], other_points[z] - points[z]
        here = 0.0 + d0 * normals[x] + d1 * normals[y] + d2 * normals[z]
        there = 0.0 + d0 * other_normals[x] + d1 * other_normals[y] + d2 * other_normals[z]
        same = (assignment[c] >= 0) & (assignment[c] == other_assignment[c])
        connected[c] = same & (abs(here) <= max_step) & (abs(there) <= max_step)


@njit(cache=True, nogil=True, inline="always")
def _root(parent, i):
    while parent[i] != i:
        parent[i] = parent[parent[i]]
        i = parent[i]
    return i


@njit(cache=True, nogil=True)
def split_clusters(points, normals, assignment, active, max_step, min_pixels):
    """Renumbers ``assignment`` in place by connected components; small ones become -1. Returns how many there are.

    Two neighbouring pixels of a cluster are connected when each lies within ``max_step`` of the other's tangent plane.
    Runs of connected pixels in a row are joined with those above in one sweep (union and find); components are numbered by
    their first pixel, which is the first of their first run.
    """
    rows, columns = assignment.shape
    flat, area = assignment.ravel(), assignment.size
    run, parent, size = np.empty(area, np.int32), np.empty(area, np.int32), np.zeros(area, np.int32)
    left, up = np.zeros(columns, np.bool_), np.zeros(columns, np.bool_)
    runs = 0
    for v in range(rows):
        begin, row, p, n = v * columns, assignment[v], points[v].reshape(-1), normals[v].reshape(-1)
        _find_connected(p[3:], n[3:], row[1:], p, n, row, max_step, left[1:])
        if v > 0:
            above = points[v - 1].reshape(-1), normals[v - 1].reshape(-1), assignment[v - 1]
            _find_connected(p, n, row, *above, max_step, up)
        joined = -1  # the last run above that was joined with this one
        for u in range(columns):
            if row[u] < 0:
                continue
            if not left[u]:
                parent[runs], joined = runs, -1
                runs += 1
            run[begin + u] = runs - 1
            size[runs - 1] += 1
            if up[u] and run[begin + u - columns] != joined:
                joined = run[begin + u - columns]
                first, second = _root(parent, runs - 1), _root(parent, joined)
                parent[max(first, second)] = min(first, second)
    for r in range(runs):
        parent[r] = _root(parent, r)
        if parent[r] != r:
            size[parent[r]] += size[r]
    count, number = 0, np.empty(runs, np.int32)
    for r in range(runs):
        if parent[r] != r:
            number[r] = number[parent[r]]
        elif size[r] >= min_pixels:
            number[r] = count
            count += 1
        else:
            number[r] = -1
    for i in active:
        if flat[i] >= 0:
            flat[i] = number[run[i]]
    return count


@njit(cache=True, nogil=True)
def common_labels(assignment, labels, count):
    """Returns the most frequent label of each cluster, uint8 (count,)."""
    votes = np.zeros((count, 256), np.int32)
    for v in range(assignment.shape[0]):
        for u in range(assignment.shape[1]):
            if assignment[v, u] >= 0:
                votes[assignment[v, u], labels[v, u]] += 1
    result = np.zeros(count, np.uint8)
    for c in range(count):
        result[c] = np.argmax(votes[c])
    return result
