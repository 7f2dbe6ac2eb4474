"""summary.md: what a bench says, for people."""

from collections import Counter

import numpy as np

from quadpips_drake.benchmark.bench.reporting.published import published
from quadpips_drake.benchmark.bench.reporting.sweep import difficulty_title, sweeps_of
from quadpips_drake.benchmark.bench.scores import CONFIDENCE, Score, grouped, score_of, tally
from quadpips_drake.benchmark.bench.settings import BenchSettings

GROUP = ("robot", "terrain", "planner")
"""What is counted together."""
SWINGS = "swing_trajectory"
"""Key of the fallbacks that counts swings for which the optimiser found no feasible motion."""
INTERVAL = f"{100 * CONFIDENCE:g} % interval (Wilson)"
"""Title of a column."""


def summary(settings: BenchSettings, rows: list[dict], pictures: dict[str, str] | None = None) -> str:
    """The page as markdown.

    Args:
        settings: of the bench.
        rows: of the trials that are over, with "recording": a path to be shown, or None.
        pictures: file name -> what it shows.
    """
    shown = [f"## {title}\n\n![{title}]({name})" for name, title in (pictures or {}).items()]
    parts = [_head(settings, rows), _successes(rows), _sweeps(rows), *shown]
    parts += [_failures(rows), _motion(rows), _timings(rows), _versions(rows)]
    return "\n\n".join(filter(None, parts)) + "\n"


def markdown_table(head: list[str], lines: list[list]) -> str:
    """A table; what stands in its cells cannot break it."""
    return "\n".join(
        [
            "| " + " | ".join(head) + " |",
            "|" + "---|" * len(head),
            *("| " + " | ".join(_cell(value) for value in line) + " |" for line in lines),
        ]
    )


def _cell(value) -> str:
    return " ".join(str(value).split()).replace("|", "\\|")


def _head(settings: BenchSettings, rows: list[dict]) -> str:
    wanted = len(settings.trial_specs())
    seeds = f"{settings.seed} to {settings.seed + settings.trials - 1}" if settings.trials > 1 else f"{settings.seed}"
    lines = ["# Bench", f"Trials: {len(rows)}. Goals reached: {score_of(rows).reached}. Seeds: {seeds}."]
    if len(rows) < wanted:
        lines.append(f"**Not complete: {wanted - len(rows)} of {wanted} trials are missing.**")
    special = [f"regions: {settings.regions}"] if settings.regions else []
    special += [f"at most {settings.duration:g} s"] if settings.duration is not None else []
    special += [f"`{text}`" for text in settings.sets]
    if special:
        lines.append(f"Settings: {', '.join(special)}.")
    return "\n\n".join(lines)


def _successes(rows: list[dict]) -> str:
    lines = []
    for (robot, planner), group in grouped(rows, ("robot", "planner")).items():
        scores = tally(group, ("terrain",))
        for (terrain,), score in scores.items():
            paper = published(robot, planner, terrain, group[0]["difficulty"])  # a bench has difficulties for all, or none
            lines.append([robot, terrain, planner, *_shown(score), paper or "-"])
        if len(scores) > 1:
            lines.append([robot, "**all**", planner, *_shown(score_of(group)), ""])
    note = (
        "\n\nPaper: QuadPiPS (2026), the planner of that name, ANYmal C, another simulator; in brackets where it tells no "
        "count and mentions no failure, or no success. Two counts: its text and its figure differ."
    )
    return (
        "## Goals reached\n\n"
        + markdown_table(["robot", "terrain", "planner", "reached", "rate", INTERVAL, "paper"], lines)
        + (note if any(line[-1] not in ("-", "") for line in lines) else "")
    )


def _shown(score: Score) -> list[str]:
    low, high = score.interval
    return [f"{score.reached}/{score.trials}", percent(score.rate), f"{percent(low)} to {percent(high)}"]


def percent(share: float) -> str:
    """A share in per cent."""
    return f"{100 * share:.0f} %"


def _sweeps(rows: list[dict]) -> str:
    sweeps = sweeps_of(rows)
    if not sweeps:
        return ""
    lines = [
        [*key, f"{difficulty:g}", difficulty_title(key[1]), *_shown(score)]
        for key, sweep in sweeps.items()
        for difficulty, score in zip(sweep.difficulties, sweep.scores, strict=True)
    ]
    found = {key: sweep.half() for key, sweep in sweeps.items()}
    halves = [
        [*key, "not in this range" if half is None else f"{half:.3g}", difficulty_title(key[1])]
        for key, half in found.items()
    ]
    note = "Half succeed: where the isotonic (monotone least-squares) fit of the rates, joined by straight lines, is 50 %."
    head = ["robot", "terrain", "planner"]
    return "\n\n".join(
        [
            "## Success against difficulty",
            markdown_table([*head, "difficulty at which half succeed", "of"], halves),
            note,
            markdown_table([*head, "difficulty", "of", "reached", "rate", INTERVAL], lines),
        ]
    )


