"""What trajectories cost and violate, without derivatives: for steps that may be too long."""

import numpy as np
from numba import njit

from quadpips_drake.trajectory.centroidal.centroidal_kernels import knot_motion
from quadpips_drake.trajectory.ocp.knot_kernels import INPUTS, STATES, input_constraints, stage_cost


@njit(cache=True, nogil=True)
def evaluate_knots(parameters, task, states, inputs):
    """Returns sums over all knots of what ``approximate_knots`` calls costs and violations, at a quarter of its price."""
    f, middle, change = np.empty(STATES), np.empty(STATES), np.empty(INPUTS)
    p, v, p_mid, v_mid = np.empty((4, 3)), np.empty((4, 3)), np.empty((4, 3)), np.empty((4, 3))
    # The terms want to add derivatives, too. They get none and add to nothing.
    no_x, no_u, no_angles = np.zeros((4, 3, STATES)), np.zeros((4, 3, INPUTS)), np.zeros((3, 3, 3))
    hessian, linear = np.zeros((STATES + INPUTS, STATES + INPUTS)), np.zeros(STATES + INPUTS)
    by_state, by_rates, residual = np.empty((12, STATES)), np.empty((12, 12)), np.empty(12)
    feet = (p, v, no_x, no_x, no_u)
    cost, violation = 0.0, 0.0
    for k in range(len(inputs)):
        x, u, dt = states[k], inputs[k], task.times[k + 1] - task.times[k]
        rotation, _, kinematics = knot_motion(parameters.tree, x, u, f, p, v)
        for i in range(STATES):
            middle[i] = x[i] + 0.5 * dt * f[i]
        knot_motion(parameters.tree, middle, u, f, p_mid, v_mid)
        for i in range(STATES):
            violation += (x[i] + dt * f[i] - states[k + 1, i]) ** 2
        geometry = (rotation, no_angles, kinematics)
        cost += stage_cost(parameters, task, k, x, u, dt, feet, geometry, hessian, linear)
        _, broken = input_constraints(parameters, task, k, u, dt, feet, change, by_state, by_rates, residual)
        violation += dt * broken
    return cost, violation
