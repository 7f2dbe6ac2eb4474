"""A swinging foot carries no force (QuadPiPS eq. 19d): its three inputs are not free."""

from numba import njit


@njit(cache=True)
def zero_force(leg, u, change):
    """Writes the change of the input (24,) that brings the foot's force to zero. Returns the violation, squared."""
    violation = 0.0
    for i in range(3 * leg, 3 * leg + 3):
        change[i] = -u[i]
        violation += u[i] * u[i]
    return violation
