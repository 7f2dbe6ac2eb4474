"""Last moments made by hand: a robot that stands, trots or does something wrong."""

from dataclasses import replace

import numpy as np

from quadpips_drake.robots.robot_model import LINK_NAMES
from quadpips_drake.trials.explaining.last_moments import LastMoments
from quadpips_drake.values.legs import Leg

RADIUS = 0.03
STEP = 0.01


def standing(samples: int = 201) -> LastMoments:
    """All feet down on level ground, exactly where they are to be."""
    feet = np.tile([[0.3, 0.2, RADIUS], [0.3, -0.2, RADIUS], [-0.3, 0.2, RADIUS], [-0.3, -0.2, RADIUS]], (samples, 1, 1))
    base = np.tile([0.0, 0.0, 0.5, 0.0, 0.0, 0.0], (samples, 1))
    nothing = np.full((samples, 4, 3), np.nan)
    return LastMoments(
        time=np.round(STEP * np.arange(samples), 6),
        base=base,
        asked_base=base.copy(),
        feet=feet,
        asked_feet=nothing,
        footholds=nothing.copy(),
        swing_times=np.full((samples, 4, 2), np.nan),
        contacts=np.ones((samples, 4), bool),
        touches=np.zeros((samples, len(LINK_NAMES)), bool),
        asked_contacts=np.ones((samples, 4), bool),
        forces=np.tile([0.0, 0.0, 120.0], (samples, 4, 1)),
        joints=np.zeros((samples, 12)),
        joint_limits=np.array([[-1.0] * 12, [1.0] * 12]),
        torques=np.zeros((samples, 12)),
        torque_limits=np.full(12, 80.0),
        joint_names=tuple(f"{leg.name}_{kind}" for leg in Leg for kind in ("HAA", "HFE", "KFE")),
        ground=np.zeros((samples, 4)),
        foothold_ground=np.full((samples, 4), np.nan),
        foot_radius=RADIUS,
    )


def with_swing(moments: LastMoments, leg: Leg, liftoff: float, touchdown: float) -> LastMoments:
    """The same with one swing of a foot, 0.2 m forward and 0.1 m high, which goes as it is to go."""
    moments = replace(
        moments, **{name: value.copy() for name, value in vars(moments).items() if isinstance(value, np.ndarray)}
    )
    rows = np.flatnonzero((moments.time >= liftoff - 1e-9) & (moments.time < touchdown - 1e-9))
    part = (moments.time[rows] - liftoff) / (touchdown - liftoff)
    way = moments.feet[rows, leg] + np.column_stack((0.2 * part, 0.0 * part, 0.1 * np.sin(np.pi * part)))
    moments.footholds[rows, leg] = moments.feet[rows[0], leg] + (0.2, 0.0, 0.0)
    moments.feet[rows[-1] + 1 :, leg, 0] += 0.2
    moments.feet[rows, leg] = moments.asked_feet[rows, leg] = way
    moments.swing_times[rows, leg] = liftoff, touchdown
    moments.contacts[rows, leg] = moments.asked_contacts[rows, leg] = False
    moments.forces[rows, leg] = 0.0
    moments.foothold_ground[rows, leg] = 0.0
    return moments


def touching(moments: LastMoments, leg: Leg, since: float, until: float, *, height: float, force) -> LastMoments:
    """The same with a foot that touches the ground at ``height`` [m] between two times [s], with a ``force`` (3,) [N]."""
    rows = (moments.time >= since - 1e-9) & (moments.time < until - 1e-9)
    moments.contacts[rows, leg], moments.forces[rows, leg] = True, force
    moments.feet[rows, leg, 2], moments.ground[rows, leg] = height + RADIUS, height
    return moments


def free(moments: LastMoments, leg: Leg, since: float, until: float) -> LastMoments:
    """The same with a foot that touches nothing between two times [s]."""
    rows = (moments.time >= since - 1e-9) & (moments.time < until - 1e-9)
    moments.contacts[rows, leg], moments.forces[rows, leg] = False, 0.0
    return moments


def tilting(moments: LastMoments, since: float, rate: float) -> LastMoments:
    """The same with a base that rolls from a time on [s], at so many rad/s."""
    moments.base[:, 3] += np.maximum(0.0, rate * (moments.time - since))
    return moments


def sliding(moments: LastMoments, leg: Leg, since: float, speed: float) -> LastMoments:
    """The same with a foot that slides sideways from a time on [s], at so many m/s."""
    moments.feet[:, leg, 1] += np.maximum(0.0, speed * (moments.time - since))
    return moments
