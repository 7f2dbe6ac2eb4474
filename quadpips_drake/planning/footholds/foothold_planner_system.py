"""FootholdPlanner: the foothold search as a Drake system."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from quadpips_drake.framework.stage import Inputs, Stage
from quadpips_drake.planning.appeared_ground import with_margin
from quadpips_drake.planning.experience.edge_experience import EdgeExperience
from quadpips_drake.planning.experience.experience_config import ExperienceConfig
from quadpips_drake.planning.footholds.foothold_config import FootholdConfig
from quadpips_drake.planning.footholds.foothold_search import search_footholds
from quadpips_drake.planning.start_stance import flat_region, state_at_start
from quadpips_drake.robots.standing import standing_state
from quadpips_drake.timing import StageTimings
from quadpips_drake.values.images import LabelImage
from quadpips_drake.values.plans import FootholdPlan, PlanSketch, RefusedSwings, TorsoPath
from quadpips_drake.values.regions import GroundHeights, RegionSet
from quadpips_drake.values.robot_state import RobotState
from quadpips_drake.values.swing_plan import ExperienceLibrary


class FootholdPlanner(Stage):
    """Plans the footholds along a torso path, once for each new path (QuadPiPS section VI-C).

    A* over contact-mode families; see ``search_footholds``. It steps on the regions that the torso search used, which come
    with the path, so that both plan in the same world.

    .. pydrake_system::

        name: FootholdPlanner
        input_ports:
        - robot_state
        - torso_path
        - refused_swings (optional)
        - ground_heights (optional)
        - label_image (optional)
        - experience (optional)
        output_ports:
        - foothold_plan
        - plan

    - robot_state: RobotState, frame W; a plan begins there unless the path was asked for from another start.
    - torso_path: TorsoPath, frame W, with its regions; a new ``request_id`` asks for a plan, 0 for nothing. If it failed,
      the plan fails with the same reason.
    - refused_swings (optional): RefusedSwings, frame W; nothing like them is planned.
    - ground_heights (optional): GroundHeights, frame W, that feet have to clear.
    - label_image (optional): LabelImage of the first camera, by which footholds cost more; only there if
      ``config.steppability`` is "penalty". Without a pixel the labels of the regions take its place.
    - experience (optional): ExperienceLibrary, by which transitions cost more; only there if there is any experience.
    - foothold_plan: FootholdPlan, frame W, for the last path; it has no stances and a reason when nothing was found. Looks
      for a new path at ``config.rate`` (15 Hz).
    - plan: PlanSketch, frame W: the same to draw.
    """

    WORTH_A_THREAD = True

    def __init__(
        self,
        robot,
        config: FootholdConfig | None = None,
        *,
        clearance: Callable | None = None,
        room: Callable | None = None,
        experience: ExperienceConfig | None = None,
        timings: StageTimings | None = None,
    ):
        """
        Args:
            robot: whose footholds.
            config: of the search.
            clearance: (RegionSet, GroundHeights) -> the ``clears`` of ``search_footholds`` on that ground; None: the search
                does not ask whether feet clear it.
            room: GroundHeights -> the ``has_room`` of ``search_footholds`` on that ground; None: nor whether the torso does.
            experience: how it counts; None, or with the scope "off": there is none.
            timings: where computing times go.
        """
        config = config or FootholdConfig()
        super().__init__("foothold_planner", config, memory=FootholdPlan.empty(), label="foothold_search", timings=timings)
        self._robot, self._clearance, self._room = robot, clearance, room
        self.declare_input("robot_state", RobotState)
        self.declare_input("torso_path", TorsoPath)
        self.declare_input("refused_swings", RefusedSwings, default=RefusedSwings.empty())
        self.declare_input("ground_heights", GroundHeights, default=GroundHeights.empty())
        self._weighs_labels = config.steppability == "penalty"
        if self._weighs_labels:
            self.declare_input("label_image", LabelImage, default=LabelImage.empty())
        self._experience = experience if experience is not None and experience.enabled else None
        if self._experience is not None:
            self.declare_input("experience", ExperienceLibrary, default=ExperienceLibrary.empty())
        self.declare_output("foothold_plan", FootholdPlan)
        self.declare_output("plan", PlanSketch, FootholdPlan.sketch)
        self._warm_up()

    def _warm_up(self):
        """Loads the compiled code, so that the first search takes no longer than any other."""
        floor = RegionSet(0.0, (flat_region(0, np.zeros(3), 1.0, 0.6),))
        poses = np.array([[x, 0.0, self._robot.nominal_base_height, 0.0] for x in (0.0, 0.2)])
        search_footholds(standing_state(self._robot), floor, TorsoPath(0.0, 0, poses, floor), self._robot, self.config)

    def occasion(self, inputs: Inputs) -> int | None:
        """A new torso path."""
        return inputs.torso_path.request_id or None

    def update(self, inputs: Inputs, memory: FootholdPlan, time: float) -> FootholdPlan:
        """Plans along the path."""
        path = inputs.torso_path
        state, refused = state_at_start(inputs.robot_state, path.start), inputs.refused_swings
        test = {}
        if self._clearance is not None and path.success:
            test["clears"] = self._clearance(path.regions, with_margin(inputs.ground_heights, path.appeared))
        if self._room is not None:
            test["has_room"] = self._room(inputs.ground_heights)
        labels = inputs.label_image if self._weighs_labels else None
        known = EdgeExperience.of(inputs.experience, self._experience) if self._experience is not None else None
        plan = search_footholds(
            state, path.regions, path, self._robot, self.config, refused, labels=labels, experience=known, **test
        )
        return replace(plan, start=path.start)
