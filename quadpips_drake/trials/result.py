"""What one trial has to say: result.json (fields in docs/running.md)."""

import json
import math
import platform
from dataclasses import asdict, dataclass, field
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from quadpips_drake.files import write_text

REASONS = ("goal_reached", "upright", "fell", "left_terrain", "timeout", "no_plan", "interrupted", "error")
"""goal_reached is the success of a run, upright (at the end) that of a walk."""


@dataclass
class TrialResult:
    """Outcome of a trial; times in s, distances in m, ``timings_ms`` in ms of wall-clock time."""

    success: bool
    reason: str
    """One of REASONS."""
    robot: str
    terrain: str
    planner: str = ""
    """Empty for a walk by velocity command."""
    seed: int = 0
    detail: str = ""
    """One line that says more about the reason: which planner stage found nothing, which limit was broken."""
    sim_time: float = 0.0
    wall_time: float = 0.0
    realtime_factor: float = 0.0
    distance_to_goal: float = float("nan")
    progress: list = field(default_factory=list)
    """[t, fraction of the initial distance to the goal covered]."""
    timings_ms: dict = field(default_factory=dict)
    replans: int = 0
    fallbacks: dict = field(default_factory=dict)
    events: dict = field(default_factory=dict)
    """How often what called for another plan, or for a halt: {name: count}."""
    footholds: dict = field(default_factory=lambda: {"planned": 0, "slipped": 0, "missed": 0})
    clearance: dict = field(default_factory=dict)
    """Of the swings of a run: whether they were feasible and how they cleared the terrain, see ``swing_statistics``."""
    spawned: list = field(default_factory=list)
    """What appeared during a run: ``what``, ``at``, ``noticed`` [s], ``touched``, see ``spawning``."""
    walk: dict = field(default_factory=dict)
    """How well a walk followed its commands, see ``walk_statistics``; empty for a run."""
    versions: dict = field(default_factory=dict)
    cause: dict = field(default_factory=dict)
    """After a failure, the most likely one: ``cause``, ``time`` [s] since when, ``text`` (what was measured), ``system``,
    ``keys`` of the configuration; see ``reporting``. Empty where there is none."""
    planning: dict = field(default_factory=dict)
    """What a planner says about itself beside its status (PlannerReport); empty where it says nothing."""

    def __post_init__(self):
        if self.reason not in REASONS:
            raise ValueError(f"reason '{self.reason}' is not one of {REASONS}")

    def save(self, path: Path):
        """Writes the result as JSON."""
        write_text(path, json.dumps(self.plain(), indent=2, allow_nan=False) + "\n")

    def plain(self) -> dict:
        """All fields as plain data; what is not finite becomes None, so that every reader of JSON can read it."""
        return _finite(asdict(self))


def _finite(value):
    """``value`` with null in place of every number that JSON does not know."""
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def installed_versions() -> dict:
    """Versions of what a result depends on."""
    versions = {"python": platform.python_version()}
    for name in ("quadpips_drake", "drake", "numpy", "numba", "piqp", "proxsuite"):
        try:
            versions[name] = version(name)
        except PackageNotFoundError:
            versions[name] = "unknown"
    return versions
