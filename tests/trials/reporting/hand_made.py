"""Trials made by hand: a robot that stands on level ground for two seconds, and what can go wrong with it."""

from pathlib import Path

import numpy as np

from quadpips_drake.math.constants import GRAVITY
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.robots.robot_model import LINK_NAMES
from quadpips_drake.terrain.library import load_terrain
from quadpips_drake.trials.reporting.trial_record import TrialRecord
from quadpips_drake.trials.result import TrialResult
from quadpips_drake.values.legs import Leg

STEP = 0.01
ROBOT = load_robot("anymal_c")
FLAT = load_terrain("flat", 0)
FEET = ROBOT.nominal_footholds_B + np.array([0.0, 0.0, ROBOT.nominal_base_height])


def standing_log(samples: int = 201, load: float = 1.0) -> dict[str, np.ndarray]:
    """All feet down; ``load``: on them, as part of the robot's weight."""
    time = np.round(STEP * np.arange(samples), 6)
    zeros = np.zeros((samples, 3))
    nothing = np.full((samples, 4, 3), np.nan)
    base = np.tile([0.0, 0.0, ROBOT.nominal_base_height], (samples, 1))
    share = [0.0, 0.0, 0.25 * load * GRAVITY * ROBOT.mass]
    return {
        "time": time,
        **{name: zeros.copy() for name in ("rpy_WB", "v_WB", "w_WB", "reference_rpy_WB")},
        "p_WB": base,
        "reference_p_WB": base.copy(),
        "joint_positions": np.tile(ROBOT.nominal_joints, (samples, 1)),
        "joint_velocities": np.zeros((samples, 12)),
        "joint_torques": np.zeros((samples, 12)),
        "contact_forces": np.tile(share, (samples, 4, 1)),
        "planned_forces": np.tile(share, (samples, 4, 1)),
        "contacts": np.ones((samples, 4), bool),
        "asked_contacts": np.ones((samples, 4), bool),
        "foot_positions": np.tile(FEET, (samples, 1, 1)),
        "foot_modes": np.zeros((samples, 4), int),
        "asked_feet": nothing,
        "asked_footholds": nothing.copy(),
        "swing_times": np.full((samples, 4, 2), np.nan),
        "touching": np.zeros((samples, len(LINK_NAMES)), bool),
        "touching_itself": np.full((samples, 2), -1, np.int8),
        "mpc_age": 0.01 * (np.arange(samples) % 2 + 1),
        "mpc_failures": np.zeros(samples, int),
        "wbc_failures": np.zeros(samples, int),
        "unstable": np.zeros(samples, np.int8),
        "note_time": np.zeros(0),
        "note_source": np.zeros(0, str),
        "note_text": np.zeros(0, str),
        "appeared_time": np.zeros(0),
        "appeared_low": np.zeros((0, 3)),
        "appeared_high": np.zeros((0, 3)),
    }


def with_sight(log: dict, measured: float = 0.6) -> dict:
    """The same of a run, whose camera has measured so much of its surroundings [1] and sees 20 regions."""
    samples = len(log["time"])
    labels = np.tile(np.array([0, 20, 0, 0], np.int16), (samples, 1))
    more = {"regions_stamp": log["time"], "region_labels": labels, "measured": np.full(samples, measured)}
    return log | more | {"phase": np.full(samples, 3)}


def falling(log: dict, since: float = 1.0, rate: float = 0.8) -> dict:
    """The same with a base that rolls from a time on [s], at so many rad/s."""
    log["rpy_WB"][:, 0] = np.maximum(0.0, rate * (log["time"] - since))
    return log


def sliding(log: dict, since: float, friction: float, speed: float = 0.5) -> dict:
    """The same with all feet sliding sideways from a time on [s] on ground of such a friction."""
    late = log["time"] >= since
    log["foot_positions"][:, :, 1] += speed * np.maximum(0.0, log["time"] - since)[:, None]
    log["contact_forces"][late, :, 1] = -friction * log["contact_forces"][late, :, 2]
    return log


def noting(log: dict, *notes: tuple[float, str, str]) -> dict:
    """The same with what systems said: (time [s], who, what)."""
    columns = list(zip(*notes, strict=True))
    return log | {f"note_{name}": np.array(column) for name, column in zip(("time", "source", "text"), columns, strict=True)}


def record(log: dict, reason: str = "fell", *, terrain=FLAT, config=None, walk: bool = True, **fields) -> TrialRecord:
    """A trial that has ended so."""
    fields = {"planner": "" if walk else "quadpips", "seed": 3, "sim_time": float(log["time"][-1]) if log else 0.0} | fields
    result = TrialResult(reason in ("upright", "goal_reached"), reason, ROBOT.name, terrain.name, **fields)
    return TrialRecord(Path("out/some trial"), result, log, ROBOT, terrain, config)


def lifted(log: dict, leg: Leg, liftoff: float, touchdown: float, height: float = 0.0) -> dict:
    """The same with one planned swing of a foot that really stays down; its foothold is ``height`` [m] too high."""
    rows = (log["time"] >= liftoff - 1e-9) & (log["time"] < touchdown - 1e-9)
    log["asked_contacts"][rows, leg] = False
    log["asked_feet"][rows, leg] = log["foot_positions"][rows, leg] + [0.0, 0.0, 0.05]
    log["asked_footholds"][rows, leg] = log["foot_positions"][rows, leg] + [0.0, 0.0, height]
    log["swing_times"][rows, leg] = liftoff, touchdown
    return log
