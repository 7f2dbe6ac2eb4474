"""The pictures of docs/control.md: ``python -m quadpips_drake.benchmark.walk_pictures --out docs/images``."""

from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from quadpips_drake.gaits.gaits import GAITS
from quadpips_drake.trials.trial_options import resolve_config
from quadpips_drake.trials.walk_trial import WalkTrial, WalkTrialConfig
from quadpips_drake.visualization.snapshot import SnapshotRenderer, film_strip, look_at, save_picture
from quadpips_drake.visualization.walk_figures import gait_figure, push_figure

PUSH_AT = 3.0
"""When the push begins [s]."""
FRAMES = (-0.05, 0.1, 0.25, 0.4, 0.6, 1.2)
"""Times of the film strip, counted from the push [s]."""
EYE = (-2.1, -0.7, 0.25)
"""Where the camera stays, seen from the robot at the time of the push [m]: behind it, where sideways motion shows best."""


def main(
    out: Annotated[Path, typer.Option(metavar="DIR", help="Where to write control_*.png.")] = Path("docs/images"),
    robot: Annotated[str, typer.Option(metavar="NAME", help="Who is pushed.")] = "anymal_c",
    impulse: Annotated[float, typer.Option(metavar="NS", help="Of the push to the left, N s.")] = 25.0,
):
    """Draw the gaits, and a trotting robot that is pushed: a film strip and its plots."""
    out.mkdir(parents=True, exist_ok=True)
    gait_figure(list(GAITS.values())).savefig(out / "control_gaits.png", dpi=90)
    push = {"force": [0.0, 10.0 * impulse, 0.0], "time": PUSH_AT, "duration": 0.1}
    options = {"robot": robot, "gait": "trot", "velocity": [0.3, 0.0, 0.0], "pushes": [push], "duration": PUSH_AT + 2.5}
    trial = WalkTrial(resolve_config(WalkTrialConfig, None, options, []))
    trial.run()
    trial.result()  # enters the footholds into the log
    log = trial.log.arrays()
    push_figure(log, PUSH_AT - 0.6, PUSH_AT + 2.0).savefig(out / "control_push.png", dpi=80)
    renderer = SnapshotRenderer(trial.robot, trial.terrain, width=400, height=360)
    there = log["p_WB"][np.searchsorted(log["time"], PUSH_AT)] + [0.15, 0.1, -0.15]
    images = renderer.render_log(log, np.array(FRAMES) + PUSH_AT, look_at(there + EYE, there))
    save_picture(film_strip(images, columns=3), out / "control_push_film.png")
    typer.echo(f"{trial.verdict.reason}; pictures in {out}")


if __name__ == "__main__":
    typer.run(main)
