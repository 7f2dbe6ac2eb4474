"""What a bench keeps of a trial: a row of plain data. Apart from those who run trials, so that it is light to import."""

from dataclasses import dataclass

from quadpips_drake.benchmark.bench.settings import TrialSpec
from quadpips_drake.trials.result import TrialResult, installed_versions


@dataclass(frozen=True)
class BenchTrial:
    """What has come out of one trial."""

    row: dict
    """Plain data: the fields of ``TrialSpec`` and ``TrialResult``, and "digest", by which the same bits are known again."""
    recording: bytes | None = None
    """Content of recording.html."""


def row_of(spec: TrialSpec, result: TrialResult, digest: str) -> dict:
    """The row of a trial that was run."""
    # Robot and terrain as they were asked for: of files, the paths; two of them could have the same name in them.
    names = {"robot": spec.robot, "terrain": spec.terrain, "difficulty": spec.difficulty}
    return {**result.plain(), **names, "digest": digest}


def row_without_trial(spec: TrialSpec, why: str) -> dict:
    """The row of a trial that has no result of its own: its process ended, or it could not be built."""
    result = TrialResult(
        False, "error", spec.robot, spec.terrain, spec.planner, spec.seed, why, versions=installed_versions()
    )
    return row_of(spec, result, "")


def told_in_one_line(row: dict) -> str:
    """How a trial ended, for people."""
    where = "" if row["difficulty"] is None else f" difficulty {row['difficulty']:g}"
    detail = f": {row['detail']}" if row["detail"] else ""
    ended = f"{row['reason'].replace('_', ' ')} after {row['sim_time']:.1f} s"
    return f"{row['robot']} {row['terrain']}{where} {row['planner']} seed {row['seed']}: {ended}{detail}"