def _failures(rows: list[dict]) -> str:
    failures = [row for group in grouped(rows, GROUP).values() for row in group if not row["success"]]
    if not failures:
        return ""
    reasons = Counter(row["reason"] for row in failures)
    lines = [
        [
            row["robot"],
            row["terrain"] if row["difficulty"] is None else f"{row['terrain']} at {row['difficulty']:g}",
            row["planner"],
            row["seed"],
            row["reason"].replace("_", " "),
            f"{row['sim_time']:.1f} s",
            percent(row["progress"][-1][1]) if row["progress"] else "-",
            row["detail"],
            _cause(row),
            recording_of(row),
        ]
        for row in failures
    ]
    head = ["robot", "terrain", "planner", "seed", "reason", "after", "progress", "detail", "most likely cause", "recording"]
    counted = ", ".join(f"{reason.replace('_', ' ')} {count}" for reason, count in reasons.most_common())
    return f"## Failures\n\n{len(failures)}: {counted}.\n\n{markdown_table(head, lines)}"


def _cause(row: dict) -> str:
    """What the post-mortem of a trial names first, and since when; benches of earlier versions have none."""
    cause = row.get("cause")
    return f"{cause['cause']}, since {cause['time']:.1f} s: {cause['text']}" if cause else "-"


def recording_of(row: dict) -> str:
    """The link to the recording of a trial, and what is wrong with it, if anything."""
    path, remark = row.get("recording"), row.get("recording_remark") or ""
    link = f"[recording]({path})" if path else ""
    return " ".join(filter(None, [link, remark])) or "-"


def _motion(rows: list[dict]) -> str:
    lines = []
    for key, group in grouped(rows, GROUP).items():
        swings = sum((row["fallbacks"] or {}).get(SWINGS, 0) for row in group)
        fallen_back: Counter = Counter()
        for row in group:
            fallen_back.update({name: count for name, count in row["fallbacks"].items() if name != SWINGS and count})
        feet = [sum(row["footholds"].get(name) or 0 for row in group) for name in ("planned", "missed", "slipped")]
        others = ", ".join(f"{name} {count}" for name, count in fallen_back.most_common()) or "none"
        times = [row["sim_time"] for row in group if row["success"]]
        median = f"{np.median(times):.1f} s" if times else "-"
        lines.append([*key, swings, sum(row["replans"] for row in group), *feet, median, others])
    head = ["robot", "terrain", "planner", "swings refused", "plans", "footholds", "missed", "slipped"]
    note = (
        "Sums over all trials. A swing is refused when no feasible motion was found for it. Missed and slipped footholds: "
        "see docs/running.md."
    )
    table = markdown_table([*head, "time to the goal, median", "other fallbacks"], lines)
    return f"## Swings, footholds, fallbacks\n\n{note}\n\n{table}"


def stage_timings(rows: list[dict]) -> dict[str, dict[str, float]]:
    """{stage: calls, their mean, medians over the trials of p50 and p95, longest [ms]}."""
    stages = sorted({stage for row in rows for stage in row["timings_ms"]})
    found = {}
    for stage in stages:
        of_trials = [row["timings_ms"][stage] for row in rows if stage in row["timings_ms"]]
        calls = sum(timing["n"] for timing in of_trials)
        found[stage] = {
            "calls": calls,
            "mean": sum(timing["total"] for timing in of_trials) / calls,
            "p50": float(np.median([timing["p50"] for timing in of_trials])),
            "p95": float(np.median([timing["p95"] for timing in of_trials])),
            "max": max(timing["max"] for timing in of_trials),
        }
    return found


def _timings(rows: list[dict]) -> str:
    parts = []
    for (robot, planner), group in grouped(rows, ("robot", "planner")).items():
        lines = [
            [stage, timing["calls"], *(f"{timing[name]:.2f}" for name in ("mean", "p50", "p95", "max"))]
            for stage, timing in stage_timings(group).items()
        ]
        if lines:
            head = ["stage", "calls", "mean [ms]", "p50 [ms]", "p95 [ms]", "longest [ms]"]
            parts.append(f"{robot}, {planner}:\n\n{markdown_table(head, lines)}")
    factors = [row["realtime_factor"] for row in rows if row["realtime_factor"]]
    if not parts:
        return ""
    note = (
        "Wall-clock time, with as many trials at a time as there were workers. p50 and p95: medians over the trials of each "
        f"trial's own percentiles. Real-time factor of the trials, median: {np.median(factors):.2f}."
    )
    return "\n\n".join(["## Computing time", note, *parts])


def _versions(rows: list[dict]) -> str:
    kinds = sorted({", ".join(f"{name} {number}" for name, number in row["versions"].items()) for row in rows})
    mixed = " **The trials come from different versions.**" if len(kinds) > 1 else ""
    return f"## Versions\n\n{'; '.join(kinds)}.{mixed}"
