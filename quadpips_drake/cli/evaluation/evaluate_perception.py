"""``quadpips evaluate perception``: how true and how complete the regions are, against the exact terrain."""

from pathlib import Path
from typing import Annotated

import typer

from quadpips_drake.cli import console
from quadpips_drake.cli.trials import Overwrite, Sets
from quadpips_drake.cli.warming import compile_kernels
from quadpips_drake.errors import UserInputError
from quadpips_drake.files import write_json
from quadpips_drake.trials.result_directory import ResultDirectory, why

EPILOG = """
Examples:

  quadpips evaluate perception --terrain stairs --noise

  quadpips evaluate perception --terrain sparse_stones --scripted     no physics: faster, and it always arrives

  quadpips evaluate perception --drift 0.003,0.001,0.002

  quadpips evaluate perception --regions superpixels,elevation        both on the same images

What each figure means is said in docs/perception.md.

Exit status: 0 scored (even if the robot fell on the way), 2 bad input.
"""

FILES = ("scores.json", "scores.png", "config.yaml")
LINE_PERIOD = 5.0
"""Simulated time between two lines of progress [s]."""

D435_NOISE = {"sigma": 0.001, "sigma_growth": 0.004, "dropout": 0.02}
"""What --noise means: standard deviation 1 mm + 4 mm/m^2 z^2 in depth z, and every fiftieth pixel lost."""

TARGETS = (
    ("false-safe area [%]", "false_safe_share", 100.0, "<=", 0.5, 1.5),
    ("  of it over a void [%]", ("false_safe_causes", "void"), 100.0, "", None, None),
    ("  of it off the surface [%]", ("false_safe_causes", "off_surface"), 100.0, "", None, None),
    ("  of it tilted [%]", ("false_safe_causes", "off_normal"), 100.0, "", None, None),
    ("coverage [%]", "coverage", 100.0, ">=", 85.0, 75.0),
    ("foot coverage [%]", "foot_coverage", 100.0, "", None, None),
    ("floor height, RMS [mm]", "height_rms_m", 1000.0, "<=", 8.0, 15.0),
    ("floor normal, median [deg]", "normal_median_deg", 1.0, "<=", 2.0, 5.0),
    ("region plane, median [mm]", "plane_error_median_m", 1000.0, "", None, None),
    ("region plane, 95 % [mm]", "plane_error_p95_m", 1000.0, "", None, None),
    ("floor where there is none [%]", "ghost_share", 100.0, "", None, None),
    ("IoU with the sample before [%]", "frame_iou", 100.0, "", None, None),
    ("regions", "regions", 1.0, "", None, None),
)
"""Rows of the table: title, key of the summary, scale, relation, target without and with noise or drift."""


def perception(
    terrain: Annotated[str, typer.Option(metavar="NAME|FILE", help="Where to walk.")] = "stepping_stones",
    robot: Annotated[str, typer.Option(metavar="NAME", help="anymal_c or go2.")] = "anymal_c",
    seed: Annotated[int, typer.Option(metavar="N", help="Of all random numbers.")] = 0,
    noise: Annotated[bool, typer.Option("--noise", help="Depth noise and lost pixels like a D435's.")] = False,
    drift: Annotated[
        str | None,
        typer.Option(metavar="H,V,YAW", help="Drift of the pose estimate: horizontal and vertical, m/s, yaw, rad/s."),
    ] = None,
    regions: Annotated[
        str | None,
        typer.Option(metavar="A,B", help="Region sources to score; the robot walks by the first. Default: superpixels."),
    ] = None,
    scripted: Annotated[bool, typer.Option("--scripted", help="Lead the camera along the way, without physics.")] = False,
    duration: Annotated[float, typer.Option(parser=console.seconds, metavar="S", help="Longest simulated time, s.")] = 60.0,
    out: Annotated[
        Path | None,
        typer.Option(parser=console.to_directory, metavar="DIR", help="For scores.json, scores.png, config.yaml."),
    ] = None,
    overwrite: Overwrite = False,
    sets: Sets = None,
):
    """Score what perception says while the robot walks against the exact terrain.

    Prints a table and writes scores.json and scores.png into DIR; of further region sources scores-NAME.png.
    """
    options = {"terrain": terrain, "robot": robot, "seed": seed, "duration": duration}
    config = resolve_evaluation_config(options, noise, drift, sets or [])
    sources = chosen_sources(regions, config)
    out = out or default_directory(config, scripted, sources)
    pictures = {name: f"scores-{name}.png" if k else "scores.png" for k, name in enumerate(sources)}
    with ResultDirectory(out, (*FILES, *list(pictures.values())[1:]), overwrite=overwrite) as directory:
        try:
            compile_kernels()
            scorers, ended = _score(config, sources, scripted)
        except KeyboardInterrupt as interrupt:
            console.end_interrupted(interrupt, "nothing was written")
        if not scorers[sources[0]].rows:
            raise UserInputError(f"nothing could be scored: {ended['reason']} {ended['detail']}")
        summaries = {name: scorer.summary() for name, scorer in scorers.items()}
        print_table(summaries, config.stages.perception.depth_noise.enabled or config.stages.drift.enabled)
        console.say(f"{ended['reason']} after {ended['sim_time']:.1f} s; {ended['detail']}")
        document = {"robot": robot, "terrain": terrain, "seed": seed, "scripted": scripted} | ended
        document |= {"noise": vars(config.stages.perception.depth_noise), "drift": vars(config.stages.drift)}
        document |= {"summary": summaries[sources[0]], "samples": scorers[sources[0]].rows}
        document["sources"] = {name: {"summary": summaries[name], "samples": scorers[name].rows} for name in sources}
        directory.clear()
        _save(out, config, document, {pictures[name]: scorer for name, scorer in scorers.items()})
    console.say(f"scores:  {out / 'scores.json'}")
    for picture in pictures.values():
        console.say(f"picture: {out / picture}")


