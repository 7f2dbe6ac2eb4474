"""Several trials side by side on one page."""

from collections.abc import Iterator
from dataclasses import asdict
from html import escape
from os.path import relpath
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from quadpips_drake.html_page import page, picture, table
from quadpips_drake.trials.reporting.measurements import largest_torque, lateness_of, mass_of, sliding_of
from quadpips_drake.trials.reporting.overview_figure import thinned
from quadpips_drake.trials.reporting.post_mortem import PostMortem
from quadpips_drake.trials.reporting.report_page import REPORT
from quadpips_drake.trials.reporting.trial_record import TrialRecord
from quadpips_drake.trials.reporting.words import counted, verdict

MOST = 12
"""So many trials can be compared."""
TITLE = "Compared trials"
_MOST_SETTINGS = 60
_NO_PART = "(no such part)"
_STYLES = ("-", "--", ":")

Examined = tuple[TrialRecord, PostMortem | None]


def comparison_page(trials: list[Examined], place: Path) -> str:
    """Returns the page about several trials; ``place``: where it will be, for links to their own reports."""
    names = [
        f'<a href="{escape(relpath(record.folder / REPORT, place.parent))}">{escape(record.name)}</a>'
        for record, _ in trials
    ]
    head = ("", *names)
    columns = tuple(range(len(trials) + 1))
    rows = ((name, *cells) for name, cells in _rows(trials))
    parts = [
        f"<h1>{TITLE}: {len(trials)}</h1>",
        table(head, rows, text=columns),
        "<h2>On one time axis</h2>",
        f"<p>{picture(_overlay([record for record, _ in trials]), 'base and torques of all trials over time')}</p>",
        "<h2>Settings that differ</h2>",
        _settings([record for record, _ in trials], head),
        "<h2>Computing time of the stages: median and 95 % [ms]</h2>",
        table(head, _timings([record for record, _ in trials]), text=columns),
    ]
    return page(TITLE, "\n".join(parts))


def _rows(trials: list[Examined]) -> Iterator[tuple[str, list[str]]]:
    """Rows of the first table: a name, and a cell for each trial."""

    def cells(of) -> list[str]:
        return [escape(of(record, found)) for record, found in trials]

    yield "verdict", cells(verdict)
    yield "what came first", cells(lambda _, found: found.first.cause if found is not None and found.first else "")
    yield "where to look", cells(lambda _, found: ", ".join(found.first.keys) if found is not None and found.first else "")
    yield "simulated", cells(lambda record, _: f"{record.result.sim_time:.2f} s")
    yield "real-time factor", cells(lambda record, _: f"{record.result.realtime_factor:.2f}")
    yield "plans after the first", cells(lambda record, _: str(record.result.replans))
    for name in ("events", "fallbacks", "footholds"):
        yield name, cells(lambda record, _, name=name: counted(getattr(record.result, name)))
    yield "largest tilt", cells(_with_log(lambda record: f"{np.nanmax(np.abs(record.log['rpy_WB'][:, :2])):.2f} rad"))
    yield "largest torque", cells(_with_log(lambda record: _shown(largest_torque(record), "{:.0%} of its limit")))
    yield "mass on the feet", cells(_with_log(lambda record: _shown(mass_of(record), "{:.1f} kg")))
    yield (
        "friction of feet that slid",
        cells(_with_log(lambda record: _shown(getattr(sliding_of(record), "friction", None)))),
    )
    yield (
        "delay of the MPC",
        cells(_with_log(lambda record: _shown(getattr(lateness_of(record), "latency", None), "{:.3f} s"))),
    )


def _with_log(of):
    """``of(record)``, or nothing where there is no log."""
    return lambda record, _: of(record) if len(record.log) else ""


def _shown(value: float | None, form: str = "{:.2f}") -> str:
    return "" if value is None else form.format(value)


def _overlay(records: list[TrialRecord]) -> Figure:
    """Speed, height and tilt of the base and the largest torque of all trials over time."""
    figure = Figure(figsize=(12.0, 8.0), layout="constrained")
    rows = figure.subplots(4, 1, sharex=True)
    names = ("speed [m/s]", "height z [m]", "tilt [deg]", "largest torque\n/ limit [1]")
    for k, record in enumerate(records):
        if not len(record.log):
            continue
        log = thinned(record.log)
        torques = np.abs(log["joint_torques"])
        limits = record.robot.effort_limits if record.robot is not None else np.full(torques.shape[1], np.nan)
        curves = (
            np.hypot(log["v_WB"][:, 0], log["v_WB"][:, 1]),
            log["p_WB"][:, 2],
            np.rad2deg(np.abs(log["rpy_WB"][:, :2]).max(axis=1)),
            (torques / limits).max(axis=1),
        )
        for axes, curve in zip(rows, curves, strict=True):
            axes.plot(log["time"], curve, _STYLES[k // 10 % 3], color=f"C{k % 10}", linewidth=1.0, label=record.name[:40])
    for axes, name in zip(rows, names, strict=True):
        axes.set_ylabel(name)
        axes.grid(alpha=0.3)
    if rows[0].lines:
        rows[0].legend(loc="best", fontsize=8)
    rows[-1].set_xlabel("time t [s]")
    return figure


def _settings(records: list[TrialRecord], head: tuple[str, ...]) -> str:
    """The table of settings in which the configurations differ."""
    known = [_flat(asdict(record.config)) if record.config is not None else {} for record in records]
    # A trial that has no such part (a walk no perception, say) or no configuration any more does not differ in it.
    keys = dict.fromkeys(key for values in known for key in values)
    differing = [key for key in keys if len({str(values[key]) for values in known if key in values}) > 1]
    rows = (
        (f"<code>{escape(key)}</code>", *(escape(str(values.get(key, _NO_PART))[:200]) for values in known))
        for key in differing[:_MOST_SETTINGS]
    )
    more = f"<p>... and {len(differing) - _MOST_SETTINGS} more.</p>" if len(differing) > _MOST_SETTINGS else ""
    shown = table(head, rows, text=tuple(range(len(head)))) + more if differing else "<p>None.</p>"
    return shown + _parts(records, known)


def _parts(records: list[TrialRecord], known: list[dict]) -> str:
    """Says which parts of the configuration only some of the trials have."""
    parts = dict.fromkeys(_part(key) for values in known for key in values)
    lines = []
    for record, values in zip(records, known, strict=True):
        own = {_part(key) for key in values}
        lacking = ", ".join(f"<code>{escape(part)}</code>" for part in parts if part not in own)
        if values and lacking:
            lines.append(f"<p>There is no such part in {escape(record.name)}: {lacking}.</p>")
    return "".join(lines)


def _part(key: str) -> str:
    """The part of the configuration to which a key belongs."""
    return ".".join(key.split(".")[:2])


def _flat(values: dict, prefix: str = "") -> dict:
    """Values by dotted key."""
    found = {}
    for key, value in values.items():
        found |= _flat(value, f"{prefix}{key}.") if isinstance(value, dict) else {prefix + key: value}
    return found


def _timings(records: list[TrialRecord]) -> Iterator[tuple]:
    stages = dict.fromkeys(stage for record in records for stage in record.result.timings_ms)
    for stage in stages:
        rows = [record.result.timings_ms.get(stage) for record in records]
        yield escape(str(stage)), *(f"{_ms(row, 'p50')}, {_ms(row, 'p95')}" if isinstance(row, dict) else "" for row in rows)


def _ms(row: dict, key: str) -> str:
    value = row.get(key)
    return f"{value:.2f}" if isinstance(value, int | float) else "?"
