"""The curve of a latency sweep: success against the factor on all latencies."""

import numpy as np
from matplotlib.figure import Figure
from scipy.stats import beta

from quadpips_drake.benchmark.latency_study import successes


def sweep_figure(results: dict) -> Figure:
    """Goals reached with their exact 95 % intervals, and the median time to the goal, against the factor."""
    figure = Figure(figsize=(10, 4), layout="constrained")
    rates, times = figure.subplots(1, 2)
    for k, (terrain, by_factor) in enumerate(successes(results).items()):
        factors = np.array(list(by_factor))
        reached, runs = np.array(list(by_factor.values()), dtype=float).T
        low, high = clopper_pearson(reached, runs)
        share = reached / runs
        places = np.arange(len(factors)) + 0.06 * (k - 1)  # side by side, and evenly: factors are nearly geometric
        rates.errorbar(places, share, [share - low, high - share], marker="o", capsize=3, label=terrain)
        medians = [_median_time(results, terrain, factor) for factor in factors]
        times.plot(places, medians, marker="o", label=terrain)
        for axes in (rates, times):
            axes.set_xticks(np.arange(len(factors)), [f"{factor:g}" for factor in factors])
    rates.set(ylabel="goals reached", ylim=(-0.03, 1.03))
    times.set(ylabel="time to the goal, median [s]")
    for axes in (rates, times):
        axes.set_xlabel("factor on all latencies")
        axes.grid(alpha=0.3)
    rates.legend(loc="lower left")
    return figure


def clopper_pearson(successes: np.ndarray, trials: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Ends of the exact 95 % interval of a success rate (Clopper and Pearson, 1934)."""
    low = np.where(successes > 0, beta.ppf(0.025, np.maximum(successes, 1), trials - successes + 1), 0.0)
    high = np.where(successes < trials, beta.ppf(0.975, successes + 1, np.maximum(trials - successes, 1)), 1.0)
    return low, high


def _median_time(results: dict, terrain: str, factor: float) -> float:
    prefix = f"{terrain}/{factor:g}/"
    times = [run["sim_time"] for key, run in results.items() if key.startswith(prefix) and run["success"]]
    return float(np.median(times)) if times else np.nan
