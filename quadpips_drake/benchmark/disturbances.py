"""What a walk can be hit by, each in a size that can be bisected."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import numpy as np

from quadpips_drake.gaits.gaits import load_gait
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.terrain import library
from quadpips_drake.terrain.files.terrain_file import write_terrain_file

PUSH_TIME = 3.0
"""When pushes begin [s], counted from a whole number of cycles."""
PUSH_DURATION = 0.1
"""[s]"""
PUSH_PHASES = 5
"""Phases of the gait at which a push is tried."""
SPEED = 0.3
"""Of the walk, on average over seeds [m/s]."""


@dataclass(frozen=True)
class Disturbance:
    """One kind of disturbance; ``least`` is harmless, ``most`` more than is hoped for."""

    unit: str
    least: float
    most: float
    resolution: float
    target: dict
    """What is aimed at, by robot."""
    trial: Callable
    """(size, robot, folder for files, random generator) -> options for WalkTrialConfig and ``--set`` texts."""
    extra: dict = field(default_factory=dict)
    """Other ``most`` for some robots."""

    def largest(self, robot: str) -> float:
        """The largest size to try."""
        return self.extra.get(robot, self.most)


def trial_options(name: str, size: float, robot: str, folder: Path, seed: int) -> tuple[dict, list[str]]:
    """Options for WalkTrialConfig, and ``--set`` texts, of one trial.

    The seed decides where and in which direction the walk starts (5 cm, 0.05 rad), how fast it is (10 %), when exactly in
    its fifth of a cycle a push comes, to which side it and a turn go, and the columns of uneven ground.
    """
    rng = np.random.default_rng([seed, list(DISTURBANCES).index(name)])
    speed = SPEED * rng.uniform(0.9, 1.1)
    options, sets = DISTURBANCES[name].trial(size, robot, folder, rng)
    if "start" in options:
        x, y, yaw = options["start"]
        options["start"] = [x + rng.uniform(-0.05, 0.05), y + rng.uniform(-0.05, 0.05), yaw + rng.uniform(-0.05, 0.05)]
        options |= {"start_position_noise": 0.0, "start_yaw_noise": 0.0}  # it has been moved already
    for change in options.get("changes", ()):
        change["velocity"][0] *= speed / SPEED
    return {"robot": robot, "gait": "trot", "velocity": [speed, 0.0, 0.0], "seed": seed, **options}, sets


def _push(phase: int, size: float, robot: str, folder: Path, rng):
    gait = load_gait("trot")
    time = PUSH_TIME + gait.duration * (phase + rng.uniform(-0.5, 0.5)) / PUSH_PHASES
    force = [0.0, float(rng.choice([-1.0, 1.0])) * size / PUSH_DURATION, 0.0]
    return {"pushes": [{"force": force, "time": time, "duration": PUSH_DURATION}], "duration": time + 3.0}, []


def _friction(size: float, robot: str, folder: Path, rng):
    # Slipperiness is bisected, so that more is worse: 1 - mu.
    return {"duration": 6.0}, [f"stages.station.model_error.friction={1.0 - size}"]


def _slope(way: str, size: float, robot: str, folder: Path, rng):
    path = folder / f"slope_{size:.2f}.yaml"
    write_terrain_file(library.slope(angle=math.radians(size)), path)
    run = 3.0 * math.cos(math.radians(size))
    options = {"terrain": str(path), "duration": 9.0, "start": [-0.7, 0.0, 0.0]}
    if way == "down":
        options["start"] = [run + 1.2, 0.0, 0.0]
    if way == "across":
        options["duration"] = 13.0
        options["changes"] = [
            {"time": 5.5, "gait": "trot", "velocity": [0.0, 0.0, float(rng.choice([-0.5, 0.5]))]},
            {"time": 8.8, "gait": "trot", "velocity": [SPEED, 0.0, 0.0]},
        ]
    return options, []


def _bumps(size: float, robot: str, folder: Path, rng):
    field_seed = int(rng.integers(1000000))
    path = folder / f"bumps_{size:.4f}_{field_seed}.yaml"
    write_terrain_file(library.bumps(height=size, seed=field_seed), path)
    return {"terrain": str(path), "duration": 11.0}, []


def _model(key: str, duration: float, size: float, robot: str, folder: Path, rng):
    return {"duration": duration}, [f"{key}={size}"]


def _height_error(sign: float, size: float, robot: str, folder: Path, rng):
    return {"duration": 6.0}, [f"stages.tracking.faults.terrain_height_error={sign * size}"]


def _payload(size: float, robot: str, folder: Path, rng):
    return {"duration": 6.0}, [f"stages.station.model_error.payload={size * load_robot(robot).mass}"]


def _solver_fault(size: float, robot: str, folder: Path, rng):
    start = PUSH_TIME + rng.uniform(0.0, load_gait("trot").duration)
    outage = "stages.tracking.faults.outage"
    return {"duration": start + 3.0}, [f"{outage}_start=[{start}]", f"{outage}_duration={size}"]


def _disturbances() -> dict[str, Disturbance]:
    both = ("anymal_c", "go2")
    table = {
        f"push_phase_{phase}": Disturbance(
            "N s", 0.0, 60.0, 1.0, {"anymal_c": 25.0, "go2": 7.0}, partial(_push, phase), {"go2": 20.0}
        )
        for phase in range(PUSH_PHASES)
    }
    table["slipperiness"] = Disturbance("1 - mu", 0.0, 0.9, 0.05, dict.fromkeys(both, 0.6), _friction)
    for way in ("up", "down", "across"):
        table[f"slope_{way}"] = Disturbance("deg", 1.0, 25.0, 2.0, dict.fromkeys(both, 15.0), partial(_slope, way))
    table["bumps"] = Disturbance("m", 0.001, 0.08, 0.005, dict.fromkeys(both, 0.03), _bumps)
    table["payload"] = Disturbance("of the mass", 0.0, 0.6, 0.05, dict.fromkeys(both, 0.2), _payload)
    delay = partial(_model, "stages.tracking.mpc.latency", 6.0)
    table["mpc_delay"] = Disturbance("s", 0.0, 0.1, 0.01, dict.fromkeys(both, 0.02), delay)
    late = partial(_model, "stages.station.model_error.actuator_delay", 6.0)
    table["actuator_delay"] = Disturbance("s", 0.0, 0.04, 0.002, dict.fromkeys(both, 0.0), late)
    table["solver_fault"] = Disturbance("s", 0.0, 0.6, 0.05, dict.fromkeys(both, 0.1), _solver_fault)
    for way, sign in (("higher", 1.0), ("lower", -1.0)):
        error = partial(_height_error, sign)
        table[f"ground_believed_{way}"] = Disturbance("m", 0.0, 0.15, 0.01, dict.fromkeys(both, 0.03), error)
    return table


DISTURBANCES = _disturbances()
