"""The files of a trial in which a robot stands at its start: quick to make, and as good to look at as a real one."""

import json
from pathlib import Path

import numpy as np

from quadpips_drake.configuration.loading import save_config
from quadpips_drake.terrain.standing_pose import standing_pose
from quadpips_drake.terrain.truth import GroundTruth
from quadpips_drake.trials.loading import load_config, load_walk_config
from quadpips_drake.trials.world import world_of
from quadpips_drake.values.legs import Leg
from quadpips_drake.visualization.overlay.story import Story

DURATION = 0.4
"""[s]"""


def write_standing_trial(directory: Path, *, is_walk: bool, **options) -> Path:
    """Writes config.yaml, log.npz, result.json and story.json; returns the directory."""
    directory.mkdir(parents=True, exist_ok=True)
    config = (load_walk_config if is_walk else load_config)(robot="go2", **options)
    save_config(config, directory / "config.yaml")
    robot, terrain = world_of(config, None, None)
    x, y, yaw = terrain.start
    p_WB, joints = standing_pose(robot, GroundTruth(terrain), x, y, yaw)
    time = np.arange(0.0, DURATION + 1e-9, 0.01)
    n = len(time)
    feet = p_WB + robot.nominal_footholds_B
    log = {
        "time": time,
        "p_WB": np.tile(p_WB, (n, 1)),
        "rpy_WB": np.tile([0.0, 0.0, yaw], (n, 1)),
        "joint_positions": np.tile(joints, (n, 1)),
        "contacts": np.tile(time[:, None] < 0.2, (1, 4)),
        "foot_positions": np.tile(feet, (n, 1, 1)),
        "contact_forces": np.zeros((n, 4, 3)),
        "reference_p_WB": np.tile(p_WB, (n, 1)) + np.outer(time, [1.0, 0.0, 0.0]),
        "foothold_leg": np.arange(4),
        "foothold_position": feet + np.array([0.2, 0.0, 0.0]),
        "foothold_touchdown": np.full(4, 0.3),
        "foothold_published": np.full(4, 0.1),
        "foothold_plan": np.zeros(4, int),
        **dict.fromkeys(("v_WB", "w_WB"), np.zeros((n, 3))),
        **dict.fromkeys(("joint_velocities", "joint_torques"), np.zeros((n, 12))),
    }
    if is_walk:
        log["velocity_command"] = np.tile([0.5, 0.0, 0.2], (n, 1))
    np.savez_compressed(directory / "log.npz", **log)
    reason = "upright" if is_walk else "timeout"
    result = {"reason": reason, "detail": "", "robot": "go2", "terrain": terrain.name, "sim_time": DURATION}
    (directory / "result.json").write_text(json.dumps(result))
    story = Story(f"go2 on {terrain.name}", "seed 0", reason, DURATION)
    for t in time:
        story.note(t, phase="walking", feet=15 if t < 0.2 else 1 << Leg.RF)
    story.happen(0.1, "a foot slipped")
    story.save(directory / "story.json")
    return directory
