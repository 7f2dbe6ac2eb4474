"""``quadpips bench``: many trials, counted; and what two benches say about each other."""

import shlex
from collections.abc import Callable
from contextlib import AbstractContextManager, ExitStack, nullcontext
from pathlib import Path
from typing import Annotated

import typer

from quadpips_drake.cli import console
from quadpips_drake.cli.trials import Sets
from quadpips_drake.cli.warming import compile_kernels
from quadpips_drake.errors import UserInputError

EPILOG = """
Examples:

  quadpips bench --terrain paper --trials 10 --seed 0 --out out/paper      ANYmal C in the ten environments of the paper

  quadpips bench --robot go2 --terrain flat,stairs --trials 2 --duration 20 --out out/few

  quadpips bench --out out/paper --resume                                  to go on after Ctrl-C or a power cut

  quadpips bench --terrain balance_beam --difficulty 0.2:0.5:7 --out out/beam

  quadpips bench compare out/paper out/other

Each trial that is over is kept in DIR/trials.jsonl and not run again. Tables and pictures
are in DIR/summary.html, all figures in DIR/results.parquet.

Exit status: 0 done, 1 some trials ended in an error of the program, 2 bad input, 130 Ctrl-C, 143 SIGTERM.
"""

TIME_LIMIT = 3600.0
"""Computing time of one trial [s], unless the user says otherwise."""

app = typer.Typer(
    epilog=EPILOG,
    invoke_without_command=True,
    help="Run many trials by several processes and count the goals reached; resumable whatever ends it.",
)


Robots = Annotated[str | None, typer.Option(metavar="R,R", help="Which robots. Default: anymal_c.")]
Terrains = Annotated[str | None, typer.Option(metavar="paper|all|A,B", help="Suites, names or files. Default: paper.")]
Planners = Annotated[
    str | None,
    typer.Option(metavar="P,Q", help="Who plans: quadpips, s_mpc, em_mpc, lf_mpc, motion_models. Default: quadpips."),
]
Regions = Annotated[str | None, typer.Option(metavar="NAME", help="Where planar regions come from. Default: superpixels.")]
Trials = Annotated[int | None, typer.Option(min=1, metavar="N", help="Of each kind. Default: 10.")]
FirstSeed = Annotated[int | None, typer.Option(min=0, metavar="N", help="Of the first trial; others follow. Default: 0.")]
Difficulty = Annotated[
    str | None, typer.Option(metavar="X|LOW:HIGH:N", help="Difficulty of the terrains, or N of them, in their own unit.")
]
Duration = Annotated[
    float | None, typer.Option(parser=console.seconds, metavar="S", help="Longest simulated time of a trial, s.")
]
Workers = Annotated[int | None, typer.Option(min=1, metavar="N", help="Trials at a time. Default: one for each core.")]
TimeLimit = Annotated[
    float | None,
    typer.Option(
        parser=console.seconds,
        metavar="S",
        help="A trial that computes longer, s, is ended, and tried once more. Default: 3600.",
    ),
]
Scheduler = Annotated[
    str | None, typer.Option(metavar="ADDRESS", help="Of a Dask cluster that runs the trials, such as tcp://host:8786.")
]
Out = Annotated[Path, typer.Option(parser=console.to_directory, metavar="DIR", help="For the results.")]
Resume = Annotated[bool, typer.Option("--resume", help="Go on with the bench that DIR holds.")]

Recorded = Annotated[
    str, typer.Option(metavar="failed|all|none", help="Trials to record; failed ones are run again for it at the end.")
]


