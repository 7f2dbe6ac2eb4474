"""Two benches side by side: the trials that both have, pair by pair."""

from pathlib import Path

from quadpips_drake.benchmark.bench.bench import JOURNAL
from quadpips_drake.benchmark.bench.journal import read_journal
from quadpips_drake.benchmark.bench.reporting.summary import markdown_table, percent
from quadpips_drake.benchmark.bench.scores import Comparison, compared, grouped
from quadpips_drake.benchmark.bench.settings import load_settings
from quadpips_drake.errors import UserInputError

PAIRED_BY = ("robot", "terrain", "difficulty", "seed")
"""What two trials must have in common to be a pair; planner and settings may differ."""


def load_rows(folder: Path) -> list[dict]:
    """All rows of the bench in ``folder``; it may still be running.

    Raises:
        UserInputError: there is none, it has no rows, or they cannot be read.
    """
    if load_settings(folder) is None:
        raise UserInputError(f"{folder}: there is no bench; give a directory of 'quadpips bench --out DIR'")
    rows = list(read_journal(Path(folder) / JOURNAL)[0].values())
    if not rows:
        raise UserInputError(f"{folder}: no trial of this bench is over yet")
    return rows


def comparison(rows_a: list[dict], rows_b: list[dict], name_a: str, name_b: str) -> str:
    """The comparison as markdown; ``name_a``, ``name_b``: what the benches are called.

    Raises:
        UserInputError: they have no trials in common, or several planners each.
    """
    planners = [sorted({row["planner"] for row in rows}) for rows in (rows_a, rows_b)]
    if planners[0] == planners[1]:
        parts = [_of_planner(rows_a, rows_b, planner, planner) for planner in planners[0]]
    elif len(planners[0]) == len(planners[1]) == 1:
        parts = [_of_planner(rows_a, rows_b, planners[0][0], planners[1][0])]
    else:
        raise UserInputError(f"{name_a} is of the planners {', '.join(planners[0])}, {name_b} of {', '.join(planners[1])}")
    if not any(parts):
        raise UserInputError(f"{name_a} and {name_b} have no trial in common (same robot, terrain, difficulty and seed)")
    note = (
        "Pairs have robot, terrain, difficulty and seed in common. p: McNemar's exact test (two-sided): how likely so "
        "uneven a split of the pairs with different outcomes would be if neither were better."
    )
    return "\n\n".join([f"# A: {name_a}, B: {name_b}", *filter(None, parts), note]) + "\n"


def pairs(rows_a: list[dict], rows_b: list[dict]) -> list[tuple[dict, dict]]:
    """Rows of both that belong together, in the order of A."""
    partners = {tuple(row[name] for name in PAIRED_BY): row for row in rows_b}
    keys = [tuple(row[name] for name in PAIRED_BY) for row in rows_a]
    return [(row, partners[key]) for row, key in zip(rows_a, keys, strict=True) if key in partners]


def _of_planner(rows_a: list[dict], rows_b: list[dict], planner_a: str, planner_b: str) -> str:
    """The table of one planner in each; empty where there are no pairs."""
    ours = [row for row in rows_a if row["planner"] == planner_a]
    theirs = [row for row in rows_b if row["planner"] == planner_b]
    found = [{"robot": a["robot"], "terrain": a["terrain"], "pair": (a, b)} for a, b in pairs(ours, theirs)]
    if not found:
        return ""
    lines = [[*key, *_counts(group)] for key, group in grouped(found, ("robot", "terrain")).items()]
    if len(lines) > 1:
        lines.append(["", "**all**", *_counts(found)])
    head = ["robot", "terrain", "pairs", "A", "B", "both", "only A", "only B", "neither", "p"]
    changed = [_change(*entry["pair"]) for entry in found if entry["pair"][0]["success"] != entry["pair"][1]["success"]]
    title = f"## {planner_a}" if planner_a == planner_b else f"## A: {planner_a}, B: {planner_b}"
    different = markdown_table(["robot", "terrain", "seed", "A", "B"], changed)
    alone = len(ours) + len(theirs) - 2 * len(found)
    remark = f"{alone} trials are in one of the two only." if alone else ""
    parts = [title, markdown_table(head, lines), remark, f"Different outcomes:\n\n{different}" if changed else ""]
    return "\n\n".join(filter(None, parts))


def _counts(group: list[dict]) -> list:
    result = compared((a["success"], b["success"]) for a, b in (entry["pair"] for entry in group))
    rates = [percent((result.both + only) / result.trials) for only in (result.only_a, result.only_b)]
    return [result.trials, *rates, *_cells(result)]


def _cells(result: Comparison) -> list:
    return [result.both, result.only_a, result.only_b, result.neither, f"{result.p_value:.3g}"]


def _change(a: dict, b: dict) -> list:
    where = a["terrain"] if a["difficulty"] is None else f"{a['terrain']} at {a['difficulty']:g}"
    ends = [f"{row['reason'].replace('_', ' ')} after {row['sim_time']:.1f} s" for row in (a, b)]
    return [a["robot"], where, a["seed"], *ends]
