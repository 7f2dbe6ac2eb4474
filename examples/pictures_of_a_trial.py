"""Simulates a trial and draws what the robot saw, planned and did: a film strip and plots.

    python examples/pictures_of_a_trial.py --terrain stepping_stones --out out/pictures

Each picture of the film strip shows the robot among the planar regions that it perceives, the footholds (balls, coloured
by leg), the swings and the base path of the plan that it follows.
"""

from pathlib import Path
from typing import Annotated

import typer
from rich.progress import track

from quadpips_drake.cli import console
from quadpips_drake.cli.run import resolve_trial_config
from quadpips_drake.cli.trials import RunProgress
from quadpips_drake.errors import UserInputError
from quadpips_drake.trials.observation import observe, read
from quadpips_drake.trials.trial import Trial
from quadpips_drake.visualization.meshes.plan_meshes import (
    base_mesh,
    foothold_mesh,
    goal_mesh,
    region_mesh,
    start_mesh,
    swing_mesh,
)
from quadpips_drake.visualization.plots import save_plots
from quadpips_drake.visualization.snapshot import ChaseView, SnapshotRenderer, film_strip, save_picture


def main(
    robot: Annotated[str, typer.Option(metavar="NAME", help="anymal_c or go2.")] = "anymal_c",
    terrain: Annotated[str, typer.Option(metavar="NAME|FILE", help="Where to walk.")] = "stepping_stones",
    seed: Annotated[int, typer.Option(min=0, metavar="N", help="Of all random numbers.")] = 0,
    duration: Annotated[float, typer.Option(metavar="S", help="Longest simulated time, s.")] = 60.0,
    pictures: Annotated[int, typer.Option(min=1, max=100, metavar="N", help="On the film strip.")] = 6,
    out: Annotated[Path, typer.Option(metavar="DIR", help="For film.png and plots.")] = Path("out/pictures"),
) -> None:
    """Simulate a trial and draw what the robot saw, planned and did: a film strip and plots."""
    choice = {"robot": robot, "terrain": terrain, "seed": seed, "duration": duration}
    config = resolve_trial_config(None, choice, [])
    console.writable_directory(out)
    moments = []

    def remember(time: float):
        progress(time)
        observation = observe(trial.diagram, trial.context)
        if len(observation.reference.times):
            moments.append((observation, read(trial.diagram, "region_set", trial.context)))

    print(f"building {robot} on {terrain}, walking for at most {config.duration:g} s")
    with RunProgress(config.duration) as progress:
        trial = Trial(config)
        verdict = trial.run(progress=remember)
    print(f"{verdict.reason} after {trial.context.get_time():.1f} s: {verdict.detail}")
    if not moments:
        raise UserInputError(f"--duration {duration:g}: the robot had no plan yet that could be drawn; give it longer")
    print(f"drawing {pictures} pictures and the plots")
    draw(trial, moments, pictures, out)
    print(f"pictures: {out}")


def draw(trial: Trial, moments: list, count: int, out: Path) -> None:
    """Writes the film strip, ``count`` pictures spread over the ``moments``, and the plots."""
    chosen = [moments[round(i * (len(moments) - 1) / max(count - 1, 1))] for i in range(count)]
    images = [picture(trial, *moment) for moment in track(chosen, "drawing", console=console.messages, transient=True)]
    save_picture(film_strip(images, columns=2), out / "film.png")
    save_plots(trial.log.arrays(), out, terrain=trial.terrain, robot=trial.robot)


def picture(trial: Trial, observation, regions):
    """Returns one picture, uint8 (height, width, 3)."""
    state, reference = observation.robot_state, observation.reference
    overlays = [
        start_mesh(trial.terrain),
        goal_mesh(trial.terrain),
        region_mesh(regions),
        foothold_mesh(reference),
        swing_mesh(reference, trial.robot),
        base_mesh(reference),
    ]
    view = ChaseView(distance=2.9, azimuth=1.05, elevation=0.5)
    renderer = SnapshotRenderer(trial.robot, trial.terrain, overlays=overlays, width=960, height=600)
    return renderer.render(state.p_WB, state.rpy_WB, state.joint_positions, view)


if __name__ == "__main__":
    console.run_alone(main)
