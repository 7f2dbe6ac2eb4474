"""Where to look for what: the system and the keys of the configuration, for each planner, region source, and walks."""

from dataclasses import dataclass, fields

from quadpips_drake.diagrams.planners import planners
from quadpips_drake.errors import UserInputError
from quadpips_drake.trials.reporting.trial_record import TrialRecord


@dataclass(frozen=True)
class Place:
    """A system of the diagram, and keys of the configuration, the most likely one first."""

    system: str
    keys: tuple[str, ...] = ()


@dataclass(frozen=True)
class Suspects:
    """Who decides what, with one planner."""

    gait: Place
    """In which gait the robot walks."""
    way: Place
    """Where it walks, and that it does although something stands there."""
    gap: Place
    """How wide a gap feet step over."""
    step: Place
    """How much higher than before a foot may come down."""
    swing: Place
    """What swings clear on their way."""
    ground: Place
    """Where a foot may come down."""
    reach: Place
    """How far legs reach, and that they meet nothing on the way."""
    search: Place
    """How long it is tried to find a plan."""
    pace: Place
    """How fast it gets on."""
    appeared: Place
    """What is done about ground that has changed."""
    longest_swing: str = ""
    """Key of the longest one; empty: there is no such limit."""
    highest_rise: str = ""
    """Key of how much higher a foot may come down; empty: there is no such limit."""


def _suspects(base: str, **places) -> Suspects:
    """Suspects whose keys are below ``base``, but for those that begin with a slash."""

    def full(key: str) -> str:
        return key[1:] if key.startswith("/") else f"{base}.{key}"

    return Suspects(
        **{
            name: full(place) if isinstance(place, str) else Place(place[0], tuple(full(key) for key in place[1:]))
            for name, place in places.items()
        }
    )


_BY_SECTION = {
    "planning": _suspects(
        "stages.planning",
        gait=("foothold_planner", "footholds.gait"),
        way=("torso_planner", "/goal", "torso.max_edge_length"),
        gap=("torso_planner", "footholds.max_swing"),
        step=("foothold_planner", "footholds.max_rise", "footholds.careful_rise"),
        swing=("swing_trajectory_optimizer", "/stages.tracking.wbc.early_contact_phase"),
        ground=("foothold_planner", "footholds.inward_pull"),
        reach=("foothold_planner", "footholds.reach_semi_axes", "footholds.reach_offset"),
        search=("foothold_planner", "footholds.max_expansions", "footholds.max_swing"),
        pace=("replan_monitor", "/duration", "monitor.lead_time"),
        appeared=("replan_monitor", "monitor.ground.region_sets"),
        longest_swing="footholds.max_swing",
        highest_rise="footholds.max_rise",
    ),
    "heuristic": _suspects(
        "stages.heuristic",
        gait=("goal_command", "command.gait"),
        way=("goal_command", "/goal"),
        gap=("perceptive_reference", "reference.search_radius"),
        step=("perceptive_reference", "reference.search_radius", "reference.clear_ground"),
        swing=("perceptive_reference", "reference.clear_ground", "reference.max_apex_height"),
        ground=("perceptive_reference", "reference.search_radius"),
        reach=("perceptive_reference", "reference.max_extension", "reference.penalty_weight"),
        search=("perceptive_reference", "reference.search_radius"),
        pace=("goal_command", "/duration", "command.speed"),
        appeared=("goal_command", "command.speed"),
    ),
    "motion_models": _suspects(
        "stages.motion_models",
        gait=("velocity_planner", "gait"),
        way=("velocity_planner", "/goal", "planner.search.horizon"),
        gap=("velocity_planner", "planner.search.max_speed", "planner.search.clearance"),
        step=("velocity_planner", "planner.search.max_height_change", "costmap.max_height_range"),
        swing=("velocity_reference", "/stages.tracking.mpc.swing.apex_height"),
        ground=("velocity_planner", "planner.search.clearance", "costmap.max_height_range"),
        reach=("velocity_reference", "velocity_reference.max_stride_ratio", "planner.search.max_speed"),
        search=("velocity_planner", "planner.search.clearance", "planner.max_failures"),
        pace=("velocity_planner", "/duration", "planner.search.preferred_speed"),
        appeared=("velocity_planner", "planner.max_map_age"),
        highest_rise="planner.search.max_height_change",
    ),
}
WALK = _suspects(
    "stages",
    gait=("velocity_reference", "/velocity", "/gait"),
    way=("velocity_reference", "/velocity"),
    gap=("velocity_reference", "/terrain", "/velocity"),
    step=("velocity_reference", "/terrain", "tracking.mpc.swing.apex_height"),
    swing=("velocity_reference", "tracking.mpc.swing.apex_height"),
    ground=("velocity_reference", "/terrain", "velocity_reference.ground_filter_time"),
    reach=("velocity_reference", "/velocity", "velocity_reference.max_stride_ratio"),
    search=("velocity_reference", "velocity_reference"),
    pace=("velocity_reference", "/velocity"),
    appeared=("velocity_reference", "/terrain"),
)
"""A walk by velocity command sees no ground, and plans nothing."""
_REGIONS = {
    "superpixels": ("region_extractor", "perception.regions.margin", ("perception.steppability", "perception.regions")),
    "elevation": ("plane_decomposer", "elevation.planes.margin", ("elevation.planes", "elevation.map")),
    "oracle": ("oracle_regions", "oracle_regions.margin", ("oracle_regions",)),
}
"""By region source: its last system, the key of regions' margins, and sections that decide what is a region."""


def suspects_of(record: TrialRecord) -> Suspects:
    """Who decides what in a trial; of a planner that is not from here, what can be said without knowing it."""
    if record.is_walk:
        return WALK
    name = record.result.planner
    try:
        section = planners.get(name).section
    except UserInputError:  # of a package that is not there any more
        section = name
    if section in _BY_SECTION:
        return _BY_SECTION[section]
    own = (f"stages.{section}",) if record.setting(f"stages.{section}") is not None else ()
    return Suspects(*(Place(name, own) for field in fields(Suspects) if field.type is Place))


def margin_of(record: TrialRecord) -> Place:
    """Who keeps footholds off the edges of regions."""
    system, margin, _ = _regions(record)
    return Place(system, (f"stages.{margin}",) if margin else ())


def regions_of(record: TrialRecord) -> Place:
    """Who says what a region is, and whether it carries a foot."""
    system, _, sections = _regions(record)
    return Place(system, tuple(f"stages.{name}" for name in sections))


def _regions(record: TrialRecord) -> tuple[str, str, tuple[str, ...]]:
    source = record.setting("stages.region_source", "superpixels")
    return _REGIONS.get(source, (source, "", ()))
