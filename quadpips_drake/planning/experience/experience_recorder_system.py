"""ExperienceRecorder: learning from the swings that were tried, as a Drake system."""

from quadpips_drake.framework.stage import Inputs, Stage
from quadpips_drake.planning.experience.experience_config import ExperienceConfig
from quadpips_drake.planning.experience.learning import learned, tried_swings
from quadpips_drake.timing import StageTimings
from quadpips_drake.values.plans import FootholdPlan
from quadpips_drake.values.swing_plan import ExperienceLibrary, SwingPlan


class ExperienceRecorder(Stage):
    """Remembers what became of the swings of each plan: those that were tried, the failed one included.

    A running mean of the optimal cost of each transition; see ``planning/experience/learning.py`` (Asselmeier et al., arXiv
    2501.00112, section 2, which leaves the formulas open).

    .. pydrake_system::

        name: ExperienceRecorder
        input_ports:
        - foothold_plan
        - swing_plan
        output_ports:
        - experience

    - foothold_plan: FootholdPlan, frame W.
    - swing_plan: SwingPlan; it is learned from once, if it is of the request of the foothold plan.
    - experience: ExperienceLibrary, at the beginning the one that was given; looks for a new swing plan at ``config.rate``
      (50 Hz).
    """

    def __init__(
        self,
        config: ExperienceConfig | None = None,
        library: ExperienceLibrary | None = None,
        *,
        timings: StageTimings | None = None,
    ):
        """
        Args:
            config: what is remembered.
            library: to begin with.
            timings: where computing times go.
        """
        memory = ExperienceLibrary.empty() if library is None else library  # one without records is false
        super().__init__("experience_recorder", config or ExperienceConfig(), memory=memory, timings=timings)
        self.declare_input("foothold_plan", FootholdPlan)
        self.declare_input("swing_plan", SwingPlan)
        self.declare_output("experience", ExperienceLibrary)

    def occasion(self, inputs: Inputs) -> int | None:
        """A new swing plan."""
        return inputs.swing_plan.reference.request_id or None

    def update(self, inputs: Inputs, memory: ExperienceLibrary, time: float) -> ExperienceLibrary:
        """Adds what was tried."""
        plan, swings = inputs.foothold_plan, inputs.swing_plan
        if not self.config.learn or plan.request_id != swings.reference.request_id or not plan.success:
            return memory
        return learned(memory, tried_swings(plan, swings), self.config)
