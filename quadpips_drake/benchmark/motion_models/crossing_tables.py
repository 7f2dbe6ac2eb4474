"""What a study of crossings says, as markdown: the paper's Table II with ours beside it, and who crosses what."""

import numpy as np

from quadpips_drake.benchmark.bench.scores import Score
from quadpips_drake.benchmark.motion_models.crossings import Crossing

PAPER = {
    "gaps_symmetric": {
        "success, %": (100, 100, 100),
        "planning time, ms": (0.239, 0.924, 1.75),
        "cumulative cost": (32.6, 23.96, 20.95),
        "CDM MAE, m": (0.00786,),
        "FDM MAE, m": (0.0198,),
        "CVM MAE, m/s": (0.0317,),
    },
    "gaps_staggered": {
        "success, %": (100, 100, 100),
        "planning time, ms": (0.475, 0.765, 0.975),
        "cumulative cost": (25.2, 20.5, 18.1),
        "CDM MAE, m": (0.00360,),
        "FDM MAE, m": (0.0203,),
        "CVM MAE, m/s": (0.0369,),
    },
    "gaps_and_steps": {
        "success, %": (100, 100, 100),
        "planning time, ms": (0.234, 0.825, 1.20),
        "cumulative cost": (32.3, 26.3, 24.3),
        "CDM MAE, m": (0.00339,),
        "FDM MAE, m": (0.0170,),
        "CVM MAE, m/s": (0.0445,),
    },
}
"""Table II of Taouil et al., horizons 3, 5 and 7; three attempts each. What its MAEs are means of is not told; its authors'
logs fit the absolute value of the mean of signed errors."""
HORIZONS = (3, 5, 7)
_ERRORS = {"CDM MAE, m": "cdm", "FDM MAE, m": "fdm", "CVM MAE, m/s": "cvm"}


def table_2(results: dict, crossings: list[Crossing]) -> str:
    """Table II with ours beside it, learned models: one column for each robot and map, values by horizon.

    Of errors: true mean absolute error along x, and in brackets the mean of the signed ones, over all crossings together.
    """
    learned = [crossing for crossing in crossings if crossing.model == "learned"]
    columns = list(dict.fromkeys((crossing.robot, crossing.map) for crossing in learned))
    lines = [
        "| terrain | | the paper, N = 3 / 5 / 7 | " + " | ".join(f"{robot}, {map_}" for robot, map_ in columns) + " |",
        "|---|---|---|" + "---|" * len(columns),
    ]
    for terrain in dict.fromkeys(crossing.terrain for crossing in learned):
        for quantity in PAPER["gaps_symmetric"]:
            printed = " / ".join(f"{value:g}" for value in PAPER.get(terrain, {}).get(quantity, ())) or "-"
            cells = []
            for robot, map_ in columns:
                of = [c for c in learned if (c.robot, c.map, c.terrain) == (robot, map_, terrain)]
                cells.append(" / ".join(_cell(quantity, of, horizon, results) for horizon in _horizons(of)))
            lines.append(f"| {terrain} | {quantity} | {printed} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def table_of_crossings(results: dict, crossings: list[Crossing]) -> str:
    """Who crosses what: successes and clean ones with 95 % intervals, feet where no ground is, fallbacks, errors."""
    lines = [
        "| robot | terrain | map | model | N | success | clean | unsafe touch-downs | deepest, cm | replans "
        "| fallbacks | CDM, mm | FDM, mm | CVM, mm/s |",
        "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    for group in dict.fromkeys(crossing.group for crossing in crossings):
        robot, terrain, model, horizon, map_, more = group
        found = [results[c.key] for c in crossings if c.group == group and c.key in results]
        if not found:
            continue
        fallbacks = sum(sum(_own_fallbacks(trial).values()) for trial in found)
        cells = [
            robot,
            terrain,
            map_,
            f"{model} {more}".strip(),
            horizon if horizon != "0" else "-",
            _rate([trial["success"] for trial in found]),
            _rate([trial["clean"] for trial in found]),
            f"{sum(t['unsafe'] for t in found)} of {sum(t['touch_downs'] for t in found)}",
            f"{100 * max(trial['deepest_m'] for trial in found):.1f}",
            f"{np.mean([trial['replans'] for trial in found]):.0f}",
            f"{fallbacks}",
            *(_told_error(found, name, 1e3, 1) for name in ("cdm", "fdm", "cvm")),
        ]
        lines.append("| " + " | ".join(str(cell) for cell in cells) + " |")
    return "\n".join(lines)


def pooled_errors(found: list[dict], name: str) -> tuple[float, float] | None:
    """True mean absolute and mean signed error of a model along x over all steps of some crossings; None without any."""
    told = [trial["planning"]["errors"] for trial in found if trial.get("planning", {}).get("errors", {}).get("steps")]
    steps = np.array([errors["steps"] for errors in told], float)
    if not len(steps):
        return None
    values = np.array([[errors[name]["mae"], errors[name]["mean"]] for errors in told])
    mae, mean = steps @ values / steps.sum()
    return float(mae), float(mean)


def _horizons(crossings: list[Crossing]) -> list[int]:
    return list(dict.fromkeys(crossing.horizon for crossing in crossings))


def _cell(quantity: str, crossings: list[Crossing], horizon: int, results: dict) -> str:
    """What is measured for one horizon."""
    found = [results[c.key] for c in crossings if c.horizon == horizon and c.key in results]
    if not found:
        return "-"
    if quantity == "success, %":
        return f"{100 * np.mean([trial['success'] for trial in found]):.0f}"
    if quantity == "planning time, ms":
        return f"{_mean(found, 'search_ms'):.3g}"
    if quantity == "cumulative cost":
        return f"{_mean(found, 'cumulative_cost'):.4g}"
    return _told_error(found, _ERRORS[quantity], 1.0, 4)


def _mean(found: list[dict], name: str) -> float:
    values = [trial["planning"][name] for trial in found if name in trial.get("planning", {})]
    return float(np.mean(values)) if values else float("nan")


def _told_error(found: list[dict], name: str, scale: float, digits: int) -> str:
    errors = pooled_errors(found, name)
    return "-" if errors is None else f"{scale * errors[0]:.{digits}f} ({scale * errors[1]:+.{digits}f})"


def _rate(outcomes: list[bool]) -> str:
    """Successes of trials, with the 95 % interval of the rate."""
    score = Score(sum(outcomes), len(outcomes))
    low, high = score.interval
    return f"{sum(outcomes)}/{len(outcomes)} ({100 * low:.0f} to {100 * high:.0f} %)"


def _own_fallbacks(trial: dict) -> dict:
    """Those of the planner."""
    return {
        name: count for name, count in trial["fallbacks"].items() if name not in ("mpc", "wbc") and "unstable" not in name
    }
