"""Running a trial and writing down what came out, whatever happens on the way."""

import traceback
from collections.abc import Callable
from contextlib import nullcontext
from functools import cache
from pathlib import Path

from quadpips_drake.compiling import on_compiling, remove_broken_kernels
from quadpips_drake.configuration.loading import save_config
from quadpips_drake.errors import UserInputError
from quadpips_drake.files import replacing, write_text
from quadpips_drake.interruption import undisturbed
from quadpips_drake.trials.explaining.explainer import Explainer
from quadpips_drake.trials.explaining.trial_explanation import explanation_of
from quadpips_drake.trials.profiling.simulation_profiler import SimulationProfiler
from quadpips_drake.trials.profiling.trial_profile import profile_of
from quadpips_drake.trials.reporting.report import TrialReport
from quadpips_drake.trials.reporting.report_page import REPORT
from quadpips_drake.trials.result import TrialResult, installed_versions
from quadpips_drake.trials.result_directory import ResultDirectory, why
from quadpips_drake.trials.simulated_trial import BREAKDOWNS, SimulatedTrial, SimulationConfig, in_one_line
from quadpips_drake.trials.telling.narrator import Narrator
from quadpips_drake.trials.telling.rerun_watcher import RerunWatcher
from quadpips_drake.trials.warming.warm_up import warm_up
from quadpips_drake.visualization.meshcat_layers import draw_course
from quadpips_drake.visualization.overlay.story import Story
from quadpips_drake.visualization.recording import make_quiet_meshcat, save_recording, start_recording

AFTERMATH = 1.0
"""How long a recording goes on after a fall [s]."""
_FALLS = ("fell", "left_terrain")


def record_trial(
    kind: type[SimulatedTrial],
    config: SimulationConfig,
    out: Path,
    *,
    recording: bool,
    overwrite: bool = False,
    profile: bool = False,
    explain: bool = False,
    report: bool = True,
    rerun: Path | None = None,
    meshcat=None,
    progress: Callable[[float], None] | None = None,
    announce: Callable[[str], None] = lambda text: None,
    warm_up: Callable[[], object] = warm_up,
    **options,
) -> TrialResult:
    """Runs a trial and writes result.json, config.yaml, log.npz, report.html and, if wanted, more into ``out``.

    What was computed is written even when the trial is interrupted or breaks off; then error.txt has the details. For a
    start or goal that makes no sense result.json says so before the UserInputError goes on to the caller. Results of an
    earlier trial stay until the new one has been built.

    Args:
        kind: which trial; called with ``config``, ``meshcat`` and ``options``.
        config: what to run; out: directory for the files, made when missing.
        recording: whether to write recording.html.
        overwrite: whether earlier results in ``out`` may be replaced.
        profile: whether to write profile.html and profile.json: where the computing time of the simulation went.
        explain: whether to write explain.html: how each plan came about, and what went wrong at the end.
        report: whether to write report.html: how it went, and why it failed (the most likely cause is in the result anyway).
        rerun: file of Rerun (.rrd) to write; None: none.
        meshcat: a Meshcat to show the trial in while it runs; made when a recording is wanted.
        progress: called with the simulated time [s] now and then; announce: told what goes on before and after that.
        warm_up: called before anything is built, to compile the numerical kernels where that has not happened yet.
        options: further keyword arguments of ``kind``.

    Raises:
        UserInputError: ``out`` holds results, somebody else writes there, or the trial cannot be had as asked for; that may
            come to light during the trial, then what was simulated has been written.
        KeyboardInterrupt: the program was interrupted; what was simulated has been written.
    """
    with ResultDirectory(out, overwrite=overwrite) as directory:
        announce("building")
        if remove_broken_kernels():
            announce("compiling anew what was damaged in the cache of kernels")
        with on_compiling(lambda: announce("compiling")):
            warm_up()
            if recording and meshcat is None:
                meshcat = make_quiet_meshcat()
            try:
                trial = kind(config, meshcat=meshcat, **options)
            except BREAKDOWNS as error:
                return _refused(config, directory, error)
            if meshcat is not None:
                draw_course(meshcat, trial.terrain, has_goal=trial.HAS_GOAL)
            _begin(config, directory)
            watched = RerunWatcher(rerun, trial) if rerun is not None else None
            instruments = SimulationProfiler() if profile else None, Explainer() if explain else None, watched
            return _simulate(trial, directory, meshcat if recording else None, instruments, report, progress, announce)


def _begin(config: SimulationConfig, directory: ResultDirectory) -> None:
    """Puts the configuration in the place of what an earlier trial has left."""
    try:
        with replacing(directory.path / "config.yaml") as unfinished:
            save_config(config, unfinished)  # first, so that a full disk deletes nothing
            directory.clear()
    except OSError as error:
        raise UserInputError(f"--out {directory.path}: cannot write there ({why(error)})") from None


