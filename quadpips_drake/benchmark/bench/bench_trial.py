"""One trial of a bench: run in a worker process, told as plain data."""

import hashlib
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from quadpips_drake.benchmark.bench.rows import BenchTrial, row_of
from quadpips_drake.benchmark.bench.settings import BenchSettings, TrialSpec
from quadpips_drake.trials.loading import load_config
from quadpips_drake.trials.reporting.report import TrialReport
from quadpips_drake.trials.trial import Trial, TrialConfig, run_trial
from quadpips_drake.trials.warming.warm_up import warm_up

DIGEST_OF = ("time", "p_WB", "rpy_WB", "joint_positions", "joint_torques", "contact_forces")
"""Arrays of the log whose bits tell two trials apart."""


def run_bench_trial(spec: TrialSpec, settings: BenchSettings, record: bool = False) -> BenchTrial:
    """Runs one trial, with a recording when that is wanted; a trial that breaks off has a row, too.

    Raises:
        UserInputError: the trial cannot be had as it was asked for.
    """
    config = config_of(spec, settings)
    if record:
        return _recorded(spec, config)
    warm_up()
    trial = Trial(config)
    trial.run()
    result = trial.result()
    result.cause = TrialReport(trial, result, Path()).cause
    return BenchTrial(row_of(spec, result, digest_of(trial.log.arrays())))


def config_of(spec: TrialSpec, settings: BenchSettings) -> TrialConfig:
    """The configuration of a trial; raises UserInputError where there is no such thing."""
    options = {"terrain": spec.terrain, "planner": spec.planner, "seed": spec.seed}
    if settings.duration is not None:
        options["duration"] = settings.duration
    if spec.difficulty is not None:
        options["difficulty"] = spec.difficulty
    regions = [f"stages.region_source={settings.regions}"] if settings.regions else []
    return load_config(spec.robot, sets=(*regions, *settings.sets), **options)


def digest_of(arrays) -> str:
    """A fingerprint of the motion in the arrays of a log."""
    found = hashlib.sha256()
    for name in DIGEST_OF:
        if name in arrays:
            found.update(np.ascontiguousarray(arrays[name]).tobytes())
    return found.hexdigest()[:16]


def _recorded(spec: TrialSpec, config: TrialConfig) -> BenchTrial:
    """Runs a trial as ``quadpips run`` does; its files travel as bytes: the worker may be on another machine."""
    with TemporaryDirectory(prefix="quadpips-bench-") as folder:
        result = run_trial(config, Path(folder), recording=True, report=False, overwrite=True)
        log, recording = Path(folder) / "log.npz", Path(folder) / "recording.html"
        digest = ""
        if log.exists():
            with np.load(log) as arrays:
                digest = digest_of(arrays)
        return BenchTrial(row_of(spec, result, digest), recording.read_bytes() if recording.exists() else None)
