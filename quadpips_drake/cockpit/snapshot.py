"""What the page is told: one moment of a live trial, in plain numbers and words."""

from dataclasses import dataclass, field

import numpy as np

from quadpips_drake.cockpit.choices import Choice
from quadpips_drake.cockpit.live_trial import LiveTrial
from quadpips_drake.cockpit.map_view import MapView
from quadpips_drake.values.centroidal import CentroidalState
from quadpips_drake.values.reference import WholeBodyReference

_PATH_POINTS = 40
"""At most so many points of the path are told."""


@dataclass(frozen=True)
class Snapshot:
    """Lengths in m, angles in rad, times in s, frame W."""

    state: str
    """"building", "running", "paused" or "over"."""
    note: str = ""
    """How it ended, or why it could not begin."""
    choice: Choice = field(default_factory=Choice)
    number: int = 0
    """Of the trial: 1 for the first."""
    time: float = 0.0
    factor: float = 0.0
    """Real-time factor of the last seconds."""
    speed: float | None = 1.0
    """Largest one; None: as fast as possible."""
    phase: str = ""
    reason: str = ""
    """What the planner is about, and why."""
    counts: dict = field(default_factory=dict)
    """Replans, fallbacks and events so far: {name: count}."""
    position: tuple = ()
    """Of the base, x, y, z."""
    rpy: tuple = ()
    velocity: tuple = ()
    """Forward, left, and turn, in the heading frame."""
    feet: tuple = ()
    """x, y, and whether it stands (1 or 0), of each leg."""
    goal: tuple | None = None
    path: tuple = ()
    """x, y of the base's reference."""
    footholds: tuple = ()
    """Leg, x, y of those that come."""
    gait: str = ""
    command: tuple = ()
    """Velocity that is commanded."""
    push: tuple = (0.0, 0.0, 0.0)
    """Force on the base now [N]."""
    torque: float = 0.0
    """Largest joint torque as a part of its limit."""
    stock: dict = field(default_factory=dict)
    """What there still is to be put in the way."""
    layers: dict = field(default_factory=dict)
    view: tuple = ()
    """What the map shows: x_min, x_max, y_min, y_max."""
    pictures: dict = field(default_factory=dict)
    """{name: version} of the pictures that there are."""
    timings: dict = field(default_factory=dict)
    """{stage: (n, median, 95th percentile, largest)} of the last computations [ms]."""
    happenings: tuple = ()


def seen(live: LiveTrial, map_view: MapView) -> dict:
    """What there is to see at this moment: fields of a Snapshot."""
    observation = live.observe()
    state, status, command = observation.robot_state, live.port("status"), live.port("velocity_command")
    counts = dict(observation.fallbacks)
    if status is not None:
        counts |= {"replans": status.replans, **status.fallbacks, **status.events}
    cos, sin = np.cos(state.rpy_WB[2]), np.sin(state.rpy_WB[2])
    vx, vy = state.v_WB[:2]
    feet = np.column_stack((observation.foot_positions[:, :2], state.contacts))
    return {
        "time": state.stamp,
        "phase": "" if status is None else str(status.phase).replace("_", " "),
        "reason": "" if status is None else status.reason,
        "counts": {name: int(count) for name, count in counts.items() if count},
        "position": _rounded(state.p_WB),
        "rpy": _rounded(state.rpy_WB),
        "velocity": _rounded((cos * vx + sin * vy, cos * vy - sin * vx, state.w_WB[2])),
        "feet": tuple(_rounded(foot) for foot in feet),
        "goal": None if live.goal is None else _rounded(live.goal),
        "path": _path(observation.reference),
        "footholds": tuple(
            (int(f.leg), *_rounded(f.position[:2]))
            for f in observation.reference.footholds
            if f.touchdown_time > state.stamp
        ),
        "gait": live.port("gait") or "",
        "command": () if command is None else _rounded(command),
        "push": _rounded(live.pushing()),
        "torque": round(float(np.max(np.abs(state.joint_torques) / live.trial.robot.effort_limits)), 3),
        "stock": live.stock.left(),
        "layers": dict(live.layers),
        "view": map_view.view,
    }


def timings_of(live: LiveTrial) -> dict:
    """Of all stages, as Snapshot has them."""
    summary = live.trial.timings.summary_ms()
    return {stage: tuple(round(row[key], 2) for key in ("n", "p50", "p95", "max")) for stage, row in summary.items()}


def _rounded(values) -> tuple:
    return tuple(round(float(value), 3) for value in values)


def _path(reference: WholeBodyReference) -> tuple:
    states = reference.states[:: max(1, len(reference.states) // _PATH_POINTS)]
    return tuple(_rounded(point) for point in states[:, CentroidalState.POSITION][:, :2])
