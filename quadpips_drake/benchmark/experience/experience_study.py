"""The offline experiment of Asselmeier et al. (arXiv 2501.00112, section 4.1): trials until the first success.

One series repeats trials on one course in one mode; what was tried is kept after each trial, so that an interruption loses
at most the one that it stops.
"""

from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from pathlib import Path

import numpy as np

from quadpips_drake.benchmark.experience.course import OfflineCourse, label_image
from quadpips_drake.benchmark.experience.experience_trial import NO_PLAN, TrialRow, Walker
from quadpips_drake.benchmark.study_pool import Study, run_study
from quadpips_drake.diagrams.planning_module import PlanningConfig, first_library
from quadpips_drake.errors import UserInputError, unknown_name
from quadpips_drake.files import read_json, write_json
from quadpips_drake.interruption import undisturbed
from quadpips_drake.perception.steppability.model import load_model
from quadpips_drake.planning.experience.experience_file import load_library, save_library
from quadpips_drake.planning.experience.learning import learned
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.terrain.library import load_terrain
from quadpips_drake.values.swing_plan import ExperienceLibrary

STORE = "experience.json"
"""Results of all series, by key, in the folder of the study."""
MODES = ("none", "experience", "steppability", "both")
LABELS = ("network", "exact")
"""Where the labels of the modes that weigh them come from."""
SCOPES = ("site", "general")


@dataclass(frozen=True)
class Series:
    """Trials on one course in one mode."""

    mode: str
    labels: str
    """Of LABELS; empty in modes without."""
    robot: str
    terrain: str
    seed: int
    """Of the terrain."""
    scope: str = "site"
    """Of the experience."""

    @property
    def key(self) -> str:
        """Among the results of a study."""
        parts = (self.mode, self.labels, self.robot, self.terrain, self.scope if self.learns else "", str(self.seed))
        return "/".join(part for part in parts if part)

    @property
    def learns(self) -> bool:
        """Whether experience counts."""
        return self.mode in ("experience", "both")

    @property
    def title(self) -> str:
        """The mode, for tables."""
        return f"{self.mode}, {self.labels} labels" if self.labels else self.mode


def all_series(
    robot: str, terrain: str, modes: list[str], labels: list[str], seeds: list[int], scope: str = "site"
) -> list[Series]:
    """Series of all ``modes`` on all ``seeds``; those that weigh labels once with each kind of them.

    Raises:
        UserInputError: a name is unknown.
    """
    for kind, names, known in (("mode", modes, MODES), ("kind of labels", labels, LABELS), ("scope", [scope], SCOPES)):
        for name in names:
            if name not in known:
                raise unknown_name(kind, name, known)
    kinds = {mode: labels if mode in ("steppability", "both") else [""] for mode in modes}
    return [Series(mode, k, robot, terrain, seed, scope) for mode in modes for k in kinds[mode] for seed in seeds]


def run_experience_study(
    series: list[Series], trials: int, planning: PlanningConfig, folder: Path, results: dict, *, workers: int = 1
) -> Study:
    """Runs what is missing in ``results``; see ``run_series``. Series that share a library come one after the other.

    Raises:
        UserInputError: experience that is to be gone on from cannot be used.
    """
    chains: dict = {}
    for one in series:
        if not _is_complete(results.get(one.key), trials):
            _library_before(one, planning, folder)
            job = partial(run_series, one, trials, planning, folder)
            chains.setdefault(library_file(one, folder), []).append((one.key, job))
    following = {key: {later: job} for chain in chains.values() for (key, _), (later, job) in pairwise(chain)}

    def keep(found: dict, key: str, result: dict) -> dict:
        found[key] = result
        return following.get(key, {})

    jobs = dict(chain[0] for chain in chains.values())
    return run_study(jobs, folder / STORE, results, workers=workers, description="series", keep=keep)


def library_file(series: Series, folder: Path) -> Path:
    """Where the experience of a series is kept: with the scope "general" all seeds share a library."""
    if series.learns and series.scope == "general":
        return folder / f"library-{'-'.join(part for part in (series.mode, series.labels) if part)}.npz"
    return _journal(series, folder).with_suffix(".npz")


def _library_before(series: Series, planning: PlanningConfig, folder: Path) -> ExperienceLibrary:
    """What is known when a series begins or goes on; raises UserInputError if a file cannot be used."""
    if not series.learns:
        return ExperienceLibrary.empty()
    terrain, store = load_terrain(series.terrain, seed=series.seed), library_file(series, folder)
    library = first_library(load_robot(series.robot), config_of(series, planning), terrain.fingerprint)
    return load_library(store, library) if store.exists() else library


def _journal(series: Series, folder: Path) -> Path:
    return folder / "series" / f"{series.key.replace('/', '-')}.json"


