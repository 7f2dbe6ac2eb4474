"""report.html: what a trial was, how it went and, after a failure, why; one page that needs no network."""

from collections.abc import Iterator
from html import escape

import numpy as np

from quadpips_drake.html_page import page, picture, table
from quadpips_drake.trials.explaining.end_section import end_section
from quadpips_drake.trials.reporting.case import Case, Finding
from quadpips_drake.trials.reporting.last_seconds import velocity_in_words
from quadpips_drake.trials.reporting.overview_figure import overview_figure, thinned
from quadpips_drake.trials.reporting.post_mortem import PostMortem
from quadpips_drake.trials.reporting.trial_record import CONFIG, LOG, RESULT, TrialRecord
from quadpips_drake.trials.reporting.way_figure import way_figure
from quadpips_drake.trials.reporting.words import counted, verdict
from quadpips_drake.visualization.plots import feet_figure, torque_figure

REPORT = "report.html"
_BESIDE = ("recording.html", "explain.html", "profile.html", RESULT, CONFIG, LOG)
"""Files that a report links to where they are beside it."""
_NOTES = 300
"""So many of the last notes are shown."""


def report_page(record: TrialRecord, found: PostMortem | None) -> str:
    """Returns the page about one trial; ``found``: its post-mortem, if there is one."""
    result, case = record.result, Case(record)
    title = f"{result.robot} on {result.terrain}, seed {result.seed}"
    story = "good story" if result.success else "story"
    parts = [
        f"<h1>{escape(title)}</h1>",
        f'<p class="{story}">{escape(verdict(record, found))}</p>',
        *(f"<p>{escape(remark)}</p>" for remark in record.remarks),
        f"<p>{_links(record)}</p>",
        table(("", ""), ((escape(name), escape(text)) for name, text in _facts(record)), text=(0, 1)),
    ]
    if found is not None:
        parts.append(_post_mortem(case, found))
    if len(record.log):
        parts += _pictures(case, found.first if found is not None else None)
    parts += [_timings(result.timings_ms), _notes(case)]
    return page(f"Report: {title}", "\n".join(parts))


def _links(record: TrialRecord) -> str:
    """Links to the other files of the trial."""
    there = [name for name in _BESIDE if (record.folder / name).is_file()]
    return "Beside this page: " + ", ".join(f'<a href="{name}">{name}</a>' for name in there) if there else ""


def _facts(record: TrialRecord) -> Iterator[tuple[str, str]]:
    """Rows of the table at the top."""
    result = record.result
    yield (
        "ended",
        f"{result.reason.replace('_', ' ')} at t = {result.sim_time:.2f} s{f': {result.detail}' * bool(result.detail)}",
    )
    if record.is_walk:
        yield from ((f"command {k + 1}", _command(c)) for k, c in enumerate(result.walk.get("commands", [])[:20]))
    else:
        distance = result.distance_to_goal
        yield "planner", f"{result.planner}; {result.replans} plans after the first"
        yield "distance to the goal", f"{distance:.2f} m at the end" if np.isfinite(distance) else "not known"
    counts = (("events", result.events), ("fallbacks", result.fallbacks), ("footholds", result.footholds))
    for name, entries in counts:
        yield name, counted(entries)
    for spawned in result.spawned[:20]:
        yield "appeared", ", ".join(f"{key} {value}" for key, value in spawned.items()) if isinstance(spawned, dict) else "?"
    yield "computed", f"{result.wall_time:.1f} s, {result.realtime_factor:.2f} times real time"


def _command(command) -> str:
    """A stretch of a walk in words."""
    if not isinstance(command, dict):
        return "?"
    asked, mean = (velocity_in_words(command.get(key)) for key in ("velocity", "mean_velocity"))
    said = f"{command.get('gait')} at {asked} from t = {command.get('begin')} s to {command.get('end')} s"
    return f"{said}; walked: {mean} in the mean" if "mean_velocity" in command else said


