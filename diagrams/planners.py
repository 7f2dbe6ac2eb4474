"""Who plans: the registry of planners."""

from dataclasses import dataclass, field
from typing import Any

from quadpips_drake.baselines.heuristic_module import HeuristicConfig, HeuristicModule
from quadpips_drake.baselines.motion_models.planner.motion_models_module import MotionModelsConfig, MotionModelsModule
from quadpips_drake.control.mpc.mpc_config import walking_mpc
from quadpips_drake.diagrams.planning_module import PlanningConfig, PlanningModule
from quadpips_drake.framework.registry import Registry
from quadpips_drake.robots.robot_model import RobotModel
from quadpips_drake.terrain.terrain import Terrain
from quadpips_drake.timing import StageTimings


@dataclass(frozen=True)
class PlannerSetup:
    """What a factory of planners gets."""

    robot: RobotModel
    config: Any
    """Of the entry's configuration type; None if it has none."""
    seed: int = 0
    timings: StageTimings = field(default_factory=StageTimings)
    tracking: Any = None
    """TrackingConfig of what follows the reference."""
    truth: Terrain | None = None
    """The true world, where regions are exact, too; for oracles. None: what there is to know comes from sensors."""
    site: str = ""
    """Fingerprint of the terrain: whether what a planner remembers of places is about this one."""


planners = Registry("planner", "quadpips_drake.planners")
"""``factory(setup)`` returns a system with the outputs

- ``reference`` (WholeBodyReference, frame W): what tracking follows; without samples it stands;
- ``status`` (PlannerStatus): what the planner is about; in the phase ``no_plan`` it has given up, which ends a trial;
- ``plan`` (PlanSketch; may be missing): what recordings draw;
- ``report`` (PlannerReport; may be missing): what result.json says about it under ``planning``.

If it has a method ``make_visualizer(meshcat)``, recordings and live views get the system that this returns, whose inputs are
fed by name: ``robot_state`` and the planner's outputs.

Its inputs are fed by name: ``robot_state`` (RobotState, the estimate), ``region_set`` (RegionSet), ``ground_heights``
(GroundHeights; not from every region source), ``label_image`` (LabelImage; likewise), ``safety_status``
(SafetyStatus: while it is unstable, tracking drops the reference), ``goal`` (vector x, y in W [m]) and any of the station's
outputs (``depth_image``, ``imu``, ...). A planner whose configuration has a true ``every_label`` gets regions of every
label, not only of ground to step on. What an entry wishes for is laid over the defaults of all other stages. Nothing
behind a planner knows which one it is."""


def _quadpips(setup: PlannerSetup) -> PlanningModule:
    return PlanningModule(setup.robot, setup.config, timings=setup.timings, site=setup.site)


planners.add(
    "quadpips", _quadpips, PlanningConfig, section="planning", summary="torso search, foothold search, swing optimisation"
)


def _heuristic(setup: PlannerSetup) -> HeuristicModule:
    return HeuristicModule(setup.robot, setup.config, timings=setup.timings)


def _rival_wishes(**reference) -> dict:
    """What the rivals want otherwise than QuadPiPS: the weights of walks by velocity, in which roll counts as much as pitch;
    and these keys of their reference."""
    weights = walking_mpc().ocp.weights
    turning = {"base_orientation": weights.base_orientation, "angular_velocity": weights.angular_velocity}
    wishes = {"tracking": {"mpc": {"ocp": {"weights": turning}}}}
    return wishes | ({"heuristic": {"reference": reference}} if reference else {})


planners.add(
    "s_mpc",
    _heuristic,
    HeuristicConfig,
    section="heuristic",
    summary="rival: twist towards the goal, footholds by heuristics on superpixel regions",
    wishes=_rival_wishes(),
)
planners.add(
    "em_mpc",
    _heuristic,
    HeuristicConfig,
    section="heuristic",
    summary="rival: the same on regions of an elevation map, swings clear its heights",
    wishes=_rival_wishes(clear_ground=True) | {"region_source": "elevation"},
)
planners.add(
    "lf_mpc",
    _heuristic,
    HeuristicConfig,
    section="heuristic",
    summary="s_mpc with its footholds moved by a network that imitates our own foothold search",
    wishes=_rival_wishes(learned=True),
)


def _motion_models(setup: PlannerSetup) -> MotionModelsModule:
    tracking, truth = setup.tracking, setup.truth
    return MotionModelsModule(setup.robot, setup.config, tracking=tracking, truth=truth, timings=setup.timings)


planners.add(
    "motion_models",
    _motion_models,
    MotionModelsConfig,
    summary="search over velocity commands with learned motion models of the walk that follows them (arXiv 2307.12292)",
    wishes=_rival_wishes(),
)
