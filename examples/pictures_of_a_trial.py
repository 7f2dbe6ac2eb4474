"""Simulates a trial and draws what the robot saw, planned and did: a film strip and plots.

    python examples/pictures_of_a_trial.py --terrain stepping_stones --out out/pictures

Each picture of the film strip shows the robot among the planar regions that it perceives, the footholds (balls, coloured
by leg), the swings and the base path of the plan that it follows.
"""

import argparse
from pathlib import Path

from quadpips_drake.cli.run import resolve_trial_config
from quadpips_drake.trials.observation import observe, read
from quadpips_drake.trials.trial import Trial
from quadpips_drake.visualization.plan_meshes import base_mesh, course_mesh, foothold_mesh, region_mesh, swing_mesh
from quadpips_drake.visualization.plots import save_plots
from quadpips_drake.visualization.snapshot import ChaseView, SnapshotRenderer, film_strip, save_picture


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--robot", default="anymal_c")
    arguments.add_argument("--terrain", default="stepping_stones")
    arguments.add_argument("--seed", type=int, default=0)
    arguments.add_argument("--duration", type=float, default=60.0, help="simulated time, s")
    arguments.add_argument("--pictures", type=int, default=6)
    arguments.add_argument("--out", type=Path, default=Path("out/pictures"))
    options = arguments.parse_args()

    choice = {key: getattr(options, key) for key in ("robot", "terrain", "seed", "duration")}
    trial = Trial(resolve_trial_config(None, choice, []))
    moments = []

    def remember(time: float):
        observation = observe(trial.diagram, trial.context)
        if len(observation.reference.times):
            moments.append((observation, read(trial.diagram, "region_set", trial.context)))

    verdict = trial.run(progress=remember)
    print(f"{verdict.reason}: {verdict.detail}")

    options.out.mkdir(parents=True, exist_ok=True)
    chosen = [moments[round(i * (len(moments) - 1) / max(options.pictures - 1, 1))] for i in range(options.pictures)]
    images = [picture(trial, *moment) for moment in chosen]
    save_picture(film_strip(images, columns=2), options.out / "film.png")
    save_plots(trial.log.arrays(), options.out, terrain=trial.terrain, robot=trial.robot)
    print(f"pictures: {options.out}")


def picture(trial: Trial, observation, regions):
    """Returns one picture, uint8 (height, width, 3)."""
    state, reference = observation.robot_state, observation.reference
    overlays = [
        course_mesh(trial.terrain),
        region_mesh(regions),
        foothold_mesh(reference),
        swing_mesh(reference, trial.robot),
        base_mesh(reference),
    ]
    view = ChaseView(distance=2.9, azimuth=1.05, elevation=0.5)
    renderer = SnapshotRenderer(trial.robot, trial.terrain, overlays=overlays, width=960, height=600)
    return renderer.render(state.p_WB, state.rpy_WB, state.joint_positions, view)


if __name__ == "__main__":
    main()
