"""Recordings of the trials of a bench: made with a trial, or afterwards by running it again from its seed."""

from contextlib import closing
from functools import partial
from pathlib import Path

from quadpips_drake.benchmark.bench.bench import Onlooker, Pool, RunTrial, why
from quadpips_drake.benchmark.bench.journal import Journal
from quadpips_drake.benchmark.bench.rows import BenchTrial, told_in_one_line
from quadpips_drake.benchmark.bench.settings import BenchSettings, TrialSpec
from quadpips_drake.files import write_bytes

RECORDINGS, FOLDER = "recordings.jsonl", "recordings"
"""The journal of the recordings, and where they lie, in the folder of a bench."""
WANTED = ("failed", "all", "none")
"""Of which trials there can be recordings."""


class Recordings:
    """The recordings in the folder of a bench; a context manager as its journal is."""

    def __init__(self, folder: Path):
        """Args: of the bench. UserInputError: as from ``Journal``."""
        self._folder = Path(folder)
        self.journal = Journal(self._folder / RECORDINGS)

    def __enter__(self) -> "Recordings":
        return self

    def __exit__(self, *_):
        self.journal.__exit__()

    def keep(self, spec: TrialSpec, trial: BenchTrial, wanted: dict | None = None) -> None:
        """Writes the recording of a trial and notes it.

        Args:
            spec: which trial.
            trial: what has come out.
            wanted: the row of the trial that it should show once more; None: it is that one itself.
        """
        name = None
        if trial.recording is not None:
            name = f"{FOLDER}/{spec.file_name}.html"
            (self._folder / FOLDER).mkdir(exist_ok=True)
            write_bytes(self._folder / name, trial.recording)
        remark = "" if name else "without a recording"
        if wanted is not None and trial.row["digest"] != wanted["digest"]:
            remark = f"shows ANOTHER run than the one that was counted: {told_in_one_line(trial.row)}"
        self._note(spec, name, remark)

    def missing(self, settings: BenchSettings, rows: dict[str, dict]) -> list[TrialSpec]:
        """The failed trials that have no recording and could have one; ``rows``: of the trials that are over, by key."""
        specs = [spec for spec in settings.trial_specs() if spec.key in rows and spec.key not in self.journal.entries]
        # Without a digest it never began, or its process died: it would do so again.
        return [spec for spec in specs if not rows[spec.key]["success"] and rows[spec.key]["digest"]]

    def add_missing(
        self, settings: BenchSettings, rows: dict[str, dict], pool: Pool, onlooker: Onlooker, run: RunTrial
    ) -> None:
        """Runs the trials that are ``missing`` again from their seeds, with a recording."""
        specs = {spec.key: spec for spec in self.missing(settings, rows)}
        jobs = {key: partial(run, spec, settings, record=True) for key, spec in specs.items()}
        with closing(pool.run(jobs, onlooker.tell)) as outcomes:
            for outcome in outcomes:
                spec = specs[outcome.key]
                if outcome.error is None:
                    self.keep(spec, outcome.value, rows[spec.key])
                    onlooker.note(outcome.value.row)
                else:
                    self._note(spec, None, f"without a recording: {why(outcome.error)}")

    def _note(self, spec: TrialSpec, name: str | None, remark: str) -> None:
        if spec.key not in self.journal.entries:
            self.journal.append(spec.key, {"recording": name, "recording_remark": remark})
