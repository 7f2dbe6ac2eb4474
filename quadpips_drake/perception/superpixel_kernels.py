"""The inner loops of the superpixels. A row of ``clusters`` is [u, v, p (3), n (3)]: pixel, point and unit normal in E."""

import numpy as np
from numba import njit

MAX_RANSAC_POINTS = 64
"""Points of a cluster against which a plane is tried; the final fit uses all of them."""


@njit(cache=True)
def supported_pixels(points, normals, healthy, max_step):
    """Returns the ``healthy`` pixels that continue to at least two of their four neighbours, bool (h, w).

    A neighbour continues a pixel when it is healthy and within ``max_step`` [m] of its tangent plane.
    """
    rows, columns = healthy.shape
    supported = np.zeros((rows, columns), np.bool_)
    for v in range(rows):
        for u in range(columns):
            if not healthy[v, u]:
                continue
            n0, n1, n2 = normals[v, u, 0], normals[v, u, 1], normals[v, u, 2]
            offset = n0 * points[v, u, 0] + n1 * points[v, u, 1] + n2 * points[v, u, 2]
            count = 0
            for b, a in ((v - 1, u), (v + 1, u), (v, u - 1), (v, u + 1)):
                if 0 <= b < rows and 0 <= a < columns and healthy[b, a]:
                    off = n0 * points[b, a, 0] + n1 * points[b, a, 1] + n2 * points[b, a, 2] - offset
                    count += abs(off) <= max_step
            supported[v, u] = count >= 2
    return supported


