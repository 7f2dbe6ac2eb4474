"""``quadpips evaluate motion-models``: crossings of gaps and steps by velocity command."""

from pathlib import Path
from typing import Annotated

import typer

from quadpips_drake.cli.console import say, to_directory
from quadpips_drake.cli.evaluation.evaluate_tracking import Robots, Workers, known_robots, known_seeds, status_of
from quadpips_drake.cli.warming import compile_kernels
from quadpips_drake.errors import UserInputError, unknown_name
from quadpips_drake.trials.result_directory import ResultDirectory

EPILOG = """
Examples:

  quadpips evaluate motion-models --seeds 0 --robots anymal_c --horizons 7

  quadpips evaluate motion-models --map camera --horizons 7 --workers 2

  quadpips evaluate motion-models --models learned,ideal,kinematic,blind,quadpips --horizons 7

  quadpips evaluate motion-models --push 10 --robots anymal_c --horizons 7

Models: learned; ideal (a command is followed at once); kinematic (a white box: slew limit and Raibert's rule); blind
(0.4 m/s, nobody looks); quadpips (the planner with regions, for comparison). What has been computed is kept in
DIR/crossings.json and not computed again, after Ctrl-C too.

Exit status: 0 done, 1 some crossings ended without a result, 2 bad input.
"""


def motion_models(
    robots: Robots = "anymal_c,go2",
    terrains: Annotated[str, typer.Option(metavar="A,B", help="Where.")] = "gaps_symmetric,gaps_staggered,gaps_and_steps",
    horizons: Annotated[str, typer.Option(metavar="N,N,...", help="Steps that are searched ahead.")] = "3,5,7",
    models: Annotated[str, typer.Option(metavar="A,B", help="What is believed of the walk.")] = "learned",
    map_: Annotated[str, typer.Option("--map", metavar="A,B", help="Where the map comes from: oracle, camera.")] = "oracle",
    seeds: Annotated[str, typer.Option(metavar="N,N,...", help="Seeds of the crossings.")] = "110,111,112,113,114",
    push: Annotated[
        float, typer.Option(min=0.0, max=1000.0, metavar="X", help="Push all robots to the left on their way, N s.")
    ] = 0.0,
    sets: Annotated[
        list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="Replace one value in all; may be repeated.")
    ] = None,
    workers: Workers = 1,
    out: Annotated[
        Path, typer.Option(parser=to_directory, metavar="DIR", help="For crossings.json and courses.png.")
    ] = Path("out/motion_models"),
):
    """Cross gaps and steps with learned motion models and their rivals; print Table II of the paper with ours beside it."""
    from quadpips_drake.benchmark.motion_models import crossing_tables
    from quadpips_drake.benchmark.motion_models import crossings as study
    from quadpips_drake.benchmark.motion_models.course_picture import save_course_picture
    from quadpips_drake.benchmark.study_pool import load_results

    chosen = (
        known_robots(robots),
        _known_terrains(terrains),
        study.known_horizons(horizons),
        models.split(","),
        map_.split(","),
    )
    study.check_models(chosen[0], chosen[3], chosen[4])
    crossings = study.crossings_of(*chosen, known_seeds(seeds), tuple(sets or ()), push)
    crossings[0].config()  # refuses settings that make no sense
    with ResultDirectory(out, ()):  # what it holds is kept, and added to
        results = load_results(out / study.STORE)
        compile_kernels()  # rather than in each of the workers
        done = study.run_crossings(crossings, out, results, workers=workers)
        if save_course_picture(done.results, crossings, out / "courses.png"):
            say(f"picture: {out / 'courses.png'}\n")
    if "learned" in chosen[3]:
        say(crossing_tables.table_2(done.results, crossings) + "\n")
    say(crossing_tables.table_of_crossings(done.results, crossings))
    raise typer.Exit(status_of(done))


def _known_terrains(text: str) -> list[str]:
    """The terrains of ``A,B``; raises UserInputError for an unknown one."""
    from quadpips_drake.terrain.library import terrain_names

    names = text.split(",")
    for name in names:
        if name not in terrain_names() and not name.endswith((".yaml", ".yml")):
            raise unknown_name("terrain", name, terrain_names())
    if len(set(names)) < len(names):
        raise UserInputError(f"--terrains '{text}' names one twice")
    return names
