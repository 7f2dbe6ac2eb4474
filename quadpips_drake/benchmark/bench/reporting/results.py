"""results.parquet: a row for each trial, a column for each of its figures; read it with polars, pandas or DuckDB."""

from pathlib import Path

import polars

from quadpips_drake.files import replacing

RESULTS = "results.parquet"
"""The file, in the folder of a bench."""


def results_table(rows: list[dict]) -> polars.DataFrame:
    """All results as a table.

    Mappings become columns: ``fallbacks.STAGE``, ``footholds.COUNT``, ``timings_ms.STAGE.FIGURE``, ``versions.PACKAGE``;
    ``progress`` becomes two lists, ``progress.time`` [s] and ``progress.fraction``. What a trial has nothing of is null.
    """
    return polars.DataFrame([_flat(row) for row in rows], infer_schema_length=None)


def write_results(rows: list[dict], path: Path) -> None:
    """Writes the table of all results to ``path``."""
    with replacing(path) as unfinished:
        results_table(rows).write_parquet(unfinished)


def _flat(row: dict) -> dict:
    flat = {}
    for name, value in row.items():
        if name == "progress":
            flat["progress.time"] = [float(time) for time, _ in value]
            flat["progress.fraction"] = [float(fraction) for _, fraction in value]
        elif isinstance(value, dict):
            flat |= {f"{name}.{key}": item for key, item in _flat(value).items()}
        else:
            flat[name] = value
    return flat
