"""Terminal cost ||x_N - x_des||_Qf^2 with Q_f from a linear-quadratic regulator (QuadPiPS section VI-D)."""

import numpy as np

from quadpips_drake.values.centroidal import CentroidalState


def regulator_cost(dynamics_x, dynamics_u, hessian, steps: int) -> np.ndarray:
    """Returns the cost-to-go matrix of a linear-quadratic problem over ``steps`` steps, by Riccati's recursion.

    dynamics_x (n, n), dynamics_u (n, m); ``hessian`` (n + m, n + m) of the stage cost in [x, u], cross terms included. A
    finite horizon instead of the algebraic equation: directions that no input can reach (a foot that stands wrong) do not
    spoil it, their cost just adds up.
    """
    n = len(dynamics_x)
    state, cross, inputs = hessian[:n, :n], hessian[n:, :n], hessian[n:, n:]
    cost = state.copy()
    for _ in range(steps):
        to_next = cost @ dynamics_x
        mixed = cross + dynamics_u.T @ to_next
        gain = np.linalg.solve(inputs + dynamics_u.T @ cost @ dynamics_u, mixed)
        cost = state + dynamics_x.T @ to_next - mixed.T @ gain
        cost = 0.5 * (cost + cost.T)
    return cost


def turned_to_yaw(cost: np.ndarray, yaw: float) -> np.ndarray:
    """Returns the cost matrix (24, 24), computed for a robot that faces x, for one that faces ``yaw`` [rad].

    Momenta and position are vectors in W and turn with the robot; angles' errors and joints stay what they are.
    """
    turn = np.eye(len(cost))
    c, s = np.cos(yaw), np.sin(yaw)
    for part in (CentroidalState.LINEAR, CentroidalState.ANGULAR, CentroidalState.POSITION):
        x, y = part.start, part.start + 1
        turn[x, x], turn[x, y], turn[y, x], turn[y, y] = c, s, -s, c
    return turn.T @ cost @ turn