def _refused(config: SimulationConfig, directory: ResultDirectory, error: BaseException) -> TrialResult:
    """The result of a trial that could not be built; written down unless results of an earlier one are in the way.

    Raises:
        UserInputError: it is one itself, or there are such results.
    """
    is_input = isinstance(error, UserInputError)
    detail = str(error) if is_input else f"the trial could not be built: {in_one_line(error)}"
    fields = {"planner": getattr(config, "planner", ""), "detail": detail, "versions": installed_versions()}
    result = TrialResult(False, "error", config.robot, config.terrain, seed=config.seed, **fields)
    if directory.is_free:
        directory.clear()
        files = {"result.json": result.save, "config.yaml": lambda path: save_config(config, path)}
        if not is_input:
            files["error.txt"] = lambda path: write_text(path, traceback.format_exc())
        _write(files, directory)
    elif not is_input:
        raise UserInputError(f"{detail}; the earlier results in {directory.path} stay as they are") from error
    if is_input:
        raise error
    return result


def _simulate(
    trial: SimulatedTrial, directory: ResultDirectory, recorder, instruments, report: bool, progress, announce
) -> TrialResult:
    """Runs the trial and writes its files.

    Args:
        trial: that was built.
        directory: for the files.
        recorder: the Meshcat that records it, or None.
        instruments: a SimulationProfiler or None, an Explainer or None, a RerunWatcher or None.
        report, progress, announce: see ``record_trial``.
    """
    if recorder is not None:
        start_recording(recorder)
    interrupt, (profiler, explainer, rerun), narrator = None, instruments, Narrator()
    watchers = [watcher for watcher in (narrator, explainer, rerun) if watcher]

    def look(trial: SimulatedTrial) -> None:
        for watcher in watchers:
            watcher.look(trial)

    try:
        with profiler or nullcontext():
            trial.run(profiler.watching(progress) if profiler else progress, look)
    except KeyboardInterrupt as signal:
        interrupt = signal
    with undisturbed():
        announce("writing")
        result = _told(trial)
        reported = TrialReport(trial, result, directory.path)
        result.cause = reported.cause
        files = {"result.json": result.save, "log.npz": trial.log.save, **trial.further_files()}
        if trial.traceback:
            files["error.txt"] = lambda path: write_text(path, trial.traceback)
        story = narrator.finish(trial)
        if story.tracks:
            files["story.json"] = story.save
        if rerun is not None:
            rerun.finish(story)
        if explainer is not None:
            files["explain.html"] = lambda path: write_text(path, explanation_of(trial, explainer, result))
        if profiler is not None:
            found = cache(lambda: profile_of(trial, profiler))
            files["profile.json"] = lambda path: found().save_json(path)
            files["profile.html"] = lambda path: found().save_html(path)
        if recorder is not None:  # after all else of it: the simulation may go on
            files["recording.html"] = lambda path: _save_recording(trial, recorder, story, path)
        if report:
            files[REPORT] = reported.save  # last: it links to the others
        failures = _write(files, directory)
    if interrupt is not None:
        if failures:
            announce(failures)
        raise interrupt
    if trial.refusal is not None:
        raise trial.refusal
    if failures:
        raise UserInputError(f"{result.reason.replace('_', ' ')} after {result.sim_time:.1f} s, but {failures}")
    return result


def _save_recording(trial: SimulatedTrial, recorder, story: Story, path: Path) -> None:
    """Writes recording.html; after a fall it shows what became of the robot."""
    if trial.verdict is not None and trial.verdict.reason in _FALLS:
        trial.go_on(AFTERMATH)
    save_recording(recorder, path, story, robot=trial.robot.name)


def _told(trial: SimulatedTrial) -> TrialResult:
    """The result of the trial; less of it where a trial that broke off cannot even be looked at any more."""
    try:
        return trial.result()
    except BREAKDOWNS:
        trial.traceback += traceback.format_exc()
        return SimulatedTrial.result(trial, planner=getattr(trial.config, "planner", ""))


def _write(files: dict[str, Callable[[Path], None]], directory: ResultDirectory) -> str:
    """Writes as many of the ``files`` as possible; returns what there is to say about the others, if any."""
    failures = []
    for name, save in files.items():
        try:
            save(directory.path / name)
        except OSError as error:
            failures.append(f"{name} ({why(error)})")
        except BREAKDOWNS as error:
            failures.append(f"{name} ({in_one_line(error)})")
    kept = f"; there are {', '.join(directory.present())}" if directory.present() else ""
    return f"in {directory.path} could not be written: {', '.join(failures)}{kept}" if failures else ""