def chosen_sources(regions: str | None, config) -> list[str]:
    """Returns the names in ``regions``, or that in the ``config``; raises UserInputError for those that are none."""
    from quadpips_drake.benchmark.perception_scores_runs import check_sources

    sources = [config.stages.region_source] if regions is None else [name.strip() for name in regions.split(",")]
    check_sources(sources)
    return sources


def default_directory(config, scripted: bool, sources: list[str] = ()) -> Path:
    """Returns where the scores go unless the user says otherwise: somewhere else for each evaluation."""
    from quadpips_drake.cli.run import resolve_trial_config
    from quadpips_drake.trials.directory_name import directory_name

    names = {"robot": config.robot, "terrain": config.terrain, "seed": config.seed}
    way = ["scripted"] if scripted else []
    way += list(sources) if list(sources) not in ([], ["superpixels"]) else []
    return Path("out") / directory_name(config, resolve_trial_config(None, names, []), "perception", *names.values(), *way)


def resolve_evaluation_config(options: dict, noise: bool, drift: str | None, sets: list[str]):
    """Returns the TrialConfig for the options of the command.

    Raises:
        UserInputError: something in them is unknown or of the wrong type.
    """
    from quadpips_drake.cli.run import resolve_trial_config

    texts = [f"stages.perception.depth_noise.{key}={value}" for key, value in D435_NOISE.items()] if noise else []
    if drift is not None:
        rates = console.numbers("--drift", drift, "H,V,YAW")
        names = ("horizontal_rate", "vertical_rate", "yaw_rate")
        texts.append("stages.state_estimator=drifting")
        texts += [f"stages.drift.{name}={rate}" for name, rate in zip(names, rates, strict=True)]
    return resolve_trial_config(None, options, texts + sets)


def print_table(summaries: dict, spoiled: bool) -> None:
    """Prints the summaries of PerceptionScorers by region source beside the targets (with noise or drift if ``spoiled``)."""
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    samples = next(iter(summaries.values()))["samples"]
    table = Table("", *(escape(name) for name in summaries), "target", title=f"{samples} samples")
    for title, key, scale, relation, clean, noisy in TARGETS:
        goal, cells = noisy if spoiled else clean, []
        for summary in summaries.values():
            value = summary[key] if isinstance(key, str) else summary[key[0]][key[1]]
            shown = "-" if value is None else f"{value * scale:.2f}"
            if relation and value is not None:
                met = value * scale <= goal if relation == "<=" else value * scale >= goal
                shown += "  ok" if met else "  MISSED"
            cells.append(shown)
        table.add_row(escape(title), *cells, f"{relation} {goal:g}" if relation else "")
    Console().print(table)


def _score(config, sources: list[str], scripted: bool):
    from quadpips_drake.benchmark.perception_scores_runs import score_camera_path, score_walk

    shown = [0.0]

    def progress(time: float):
        if time >= shown[0]:
            console.messages.print(f"{time:5.1f} s simulated")
            shown[0] = time + LINE_PERIOD

    return (score_camera_path if scripted else score_walk)(config, sources, progress)


def _save(out: Path, config, document: dict, scorers: dict) -> None:
    """Writes the files into ``out``; ``scorers``: by the names of their pictures."""
    from quadpips_drake.benchmark.perception_scores_picture import save_scores_picture
    from quadpips_drake.configuration.loading import save_config

    try:
        write_json(out / "scores.json", document)
        save_config(config, out / "config.yaml")
        for picture, scorer in scorers.items():
            save_scores_picture(out / picture, scorer, f"{out.name} {picture.removesuffix('.png')}", scorer.moments)
    except OSError as error:
        raise UserInputError(f"--out {out}: not all could be written ({why(error)})") from None
