"""The report of one trial: its post-mortem and its page, as a trial writes them and as ``quadpips report`` does again."""

import traceback
from dataclasses import asdict, replace
from html import escape
from pathlib import Path

from quadpips_drake.errors import UserInputError
from quadpips_drake.files import read_text, write_text
from quadpips_drake.html_page import page
from quadpips_drake.trials.reporting.comparison_page import TITLE, comparison_page
from quadpips_drake.trials.reporting.post_mortem import PostMortem, post_mortem_of, repeating
from quadpips_drake.trials.reporting.report_page import REPORT, report_page
from quadpips_drake.trials.reporting.trial_record import TrialRecord, record_of
from quadpips_drake.trials.reporting.words import last_lines, verdict
from quadpips_drake.trials.result import TrialResult
from quadpips_drake.trials.simulated_trial import BREAKDOWNS, in_one_line

_LARGEST_PAGE, _HEAD = 200_000_000, 1000


class TrialReport:
    """Of a trial that has just ended; whatever goes wrong in here does not spoil the trial, but is told on the page."""

    def __init__(self, trial, result: TrialResult, folder: Path):
        """Args: the SimulatedTrial; its result; where its files are."""
        self._record: TrialRecord | None = None
        self._found: PostMortem | None = None
        self._problem = ""
        try:
            self._record = record_of(trial, result, folder)
            self._found = post_mortem_of(self._record)
        except BREAKDOWNS:
            self._problem = traceback.format_exc()

    @property
    def cause(self) -> dict:
        """The most likely cause of a failure, for the result; empty where none was found."""
        return cause_of(self._found)

    def save(self, path: Path) -> None:
        """Writes the page."""
        if not self._problem:
            try:
                write_text(path, report_page(self._record, self._found))
                return
            except OSError:
                raise
            except BREAKDOWNS:
                self._problem = traceback.format_exc()
        write_text(path, page("Report", f"<h1>The report broke off</h1><pre>{escape(self._problem)}</pre>"))


def cause_of(found: PostMortem | None) -> dict:
    """The most likely cause, for result.json."""
    if found is None or found.first is None:
        return {}
    cause = asdict(found.first)
    return cause | {"time": round(cause["time"], 3), "weight": round(cause["weight"], 3), "keys": list(cause["keys"])}


def write_report(record: TrialRecord) -> PostMortem | None:
    """Writes the page of a trial into its directory anew; returns its post-mortem.

    Raises:
        UserInputError: that cannot be written, or the numbers in the files make no sense together.
    """
    try:
        found = post_mortem_of(record)
        page_of_it = report_page(record, found)
    except BREAKDOWNS as error:
        raise UserInputError(f"{record.folder}: no report can be made of these files: {in_one_line(error)}") from error
    try:
        write_text(record.folder / REPORT, page_of_it)
    except OSError as error:
        raise UserInputError(f"{record.folder}: cannot write there ({error.strerror or error})") from None
    return found


def tell(record: TrialRecord, found: PostMortem | None) -> list[str]:
    """What there is to say about a trial on the terminal."""
    lines = [verdict(record, found), *(f"remark:    {remark}" for remark in record.remarks)]
    lines += last_lines(replace(record.result, cause=cause_of(found)), repeating(record.is_walk, record.folder))[1:]
    return [*lines, f"report:    {record.folder / REPORT} (open it in a browser)"]


def compare(trials: list[tuple[TrialRecord, PostMortem | None]], place: Path) -> None:
    """Writes the page about several trials to ``place``; raises UserInputError when something else is there already."""
    if place.exists() and f"<title>{TITLE}</title>" not in read_text(place, max_bytes=_LARGEST_PAGE)[:_HEAD]:
        raise UserInputError(f"--out {place}: holds something else already; give another file")
    try:
        write_text(place, comparison_page(trials, place))
    except OSError as error:
        raise UserInputError(f"--out {place}: cannot write there ({error.strerror or error})") from None