@app.callback()
def bench(
    context: typer.Context,
    robot: Robots = None,
    terrain: Terrains = None,
    planner: Planners = None,
    regions: Regions = None,
    trials: Trials = None,
    seed: FirstSeed = None,
    difficulty: Difficulty = None,
    duration: Duration = None,
    sets: Sets = None,
    workers: Workers = None,
    time_limit: TimeLimit = None,
    scheduler: Scheduler = None,
    out: Out = Path("out/bench"),
    resume: Resume = False,
    recordings: Recorded = "failed",
):
    """Run many trials by several processes and count the goals reached; resumable whatever ends it.

    Writes bench.yaml (the settings), trials.jsonl (the journal), results.parquet, pictures, summary.md and summary.html into
    DIR, and recordings below DIR/recordings.
    """
    if context.invoked_subcommand is not None:
        return
    from quadpips_drake.benchmark.bench.bench_trial import run_bench_trial
    from quadpips_drake.benchmark.bench.recordings import WANTED
    from quadpips_drake.trials.result_directory import ResultDirectory

    asked = {"robot": robot, "terrain": terrain, "planner": planner, "regions": regions, "trials": trials, "seed": seed}
    asked |= {"difficulty": difficulty, "duration": duration, "sets": sets}
    asked = {name: value for name, value in asked.items() if value is not None}
    settings = settings_in(out) if resume and not asked else settings_of(asked)
    check(settings)
    if recordings not in WANTED:
        raise UserInputError(f"--recordings '{recordings}' is none of {', '.join(WANTED)}")
    # What DIR holds is kept, and added to.
    with _pool(workers, time_limit, scheduler) as pool, ResultDirectory(out, ()):
        status = run_and_report(settings, out, pool, resume=resume, run=run_bench_trial, recordings=recordings)
    raise typer.Exit(status)


@app.command()
def compare(
    a: Annotated[Path, typer.Argument(metavar="DIR_A", help="Of one bench.")],
    b: Annotated[Path, typer.Argument(metavar="DIR_B", help="Of another one.")],
    out: Annotated[Path | None, typer.Option(metavar="FILE.md", help="Write the page there instead of printing it.")] = None,
):
    """Compare the trials that two benches have in common, pair by pair; a page of markdown.

    Pairs have robot, terrain, difficulty and seed in common; p is that of McNemar's exact test.
    """
    from quadpips_drake.benchmark.bench.reporting.comparison import comparison, load_rows
    from quadpips_drake.files import write_text

    text = comparison(load_rows(a), load_rows(b), str(a), str(b))
    if out is None:
        console.say(text)
        return
    try:
        write_text(out, text)
    except OSError as error:
        raise UserInputError(f"--out {out}: cannot write there ({error.strerror})") from None
    console.say(f"comparison: {out}")


def _pool(workers: int | None, time_limit: float | None, scheduler: str | None) -> AbstractContextManager:
    """Who runs the trials, in a context.

    Raises:
        UserInputError: the cluster cannot, or options do not go together.
    """
    from quadpips_drake.benchmark.bench.dask_pool import DaskPool
    from quadpips_drake.benchmark.bench.process_pool import ProcessPool
    from quadpips_drake.worker_pool import available_cores

    if scheduler is None:
        return nullcontext(ProcessPool(workers or available_cores(), time_limit or TIME_LIMIT))
    if workers or time_limit:
        raise UserInputError(
            "--scheduler: the cluster decides how many workers there are, and none is ended; leave "
            "--workers and --time-limit out"
        )
    with ExitStack() as stack:
        pool = stack.enter_context(DaskPool(scheduler))
        console.messages.print(f"{pool.check()} workers at {scheduler}", markup=False)
        stack.pop_all()
    return pool


def settings_in(out: Path):
    """The BenchSettings of the bench that ``out`` holds; raises UserInputError where there is none."""
    from quadpips_drake.benchmark.bench.settings import load_settings

    settings = load_settings(out)
    if settings is None:
        raise UserInputError(f"--out {out}: holds no bench to go on with; leave --resume out, and say what to run")
    return settings


def settings_of(asked: dict):
    """The BenchSettings for the options that were given; raises UserInputError where they do not go together."""
    from quadpips_drake.benchmark.bench.settings import BenchSettings, courses_of, difficulties_of

    robots, terrains = _words(asked, "robot", "anymal_c"), _words(asked, "terrain", "paper")
    more = {name: asked[name] for name in ("regions", "trials", "seed", "duration", "sets") if name in asked}
    if "difficulty" in asked:
        more["difficulties"] = difficulties_of(asked["difficulty"])
    return BenchSettings(courses=courses_of(robots, terrains), planners=_words(asked, "planner", "quadpips"), **more)


