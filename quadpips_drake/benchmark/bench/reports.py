"""What a bench leaves for its readers: results.parquet, summary.md."""

from pathlib import Path

from quadpips_drake.benchmark.bench.results import RESULTS, write_results
from quadpips_drake.benchmark.bench.settings import BenchSettings
from quadpips_drake.benchmark.bench.summary import summary
from quadpips_drake.files import write_text

SUMMARY = "summary.md"
"""The page, in the folder of a bench."""


def write_reports(settings: BenchSettings, rows: list[dict], folder: Path) -> None:
    """Writes all of them into ``folder``; ``rows``: of the trials that are over, at least one."""
    write_results(rows, folder / RESULTS)
    write_text(folder / SUMMARY, summary(settings, rows))
