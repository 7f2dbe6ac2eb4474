"""Who plans: the registry of planners."""

from dataclasses import dataclass, field
from typing import Any

from quadpips_drake.diagrams.planning_module import PlanningConfig, PlanningModule
from quadpips_drake.framework.registry import Registry
from quadpips_drake.robots.robot_model import RobotModel
from quadpips_drake.timing import StageTimings


@dataclass(frozen=True)
class PlannerSetup:
    """What a factory of planners gets."""

    robot: RobotModel
    config: Any
    """Of the entry's configuration type; None if it has none."""
    seed: int = 0
    timings: StageTimings = field(default_factory=StageTimings)
    site: str = ""
    """Fingerprint of the terrain: whether what a planner remembers of places is about this one."""


planners = Registry("planner", "quadpips_drake.planners")
"""``factory(setup)`` returns a system with the outputs

- ``reference`` (WholeBodyReference, frame W): what tracking follows; without samples it stands;
- ``status`` (PlannerStatus): what the planner is about; in the phase ``no_plan`` it has given up, which ends a trial;
- ``plan`` (PlanSketch; may be missing): what recordings draw.

Its inputs are fed by name: ``robot_state`` (RobotState, the estimate), ``region_set`` (RegionSet), ``ground_heights``
(GroundHeights; not from every region source), ``label_image`` (LabelImage; likewise), ``safety_status``
(SafetyStatus: while it is unstable, tracking drops the reference), ``goal`` (vector x, y in W [m]) and any of the station's
outputs (``depth_image``, ``imu``, ...). A planner whose configuration has a true ``every_label`` gets regions of every
label, not only of ground to step on. Nothing behind a planner knows which one it is."""


def _quadpips(setup: PlannerSetup) -> PlanningModule:
    return PlanningModule(setup.robot, setup.config, timings=setup.timings, site=setup.site)


planners.add(
    "quadpips", _quadpips, PlanningConfig, section="planning", summary="torso search, foothold search, swing optimisation"
)