def run_series(series: Series, trials: int, planning: PlanningConfig, folder: Path) -> dict:
    """Repeats trials until the first success, or ``trials`` of them; returns {"rows": [...], "seed": ...}.

    What earlier calls did in ``folder`` is taken up where it ended.

    Raises:
        UserInputError: the robot cannot stand at the start, or what lies in the folder is something else.
    """
    robot, terrain = load_robot(series.robot), load_terrain(series.terrain, seed=series.seed)
    course, config = OfflineCourse(robot, terrain), config_of(series, planning)
    journal, store = _journal(series, folder), library_file(series, folder)
    journal.parent.mkdir(parents=True, exist_ok=True)
    rows, library = _rows_of(journal), _library_before(series, planning, folder)
    if _is_complete({"rows": rows}, trials):
        return _result(series, rows)
    labels = None
    if series.labels:
        labels = label_image(course, course.start_state(), load_model() if series.labels == "network" else None)
    walker = Walker(course, config)
    while not _is_complete({"rows": rows}, trials):
        if not series.learns and _would_be_the_same(rows):
            rows += [{**rows[-1], "repeated": True}] * (trials - len(rows))
        else:
            row, tries = walker.trial(library, labels, _in_vain(rows))
            library = learned(library, tries, config.experience) if series.learns else library
            row.records = len(library)
            rows.append(row.as_dict())
        with undisturbed():
            if series.learns:
                save_library(store, library)
            write_json(journal, {"key": series.key, "rows": rows})
    return _result(series, rows)


def config_of(series: Series, planning: PlanningConfig) -> PlanningConfig:
    """The configuration of planning for the mode of a series."""
    weighs = series.mode in ("steppability", "both")
    footholds = replace(planning.footholds, steppability="penalty" if weighs else "off")
    return replace(planning, footholds=footholds, experience=replace(planning.experience, scope=series.scope))


def failures_before_success(rows: list[dict]) -> int | None:
    """How many trials failed before the first success; None if none succeeded."""
    return next((k for k, row in enumerate(rows) if row["result"] == "goal"), None)


def _is_complete(result: dict | None, trials: int) -> bool:
    """Whether there is nothing left to try."""
    if result is None:
        return False
    rows = result["rows"]
    return len(rows) >= trials or failures_before_success(rows) is not None


def _in_vain(rows: list[dict]) -> int:
    """How many trials in a row found no plan at last: a search is never repeated unchanged."""
    count = 0
    for row in reversed(rows):
        if row["result"] != NO_PLAN:
            break
        count += 1
    return count


def _would_be_the_same(rows: list[dict]) -> bool:
    """Whether another trial is known to be as the last: two were the same, and nothing is learned."""
    if len(rows) < 2 or rows[-1]["result"] == NO_PLAN:
        return False
    timed = ("search_ms", "optimization_ms")
    return all(rows[-1][key] == rows[-2][key] for key in rows[-1] if key not in timed)


def _rows_of(journal: Path) -> list[dict]:
    """What an interrupted series has written."""
    if not journal.exists():
        return []
    content = read_json(journal)
    wanted = set(TrialRow().as_dict())
    rows = content.get("rows") if isinstance(content, dict) else None
    if not isinstance(rows, list) or not all(isinstance(row, dict) and set(row) == wanted for row in rows):
        raise UserInputError(f"{journal} is no file of trials; remove it or choose another --out")
    return rows


def _result(series: Series, rows: list[dict]) -> dict:
    return {"mode": series.mode, "labels": series.labels, "seed": series.seed, "rows": rows}


def table_rows(series: list[Series], results: dict) -> list[tuple[str, ...]]:
    """For a table, one line for each mode: successes, failed trials before them, costs and times."""
    lines = []
    for title in dict.fromkeys(one.title for one in series):
        found = [results[one.key]["rows"] for one in series if one.title == title and one.key in results]
        if not found:
            continue
        failures = [failures_before_success(rows) for rows in found]
        won = [count for count in failures if count is not None]
        first = [rows[0]["result"] == "goal" for rows in found]
        every = [row for rows in found for row in rows if not row["repeated"]]
        searches = np.array([ms for row in every for ms in row["search_ms"]] or [np.nan])
        costs = [rows[-1]["path_cost"] for rows, count in zip(found, failures, strict=True) if count is not None]
        lines.append(
            (
                title,
                f"{len(won)} of {len(found)}",
                f"{sum(first)} of {len(found)}",
                ", ".join("-" if count is None else str(count) for count in failures),
                f"{np.mean(costs):.2f}" if costs else "-",
                f"{np.median(searches):.0f}, {searches.max():.0f}",
                f"{1e-3 * np.mean([row['optimization_ms'] for row in every]):.2f}",
            )
        )
    return lines


COLUMNS = (
    "mode",
    "goals",
    "in the first trial",
    "failed trials before",
    "path cost [m]",
    "search: median, most [ms]",
    "optimisation of a trial [s]",
)
"""Of ``table_rows``."""