def _post_mortem(case: Case, found: PostMortem) -> str:
    """The section after a failure."""
    parts = ["<h2>Post-mortem</h2>"]
    first = found.first
    if first is None:
        parts.append("<p>Nothing was measured that explains this end.</p>")
    else:
        rows = [
            ("what came first", f"<b>{escape(first.cause)}</b>, {_since(case, first)}"),
            ("measured", escape(first.text)),
            ("where to look", f"system <code>{escape(first.system)}</code>"),
            ("configuration", ", ".join(f"<code>{escape(key)}</code>" for key in first.keys)),
            ("repeat it", f"<code>{escape(found.command)}</code>"),
        ]
        parts.append(table(("", ""), rows, text=(0, 1)))
    parts.append(
        f"""<div class="tables"><div><h3>Asked in the last two seconds</h3>{_list(found.asked)}</div>
<div><h3>Happened</h3>{_list(found.happened)}</div></div>"""
    )
    if len(found.findings) > 1:
        rows = (
            (f"{f.weight:.2f}", escape(f.cause), _since(case, f), escape(f.text), escape(f.system))
            for f in found.findings[1:]
        )
        head = ("weight [1]", "cause", "since", "measured", "system")
        parts.append(f"<h3>Measured too, but less likely the cause</h3>{table(head, rows, text=(1, 2, 3, 4))}")
    if case.moments is not None:
        parts.append(end_section(case.moments, case.result))
    return "\n".join(parts)


def _since(case: Case, finding: Finding) -> str:
    """When something began, in words."""
    begin = float(case.log["time"][0])
    return "from the beginning" if finding.time <= begin + 1e-9 else f"at t = {finding.time:.2f} s"


def _list(sentences: tuple[str, ...]) -> str:
    return f"<ul>{''.join(f'<li>{escape(sentence)}</li>' for sentence in sentences)}</ul>"


def _pictures(case: Case, first: Finding | None) -> Iterator[str]:
    """The sections with figures."""
    record, log = case.record, thinned(case.log)
    robot = record.robot
    yield "<h2>The whole trial</h2>"
    marks = ["Red line: what came first by the post-mortem."] if first is not None else []
    marks += ["Orange: pushes."] if np.any(record.log.get("push", 0.0)) else []
    if marks:
        yield f"<p>{' '.join(marks)}</p>"
    yield f"<p>{picture(overview_figure(case, first), 'phases, contacts, base, loads and control over time')}</p>"
    yield f"<h2>The way</h2><p>{picture(way_figure(case, first), 'the way over the terrain from above')}</p>"
    yield "<details><summary>Feet and forces</summary>"
    feet = feet_figure(log, record.terrain, robot.foot_radius if robot is not None else 0.0)
    yield f"<p>{picture(feet, 'soles, true ground, forces and contacts over time')}</p></details>"
    yield "<details><summary>Torques and their limits</summary>"
    torques = torque_figure(log, robot.effort_limits if robot is not None else None)
    yield f"<p>{picture(torques, 'joint torques over time')}</p></details>"


def _timings(timings: dict) -> str:
    """How long each stage computed."""
    rows = []
    stages = {name: row for name, row in timings.items() if isinstance(row, dict)}
    totals = {name: _number(row, "total") for name, row in stages.items()}
    whole = sum(totals.values()) or 1.0
    for name, row in sorted(stages.items(), key=lambda item: -totals[item[0]]):
        bar = f'<span class="bar" style="width:{round(200 * totals[name] / whole)}px"></span>'
        numbers = (f"{_number(row, key):.2f}" for key in ("p50", "p95", "max"))
        rows.append((escape(str(name)), int(_number(row, "n")), *numbers, f"{1e-3 * totals[name]:.2f}", bar))
    head = ("stage", "computations", "median [ms]", "95 % [ms]", "longest [ms]", "together [s]", "")
    return f"<h2>Computing time of the stages</h2>{table(head, rows, text=(0, 6))}" if rows else ""


def _number(row: dict, key: str) -> float:
    """A number of a table of timings; 0 where there is none."""
    value = row.get(key)
    return float(value) if isinstance(value, int | float) and np.isfinite(value) and value >= 0 else 0.0


def _notes(case: Case) -> str:
    """What the systems said."""
    said = list(zip(*(case.log.get(f"note_{name}", ()) for name in ("time", "source", "text")), strict=True))
    if not said:
        return ""
    rows = ((f"{time:.2f}", escape(str(source)), escape(str(text))) for time, source, text in said[-_NOTES:])
    return f"<details><summary>What the systems said</summary>{table(('t [s]', 'who', 'what'), rows, text=(1, 2))}</details>"