@njit(cache=True)
def seed_clusters(points, normals, healthy, step):
    """Returns clusters on a grid of ``step`` pixels, moved to the healthy pixel nearest to the local centroid (V-D.3)."""
    rows, columns = healthy.shape
    clusters = np.empty(((rows // step + 1) * (columns // step + 1), 8))
    count = 0
    reach = max(1, step // 4)
    for v0 in range(step // 2, rows, step):
        for u0 in range(step // 2, columns, step):
            n, su, sv = 0, 0.0, 0.0
            window = (max(0, v0 - reach), min(rows, v0 + reach + 1), max(0, u0 - reach), min(columns, u0 + reach + 1))
            for v in range(window[0], window[1]):
                for u in range(window[2], window[3]):
                    if healthy[v, u]:
                        n, su, sv = n + 1, su + u, sv + v
            if n == 0:
                continue
            best, best_u, best_v = np.inf, u0, v0
            for v in range(window[0], window[1]):
                for u in range(window[2], window[3]):
                    off = (u - su / n) ** 2 + (v - sv / n) ** 2
                    if healthy[v, u] and off < best:
                        best, best_u, best_v = off, u, v
            clusters[count, 0], clusters[count, 1] = best_u, best_v
            clusters[count, 2:5] = points[best_v, best_u]
            clusters[count, 5:8] = normals[best_v, best_u]
            count += 1
    return clusters[:count].copy()


@njit(cache=True)
def assign_pixels(points, normals, healthy, clusters, step, weights, assignment):
    """Gives each healthy pixel to the cluster of least distance (equation 10) among those within ``step`` pixels."""
    rows, columns = healthy.shape
    best = np.full((rows, columns), np.inf, np.float32)
    w_n, w_p, w_w, w_c = weights
    assignment[:] = -1
    for c in range(len(clusters)):
        cu, cv, px, py, pz, nx, ny, nz = clusters[c]
        if np.isnan(nx):
            continue
        for v in range(max(0, int(cv) - step), min(rows, int(cv) + step + 1)):
            for u in range(max(0, int(cu) - step), min(columns, int(cu) + step + 1)):
                if not healthy[v, u]:
                    continue
                dx, dy, dz = px - points[v, u, 0], py - points[v, u, 1], pz - points[v, u, 2]
                distance = w_n * (1.0 - nx * normals[v, u, 0] - ny * normals[v, u, 1] - nz * normals[v, u, 2])
                distance += w_p * abs(dx * nx + dy * ny + dz * nz) + w_w * np.sqrt(dx * dx + dy * dy + dz * dz)
                if w_c > 0:
                    distance += w_c * np.sqrt((cu - u) ** 2 + (cv - v) ** 2)
                if distance < best[v, u]:
                    best[v, u] = distance
                    assignment[v, u] = c


@njit(cache=True)
def group_pixels(assignment, count):
    """Returns (first, pixels): flat pixel indices sorted by cluster; those of cluster c are pixels[first[c]:first[c+1]]."""
    flat = assignment.ravel()
    first = np.zeros(count + 1, np.int64)
    for i in range(flat.size):
        if flat[i] >= 0:
            first[flat[i] + 1] += 1
    for c in range(count):
        first[c + 1] += first[c]
    cursor = first[:-1].copy()
    pixels = np.empty(first[count], np.int64)
    for i in range(flat.size):
        if flat[i] >= 0:
            pixels[cursor[flat[i]]] = i
            cursor[flat[i]] += 1
    return first, pixels


@njit(cache=True)
def update_clusters(points, normals, assignment, clusters, ransac):
    """Moves each cluster to the mean of its pixels and refines its normal by RANSAC; one without pixels becomes NaN."""
    columns = assignment.shape[1]
    first, pixels = group_pixels(assignment, len(clusters))
    flat_points, flat_normals = points.reshape(-1, 3), normals.reshape(-1, 3)
    for c in range(len(clusters)):
        members = pixels[first[c] : first[c + 1]]
        clusters[c, :] = 0.0
        for i in members:
            clusters[c, 0] += i % columns
            clusters[c, 1] += i // columns
            for k in range(3):
                clusters[c, 2 + k] += flat_points[i, k]
                clusters[c, 5 + k] += flat_normals[i, k]
        length = np.sqrt(clusters[c, 5] ** 2 + clusters[c, 6] ** 2 + clusters[c, 7] ** 2)
        if len(members) == 0 or length == 0:
            clusters[c, :] = np.nan
            continue
        clusters[c, :5] /= len(members)
        clusters[c, 5:] /= length
        if ransac[0] > 0 and len(members) > ransac[1]:
            _refine_plane(flat_points, members, clusters[c], ransac, c)


@njit(cache=True)
def _refine_plane(points, members, cluster, ransac, stream):
    """Replaces normal and point of ``cluster`` by the plane y = a x + b z + d that most of its points agree on.

    The point stays at the centroid in x and z, and moves onto the plane along gravity.
    """
    tries, samples, threshold, seed = ransac
    state = np.uint64(seed) * np.uint64(2654435761) + np.uint64(stream + 1) * np.uint64(40503)
    stride = max(1, len(members) // MAX_RANSAC_POINTS)
    best_count, best_a, best_b, best_d = 0, 0.0, 0.0, 0.0
    chosen = np.empty(samples, np.int64)
    for _ in range(tries):
        for s in range(samples):
            state = state * np.uint64(6364136223846793005) + np.uint64(1442695040888963407)
            chosen[s] = members[int((state >> np.uint64(33)) % np.uint64(len(members)))]
        ok, a, b, d = _fit_plane(points, chosen, cluster, np.inf, 0.0, 0.0, 0.0)
        if not ok:
            continue
        count = 0
        limit = threshold * np.sqrt(a * a + b * b + 1.0)
        for i in members[::stride]:
            x, y, z = points[i, 0] - cluster[2], points[i, 1] - cluster[3], points[i, 2] - cluster[4]
            if abs(a * x + b * z + d - y) <= limit:
                count += 1
        if count > best_count:
            best_count, best_a, best_b, best_d = count, a, b, d
    if best_count == 0:
        return
    ok, a, b, d = _fit_plane(points, members, cluster, threshold, best_a, best_b, best_d)
    if ok:
        length = np.sqrt(a * a + b * b + 1.0)
        cluster[3] += d
        cluster[5], cluster[6], cluster[7] = a / length, -1.0 / length, b / length


@njit(cache=True)
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


@njit(cache=True)
def split_clusters(points, normals, assignment, max_step, min_pixels):
    """Renumbers ``assignment`` in place by connected components; small ones become -1. Returns how many there are.

    Two neighbouring pixels of a cluster are connected when each lies within ``max_step`` of the other's tangent plane.
    """
    rows, columns = assignment.shape
    source = assignment.copy()
    assignment[:] = -1
    visited = np.zeros((rows, columns), np.bool_)
    queue = np.empty((rows * columns, 2), np.int32)
    count = 0
    for v0 in range(rows):
        for u0 in range(columns):
            if source[v0, u0] < 0 or visited[v0, u0]:
                continue
            head, tail = 0, 1
            queue[0, 0], queue[0, 1] = v0, u0
            visited[v0, u0] = True
            while head < tail:
                v, u = queue[head]
                head += 1
                for dv, du in ((-1, 0), (1, 0), (0, -1), (0, 1)):
                    b, a = v + dv, u + du
                    if b < 0 or a < 0 or b >= rows or a >= columns or visited[b, a] or source[b, a] != source[v0, u0]:
                        continue
                    here = there = 0.0
                    for k in range(3):
                        difference = points[b, a, k] - points[v, u, k]
                        here += difference * normals[v, u, k]
                        there += difference * normals[b, a, k]
                    if abs(here) <= max_step and abs(there) <= max_step:
                        visited[b, a] = True
                        queue[tail, 0], queue[tail, 1] = b, a
                        tail += 1
            if tail >= min_pixels:
                for i in range(tail):
                    assignment[queue[i, 0], queue[i, 1]] = count
                count += 1
    return count


@njit(cache=True)
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
