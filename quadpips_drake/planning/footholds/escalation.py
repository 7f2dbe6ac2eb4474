"""How the foothold search treads more carefully, and tries harder after failures: never the same search twice."""

from dataclasses import dataclass, replace

from quadpips_drake.planning.footholds.foothold_config import MAX_EXPANSIONS, MAX_STEPS, FootholdConfig

_WIDER = {"max_swing": 1.2, "max_rise": 1.2, "length_tolerance": 1.3, "max_support_distance": 1.5, "inward_pull": 0.0}
"""Factors on limits that keep a margin: what the legs themselves allow is never exceeded."""


@dataclass(frozen=True)
class SearchEffort:
    """What is different at one level of escalation."""

    careful: bool
    """Whether the legs swing as in ``careful_gait``."""
    free: bool
    """Whether they swing in any order, with wider limits."""
    expansions: int
    """Factor on their bound."""
    labels: float
    """Factor on what labels and experience cost: before ground that cannot be avoided a search only shuffles about."""


LEVELS = (
    SearchEffort(careful=False, free=False, expansions=1, labels=1.0),
    SearchEffort(careful=True, free=True, expansions=2, labels=0.1),
    SearchEffort(careful=False, free=True, expansions=4, labels=0.01),
    SearchEffort(careful=True, free=True, expansions=8, labels=0.001),
)
"""By level; further failures are like the last, but the torso search leads elsewhere each time."""


def effort_at(level: int) -> SearchEffort:
    """What is different at a ``level`` of escalation."""
    return LEVELS[min(max(level, 0), len(LEVELS) - 1)]


_CAREFUL_STEPS, _CAREFUL_RADIUS = 1.5, 0.6
"""Factors on a plan's swings and on how far ahead it looks: single swings lead half as far as pairs."""


def careful(config: FootholdConfig) -> FootholdConfig:
    """Returns the settings with ``careful_gait``."""
    if config.gait == config.careful_gait:
        return config
    steps = min(round(config.max_steps * _CAREFUL_STEPS), MAX_STEPS)
    radius = config.local_radius * _CAREFUL_RADIUS
    return replace(config, gait=config.careful_gait, max_steps=steps, local_radius=radius)


def freely(config: FootholdConfig) -> FootholdConfig:
    """Returns the settings for swings in any order, with wider limits."""
    return replace(config, any_order=True, **{name: factor * getattr(config, name) for name, factor in _WIDER.items()})


def escalated(config: FootholdConfig, level: int) -> FootholdConfig:
    """Returns the settings for a ``level`` of escalation; those of level 0 are ``config`` itself."""
    step, changes = effort_at(level), {}
    if step.careful:
        config = careful(config)
    if step.free:
        config = freely(config)
    if config.steppability == "penalty":
        changes["steppability_weight"] = step.labels * config.steppability_weight
    if step.expansions > 1:
        changes["max_expansions"] = min(config.max_expansions * step.expansions, MAX_EXPANSIONS)
    return replace(config, **changes) if changes else config
