"""One walk through a sequence of velocity commands; what is kept of it is what can be seen at each exchange of the feet."""

import numpy as np

from quadpips_drake.baselines.motion_models.command_sequence import HeldCommand
from quadpips_drake.baselines.motion_models.command_sequence_system import SequencedCommand
from quadpips_drake.baselines.motion_models.exchange import SAMPLE_RATE
from quadpips_drake.diagrams.walk import WalkDiagram
from quadpips_drake.timing import StageTimings
from quadpips_drake.trials.judge import TrialJudge, Verdict
from quadpips_drake.trials.observation import observe, read
from quadpips_drake.trials.simulated_trial import SimulatedTrial
from quadpips_drake.trials.walk_trial import WalkTrialConfig

SETTLE_TIME = 0.5
"""How long the robot stands first [s]."""
STEPS_BEFORE_A_FALL = 4
"""So many steps before a fall are left out: that is no walking any more."""
_JUDGED_EVERY = 4
"""Samples."""
_MOST_TIME = 1.5
"""A walk that takes longer than its steps should, by this factor, is ended."""


class DataWalk(SimulatedTrial):
    """A walk that writes down one row for each step: its inputs for the models, and where base and feet are."""

    SUCCESS = "upright"
    HAS_GOAL = False

    def __init__(self, config: WalkTrialConfig, robot, terrain, commands: list[HeldCommand]):
        """Args: gait, seed and stages; the robot; the ground; what it is told. ``config.duration`` is the longest time."""
        config.log_rate = SAMPLE_RATE
        timings = StageTimings()
        self._told = SequencedCommand(robot, config.gait, commands, start=SETTLE_TIME)
        diagram = WalkDiagram(robot, terrain, [], config.stages, seed=config.seed, timings=timings, command=self._told)
        super().__init__(config, terrain, diagram, timings, TrialJudge(terrain, config.judge, has_goal=False))
        self._rows: list[dict] = []
        self._samples = 0

    def sample(self) -> Verdict | None:
        """Takes down a step that has just begun; the walk is over after the last one."""
        memory = self._told.shown_memory(self._told.GetMyContextFromRoot(self.context))
        count = memory.watch.exchange.count
        if count > len(self._rows):
            self._rows.append(_row(memory))
            if count > self._told.sequence.steps:
                return Verdict(self.SUCCESS, "")
        self._samples += 1
        if self._samples % _JUDGED_EVERY:
            return None
        seen = observe(self.diagram, self.context)
        verdict = self.judge(seen.robot_state, self.robot.soles_W(seen.foot_positions), seen.body_touches)
        if verdict is None and read(self.diagram, "safety_status", self.context).unstable:
            return Verdict("fell", "the safety monitor dropped the reference")
        return verdict

    def time_is_up(self) -> Verdict:
        """Steps were missed."""
        return Verdict("timeout", f"{len(self._rows)} steps in {self.config.duration:g} s")

    def rows(self) -> dict[str, np.ndarray]:
        """One row for each step, see ``step_data``; without the last ones where the robot fell."""
        kept = self._rows if self.verdict and self.verdict.reason == self.SUCCESS else self._rows[:-STEPS_BEFORE_A_FALL]
        return {name: np.array([row[name] for row in kept]) for name in (kept[0] if kept else ())}


def longest_time(steps: int, step_duration: float) -> float:
    """How long a walk of ``steps`` may take [s]."""
    return SETTLE_TIME + 1.0 + _MOST_TIME * steps * step_duration


def _row(memory) -> dict:
    state = memory.watch.state
    return {
        "stamp": memory.watch.exchange.began,
        "swing": state.swing,
        "position": state.position,
        "yaw": state.yaw,
        "velocity": state.velocity,
        "feet": state.feet,
        "inputs": state.inputs(memory.command),
        "out_of_standing": memory.watch.out_of_standing,
    }
