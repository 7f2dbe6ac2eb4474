"""PerceptiveReference: walking by velocity command with feet on the regions that are seen."""

from dataclasses import replace

import numpy as np

from quadpips_drake.baselines.perceptive_config import PerceptiveReferenceConfig
from quadpips_drake.baselines.perceptive_walk import PerceptiveMemory, PerceptiveWalk
from quadpips_drake.control.references.velocity_reference import STANCE
from quadpips_drake.framework.stage import FirstUpdate, Inputs, Stage
from quadpips_drake.gaits.gaits import load_gait
from quadpips_drake.timing import StageTimings
from quadpips_drake.values.plans import PlanSketch
from quadpips_drake.values.reference import WholeBodyReference
from quadpips_drake.values.regions import GroundHeights, RegionSet
from quadpips_drake.values.robot_state import RobotState
from quadpips_drake.values.status import SafetyStatus, StageStatus


class PerceptiveReference(Stage):
    """Makes a rolling whole-body reference from a velocity command and a gait, with footholds on planar regions.

    Raibert's footholds, projected onto the best region near them; a dead zone and a filter keep them from jumping, and
    shortly before touch-down they are frozen. With ``config.learned`` a network that imitates the foothold search moves them
    before they are projected. Height and inclination of the base are those of the regions under its nominal
    feet. It stands until the first regions are there.

    .. pydrake_system::

        name: PerceptiveReference
        input_ports:
        - robot_state
        - velocity_command
        - gait
        - region_set
        - ground_heights (optional)
        - safety_status (optional)
        output_ports:
        - reference
        - plan
        - reference_status

    - robot_state: RobotState, frame W.
    - velocity_command: vector (3,): forward, left [m/s], yaw rate [rad/s] in the heading frame of the robot.
    - gait: str, name of the gait to walk in; it may change at any time. "stance": slow down, step once on the spot, stand.
    - region_set: RegionSet, frame W.
    - ground_heights (optional): GroundHeights that swings clear, frame W; looked at only with ``config.clear_ground``.
    - safety_status (optional): SafetyStatus; while it is unstable the robot is to stand where it is; then the walk begins
      anew from there.
    - reference: WholeBodyReference in absolute time, frame W, from now over the configured horizon; without samples before
      the first update. Updated at ``config.rate`` (50 Hz).
    - plan: PlanSketch of the footholds, frame W; a new one for each swing.
    - reference_status: StageStatus; its fallbacks count the feet that were sent back for want of a region.
    """

    def __init__(self, robot, config: PerceptiveReferenceConfig | None = None, *, timings: StageTimings | None = None):
        super().__init__(
            "perceptive_reference",
            config or PerceptiveReferenceConfig(),
            memory=PerceptiveMemory.empty(),
            timings=timings,
            first=FirstUpdate.AT_INITIALIZATION,
        )
        self._walk = PerceptiveWalk(robot, self.config)
        self.declare_input("robot_state", RobotState)
        self.declare_vector_input("velocity_command", 3)
        self.declare_input("gait", str, example=STANCE)
        self.declare_input("region_set", RegionSet)
        self.declare_input("ground_heights", GroundHeights, default=None)
        self.declare_input("safety_status", SafetyStatus, default=SafetyStatus.empty())
        self.declare_output("reference", WholeBodyReference, lambda memory: memory.reference)
        self.declare_output("plan", PlanSketch, lambda memory: memory.sketch)
        self.declare_output("reference_status", StageStatus, _status)

    def update(self, inputs: Inputs, memory: PerceptiveMemory, time: float) -> PerceptiveMemory:
        """Goes on with the walk; a robot in trouble stands, and begins anew afterwards."""
        state = inputs.robot_state
        if not state.is_known:
            return memory
        # Regions may be computed when they are asked for: not oftener than there are new ones.
        is_due = time - memory.looked >= 1.0 / self.config.region_rate - 1e-9
        memory = replace(memory, looked=time) if is_due else memory
        regions = inputs.region_set if is_due else memory.ground.source
        command, gait = np.asarray(inputs.velocity_command), inputs.gait
        if inputs.safety_status.unstable:
            memory, command, gait = memory.restarted(), np.zeros(3), STANCE
        elif not regions.regions and not len(memory.reference.footholds):
            command, gait = np.zeros(3), STANCE
        heights = inputs.ground_heights if self.config.clear_ground else None
        return self._walk.update(memory, state, command, load_gait(gait), regions, heights)


def _status(memory: PerceptiveMemory) -> StageStatus:
    seen = bool(memory.ground.regions)
    why = "" if seen else "there is no ground to step on yet"
    return StageStatus(memory.walk.stamp, memory.reference.request_id, seen, why, memory.fallbacks)
