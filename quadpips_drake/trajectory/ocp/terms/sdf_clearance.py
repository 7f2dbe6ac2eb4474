"""Knees and trunk stay clear of the ground: spheres against its signed distance, as relaxed barriers in the cost.

After R. Grandia et al., "Perceptive Locomotion through Nonlinear Model-Predictive Control" (T-RO 2023), whose barrier pushes
at any distance, and with it the whole robot upward. Here it is bent so that it ends, with its slope, at ``reach``: what is
further from the ground than that does not notice it.
"""

import numpy as np
from numba import njit

from quadpips_drake.math.small_algebra import add, cross, dot, subtract, times, vector
from quadpips_drake.math.trilinear import trilinear
from quadpips_drake.trajectory.centroidal.centroidal_kernels import ANGLES, JOINTS, POSITION
from quadpips_drake.trajectory.ocp.terms.relaxed_barrier import add_along, relaxed_barrier


@njit(cache=True)
def _add_sphere(center, radius, leg, x, geometry, ground, barrier, weight, columns, gradient, hessian, linear):
    """Adds the barrier of one sphere at ``center`` in B, which joints of ``leg`` move; -1: none do. Returns the cost.

    Beyond ``reach``, or where the distance is not known, there is none. ``columns``, ``gradient``: room for 8 numbers.
    """
    rotation, rotation_angles, axes, origins = geometry
    samples, origin, step = ground
    mu, delta, reach = barrier
    place = add(vector(x[POSITION:]), times(rotation, center))
    inside, distance, slope_x, slope_y, slope_z = trilinear(samples, origin, step, place[0], place[1], place[2])
    h = distance - radius
    if not inside or h >= reach:
        return 0.0
    slope = (slope_x, slope_y, slope_z)
    for i in range(3):
        columns[i], columns[3 + i] = POSITION + i, ANGLES + i
        gradient[i], gradient[3 + i] = slope[i], dot(slope, times(rotation_angles[i], center))
    for i in range(2):
        columns[6 + i], gradient[6 + i] = JOINTS + max(3 * leg, 0) + i, 0.0
        if leg >= 0:
            joint = 3 * leg + i
            moved = cross(vector(axes[joint]), subtract(center, vector(origins[joint])))
            gradient[6 + i] = dot(slope, times(rotation, moved))
    value, first, second = relaxed_barrier(h, mu, delta)
    value, first = value + mu * (np.log(reach) + h / reach - 1.0), first + mu / reach
    add_along(gradient, columns, weight * first, weight * second, hessian, linear)
    return weight * value


@njit(cache=True)
def add_sdf_clearance(x, geometry, ground, corners, radii, barrier, weight, hessian, linear):
    """Adds barriers on distance - radius >= 0 for all knees and trunk corners. Returns the cost.

    Args:
        x: state (24,).
        geometry: rotation of the base (3, 3), its derivatives by roll, pitch, yaw (3, 3, 3), joint axes and joint origins in
            B (12, 3).
        ground: distances (n, m, k), origin (3,) and step of a SignedDistance.
        corners: of the trunk in B [m], (c, 3).
        radii: of the spheres at knees and corners [m].
        barrier: mu, delta and reach.
        weight: of the cost.
        hessian, linear: the quadratic model in [x; u].
    """
    columns, gradient = np.empty(8, np.int64), np.empty(8)
    origins, cost = geometry[3], 0.0
    for leg in range(4):
        knee = vector(origins[3 * leg + 2])
        cost += _add_sphere(knee, radii[0], leg, x, geometry, ground, barrier, weight, columns, gradient, hessian, linear)
    for corner in range(len(corners)):
        center = vector(corners[corner])
        cost += _add_sphere(center, radii[1], -1, x, geometry, ground, barrier, weight, columns, gradient, hessian, linear)
    return cost