def check(settings) -> None:
    """Raises UserInputError if a trial of the settings cannot be had, before any of them is run."""
    from quadpips_drake.benchmark.bench.bench_trial import config_of
    from quadpips_drake.terrain.library import load_terrain

    for course in settings.courses:
        for difficulty in settings.difficulties or [None]:
            load_terrain(course.terrain, difficulty=difficulty)
    kinds = {(spec.robot, spec.planner, spec.difficulty): spec for spec in settings.trial_specs()}
    for spec in kinds.values():
        config_of(spec, settings)


def run_and_report(settings, out: Path, pool, *, resume: bool, run: Callable, recordings: str = "none") -> int:
    """Runs the trials that are missing in ``out``, writes the reports and returns the exit status.

    Args:
        settings: what to run.
        out: the folder, held by nobody else.
        pool: who runs the trials.
        resume: whether to go on with what is there.
        run: who runs one trial, see ``run_bench_trial``.
        recordings: of which trials, one of ``recordings.WANTED``.
    """
    from quadpips_drake.benchmark.bench import bench as work
    from quadpips_drake.benchmark.bench.journal import Journal, read_journal
    from quadpips_drake.benchmark.bench.recordings import Recordings
    from quadpips_drake.benchmark.bench.reporting.reports import PAGE, write_reports
    from quadpips_drake.interruption import undisturbed

    work.claim(settings, out, resume=resume)
    compile_kernels()  # rather than in each of the workers
    with Journal(out / work.JOURNAL) as journal, Recordings(out) as recorded:
        for remark in journal.remarks + recorded.journal.remarks:
            console.messages.print(remark, markup=False)
        try:
            _run_all(settings, journal, recorded, pool, run, recordings)
        except KeyboardInterrupt as interrupt:
            # From the files: the signal may have come between a line in one and its entry in memory.
            entries, more = (read_journal(path)[0] for path in (journal.path, recorded.journal.path))
            rows = work.rows_of(settings, entries, more)
            with undisturbed():
                if rows:
                    write_reports(settings, rows, out)
            kept = f"{len(rows)} of {len(settings.trial_specs())} trials are kept"
            console.end_interrupted(interrupt, f"{kept}; go on with: {go_on(out)}")
        rows = work.rows_of(settings, journal.entries, recorded.journal.entries)
        write_reports(settings, rows, out)
    _say_scores(rows)
    console.say(f"summary: {out / PAGE} (open it in a browser)")
    return _status(rows)


def _run_all(settings, journal, recorded, pool, run: Callable, recordings: str) -> None:
    """Runs the trials that are missing, and those that are to be recorded once more; shows how far it is."""
    from quadpips_drake.benchmark.bench import bench as work
    from quadpips_drake.benchmark.bench.progress import BenchProgress

    total = len(settings.trial_specs())
    with BenchProgress(console.messages, work.rows_of(settings, journal.entries), total) as progress:
        work.run_missing(settings, journal, pool, progress, run, recorded.keep if recordings == "all" else None)
    missing = recorded.missing(settings, journal.entries) if recordings != "none" else []
    if missing:
        console.messages.print(f"failed trials are run again for their recordings: {len(missing)}")
        with BenchProgress(console.messages, [], len(missing), "recordings") as progress:
            recorded.add_missing(settings, journal.entries, pool, progress, run)


def go_on(out: Path) -> str:
    """The command that goes on with the bench in ``out``."""
    return f"quadpips bench --out {shlex.quote(str(out))} --resume"


def _words(asked: dict, name: str, default: str) -> list[str]:
    """The words of ``A,B``, each once."""
    words = list(dict.fromkeys(asked.get(name, default).split(",")))
    if not all(words):
        raise UserInputError(f"--{name} '{asked[name]}' is not of the form A,B (names with commas and without spaces)")
    return words


def _say_scores(rows: list[dict]) -> None:
    from quadpips_drake.benchmark.bench.reporting.summary import GROUP
    from quadpips_drake.benchmark.bench.scores import tally

    for key, score in tally(rows, GROUP).items():
        low, high = score.interval
        console.say(f"{' '.join(key)}: {score.reached} of {score.trials} ({low:.2f} to {high:.2f})")


def _status(rows: list[dict]) -> int:
    errors = sum(row["reason"] == "error" for row in rows)
    if errors:
        console.messages.print(f"trials that ended in an error of the program: {errors}, see the failures in the summary")
    return console.FAILURE if errors else console.SUCCESS
