"""A run from Python: the robot crosses stones by its own camera.

    python examples/run_in_ten_lines.py --terrain stepping_stones --duration 20

The ten lines are those of ``main``.
"""

import quadpips_drake as qp
from quadpips_drake.cli import console


def main(robot: str = "anymal_c", terrain: str = "stepping_stones", duration: float = 60.0) -> None:
    """Let a robot cross a terrain by its own camera, for at most DURATION simulated seconds, and say what came of it."""
    config = qp.load_config(robot=robot, terrain=terrain, seed=0, duration=duration)
    config.stages.planning.footholds.gait = "standing_trot"  # any value of config.yaml is an attribute
    print(f"building {robot} on {terrain}")
    trial = qp.Trial(config)
    verdict = trial.run(progress=lambda time: print(f"\rwalking: {time:5.1f} s", end="", flush=True))
    print(f"\n{verdict.reason}: {verdict.detail}")
    result, path = trial.result(), trial.log.arrays()["p_WB"]
    print(f"{len(trial.log)} samples, {result.replans} plans after the first, now at {path[-1].round(3)} m")


if __name__ == "__main__":
    console.run_alone(main)
