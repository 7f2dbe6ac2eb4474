"""Which gait a plan needs: pairs of legs where the ground is generous, single swings where it is steep, narrow or uneven."""

from dataclasses import replace

import numpy as np

from quadpips_drake.gaits.swing_gaits import SwingGait, swing_gait
from quadpips_drake.math.rotations import yaw_matrix
from quadpips_drake.planning.footholds.foothold_config import FootholdConfig
from quadpips_drake.values.legs import Leg


def gait_to_search(config: FootholdConfig) -> SwingGait:
    """Returns the gait of a search; one in any order has the swings of the careful gait too if they take as long."""
    gait, careful = swing_gait(config.gait), swing_gait(config.careful_gait)
    alike = (gait.swing_duration, gait.stance_duration) == (careful.swing_duration, careful.stance_duration)
    if not (config.any_order and alike):
        return gait
    return replace(gait, phases=tuple(dict.fromkeys(gait.phases + careful.phases)))


def need_of_care(feet: np.ndarray, rpy: np.ndarray, config: FootholdConfig) -> str:
    """Says why the swings of a plan should be made one by one; empty when pairs of legs may swing.

    On two legs a robot tips over about the line between them. That matters most when it must lift its feet high meanwhile,
    when the line is all that a narrow stance leaves of its support, and when it has to roll from stance to stance.

    Args:
        feet: ground points of the plan's stances in W [m], (n, 4, 3).
        rpy: roll, pitch, yaw of the base above them [rad], (n, 3).
        config: with the limits.
    """
    if len(feet) < 2:
        return ""
    rise = np.abs(np.diff(feet[:, :, 2], axis=0)).max()
    if rise > config.careful_rise:
        return f"a foot rises or sinks by {rise:.2f} m"
    roll = np.abs(np.diff(rpy[:, 0])).max()
    if roll > config.careful_roll:
        return f"the base rolls by {roll:.2f} rad"
    heading = np.array([yaw_matrix(yaw)[:, 1] for yaw in rpy[:, 2]])
    across = np.einsum("nlk,nk->nl", feet, heading)
    # The first stance is there already, whatever comes.
    width = min((across[1:, Leg.LF] - across[1:, Leg.RF]).min(), (across[1:, Leg.LH] - across[1:, Leg.RH]).min())
    return f"a stance is {width:.2f} m wide" if width < config.careful_width else ""
