"""How computing time and memory grow with the size of what is computed, and the exponents of that."""

from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from quadpips_drake.benchmark import growth_loads
from quadpips_drake.benchmark.study_pool import Study, run_study

STORE, EXPONENTS, PICTURE = "growth.json", "exponents.json", "growth.png"
"""Files in the folder of the study: what was measured, by family and size; exponents, by family and curve; the curves."""
MEMORY = "memory, added"
"""The name of the curve of memory; its values are megabytes, those of the others seconds."""
_LEAST_MEMORY = 5.0
"""What is less [MB] says nothing about growth: memory comes and goes in such pieces."""


@dataclass(frozen=True)
class Family:
    """What is made larger and larger."""

    counted: str
    """What its sizes count, for people."""
    load: str
    """The function of growth_loads."""
    sizes: tuple[int, ...]
    quick_sizes: tuple[int, ...]


FAMILIES = {
    "elements": Family("terrain elements", "elements", (10, 20, 50, 100, 200, 500, 1000, 2000, 5000), (10, 20)),
    "image": Family("pixels of the depth image", "image", (4800, 19200, 76800, 307200, 1228800), (4800, 19200)),
    "knots": Family("knots of the control problem", "knots", (10, 20, 50, 100, 200), (10, 20)),
    "regions": Family("planar regions", "regions", (5, 10, 20, 50, 100, 200, 500), (5, 10)),
}
"""By the names for the command line."""


def run_growth(names: list[str], folder: Path, results: dict, *, quick: bool = False) -> Study:
    """Measures what is missing in ``results``, {"family/size": point}, one size after the other, each in its own process.

    Args:
        names: of FAMILIES.
        folder: for the results, see ``run_study``.
        results: of earlier runs.
        quick: two small sizes of each family and few repetitions; to see that it works.
    """
    jobs = {}
    for name in names:
        family = FAMILIES[name]
        for size in family.quick_sizes if quick else family.sizes:
            key = _key(name, size, quick)
            if key not in results:
                jobs[key] = partial(measure, family.load, size, quick)
    return run_study(jobs, folder / STORE, results, workers=1, description="sizes", jobs_per_process=1)


def measure(load: str, size: int, quick: bool) -> dict:
    """One point: {"seconds": by curve, "memory_mb": {"peak", "added"}}."""
    return getattr(growth_loads, load)(size, quick)


def _key(name: str, size: int, quick: bool) -> str:
    return f"{name}/{size}" + ("/quick" if quick else "")


def curves(results: dict, name: str, *, quick: bool = False) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Sizes and values by curve of the family ``name``, in rising order; those without any are left out."""
    found: dict[str, list[tuple[int, float]]] = {}
    family = FAMILIES[name]
    for size in family.quick_sizes if quick else family.sizes:
        point = results.get(_key(name, size, quick))
        if point is not None:
            for curve, value in {**point["seconds"], MEMORY: point["memory_mb"]["added"]}.items():
                found.setdefault(curve, []).append((size, value))
    return {curve: tuple(np.array(pairs, dtype=float).T) for curve, pairs in found.items()}


def upper_half(sizes: np.ndarray) -> np.ndarray:
    """Which ``sizes`` lie in the upper half of their range on a logarithmic scale, bool (n,); the two largest at least."""
    middle = np.sqrt(sizes.min() * sizes.max()) * (1.0 - 1e-9)
    return sizes >= min(middle, np.sort(sizes)[-2:][0])


def fitted_power(sizes: np.ndarray, values: np.ndarray) -> tuple[float, float] | None:
    """Returns factor c and exponent p of c n^p, by least squares on the logarithms over the upper half of the sizes.

    Constants, which hide the growth of what is small, count little there. None where fewer than two values are positive.
    """
    used = upper_half(sizes) & (values > 0.0)
    if used.sum() < 2:
        return None
    exponent, offset = np.polyfit(np.log(sizes[used]), np.log(values[used]), 1)
    return float(np.exp(offset)), float(exponent)


def power_of(curve: str, sizes: np.ndarray, values: np.ndarray) -> tuple[float, float] | None:
    """The ``fitted_power`` of a curve, where it says something."""
    least = _LEAST_MEMORY if curve == MEMORY else 0.0
    return fitted_power(sizes, np.where(values >= least, values, 0.0))


def exponents(results: dict, names: list[str], *, quick: bool = False) -> dict[str, dict[str, float]]:
    """Fitted exponents by family and curve."""
    fitted = {}
    for name in names:
        powers = {curve: power_of(curve, *points) for curve, points in curves(results, name, quick=quick).items()}
        fitted[name] = {curve: round(power[1], 3) for curve, power in powers.items() if power is not None}
    return fitted


def table_rows(results: dict, names: list[str], *, quick: bool = False) -> list[tuple[str, str, str, str, str]]:
    """For a table: what grows, curve, its values at the smallest and at the largest size, and the exponent."""
    rows = []
    for name in names:
        for curve, (sizes, values) in curves(results, name, quick=quick).items():
            power = power_of(curve, sizes, values)
            ends = [f"{_shown(curve, values[i])} at {sizes[i]:.0f}" for i in (0, -1)]
            rows.append((FAMILIES[name].counted, curve, *ends, "-" if power is None else f"{power[1]:.2f}"))
    return rows


def _shown(curve: str, value: float) -> str:
    if curve == MEMORY:
        return f"{value:.0f} MB"
    return f"{value:.2f} s" if value >= 0.1 else f"{1e3 * value:.3g} ms"
