"""A walk by velocity command: simulated until the robot falls or the time is up."""

from dataclasses import field
from pathlib import Path

import numpy as np

from quadpips_drake.configuration.layers import ConfigLayer
from quadpips_drake.configuration.schema import MAX_DURATION, configuration, ranged
from quadpips_drake.control.references.velocity_reference import VelocityWalk
from quadpips_drake.control.references.walk_command import WalkCommand, check_commands
from quadpips_drake.diagrams.walk import WalkConfig, WalkDiagram
from quadpips_drake.errors import UserInputError
from quadpips_drake.faults.push_system import Push
from quadpips_drake.gaits.gaits import gait_number, load_gait
from quadpips_drake.robots.robot_model import RobotModel
from quadpips_drake.terrain.terrain import Element, Terrain
from quadpips_drake.timing import StageTimings
from quadpips_drake.trials.judge import TrialJudge, Verdict
from quadpips_drake.trials.observation import observe, read
from quadpips_drake.trials.record import record_trial
from quadpips_drake.trials.result import TrialResult
from quadpips_drake.trials.simulated_trial import RECENT_TIMINGS, SimulatedTrial, SimulationConfig, problem_with_trial_start
from quadpips_drake.trials.spawning.spawner import Spawner
from quadpips_drake.trials.steps.foothold_statistics import foothold_statistics
from quadpips_drake.trials.steps.walk_statistics import FootholdBook, walk_statistics
from quadpips_drake.trials.trial_options import default_stages
from quadpips_drake.trials.watching.notes import NoteTaker
from quadpips_drake.trials.watching.tracking_row import tracking_row
from quadpips_drake.trials.world import world_of


@configuration
class WalkTrialConfig(SimulationConfig):
    """Everything that decides a walk; saved as config.yaml."""

    gait: str = "trot"
    """Name of the gait that it begins with."""
    velocity: list[float] = ranged([0.3, 0.0, 0.0], -100.0, 100.0)
    """Forward, left [m/s], yaw rate [rad/s] in the robot's heading frame."""
    settle_time: float = ranged(0.5, 0.0, MAX_DURATION)
    """How long the robot stands before the walk begins [s]."""
    duration: float = ranged(10.0, 0.001, MAX_DURATION)
    """Simulated time [s]."""
    changes: list[WalkCommand] = field(default_factory=list)
    """Other gaits and velocities later on."""
    pushes: list[Push] = field(default_factory=list)
    """Forces on the base at set times."""
    stages: WalkConfig | None = None
    """All stages; default: for ``robot``."""

    @staticmethod
    def choices() -> dict[str, tuple]:
        """A walk has the same sections always."""
        return {}

    @staticmethod
    def wishes(planner: str | None) -> ConfigLayer:
        """A walk has no planner."""
        return ConfigLayer("no planner", {})

    @staticmethod
    def stages_type() -> type[WalkConfig]:
        """The type of ``stages``."""
        return WalkConfig

    def __post_init__(self):
        super().__post_init__()
        if self.stages is None:
            self.stages = default_stages(WalkConfig, self.robot, self.latency, self.latency_scale)
        check_commands(self.commands)

    @property
    def commands(self) -> list[WalkCommand]:
        """All commands in order."""
        return [WalkCommand(self.settle_time, self.gait, list(self.velocity)), *self.changes]


class WalkTrial(SimulatedTrial):
    """The robot does as it is told, and must not fall."""

    SUCCESS = "upright"
    HAS_GOAL = False

    def __init__(
        self,
        config: WalkTrialConfig,
        *,
        robot: RobotModel | None = None,
        terrain: Terrain | None = None,
        meshcat=None,
        panel: bool = False,
        live: bool = False,
        spare: tuple[Element, ...] = (),
    ):
        """Loads and builds everything; raises UserInputError when something that was asked for cannot be had.

        Args:
            config: what to run.
            robot: the robot; default: what the configuration names.
            terrain: the world; default: what the configuration names.
            meshcat: where to draw.
            panel: whether commands come from sliders in Meshcat; then the simulation keeps to real time.
            live: whether somebody has a hand in it while it goes on (``push``, ``spawn``, ``command``).
            spare: elements that wait for ``spawn``.
        """
        robot, terrain = world_of(config, robot, terrain)
        problem = problem_with_trial_start(config, robot, terrain)
        if problem:
            raise UserInputError(problem)
        timings = StageTimings(RECENT_TIMINGS if live else None)
        diagram = WalkDiagram(
            robot,
            terrain,
            config.commands,
            config.stages,
            pushes=config.pushes,
            appearing=spare,
            live=live,
            seed=config.seed,
            timings=timings,
            meshcat=meshcat,
            panel=panel,
        )
        judge = TrialJudge(terrain, config.judge, has_goal=False)
        spawner = Spawner((), diagram, terrain)
        super().__init__(config, terrain, diagram, timings, judge, spawner=spawner, live=live)
        self._footholds, self._notes = FootholdBook(), NoteTaker(self.log)
        if panel:
            self.simulator.set_target_realtime_rate(1.0)

    def sample(self) -> Verdict | None:
        """Logs the present moment and judges it."""
        seen = observe(self.diagram, self.context)
        state = seen.robot_state
        if not self.live:
            self._footholds.note(seen.reference, state.stamp)
        self.spawner.watch(self.context, state.stamp)
        self.log.append(
            state,
            seen.foot_positions,
            seen.reference,
            velocity_command=read(self.diagram, "velocity_command", self.context),
            gait=gait_number(read(self.diagram, "gait", self.context)),
            push=self.force_on_base(state.stamp),
            **tracking_row(seen),
        )
        self._notes.look(seen)
        self.note_progress(state.stamp, state.stamp / self.config.duration)
        bottoms = self.robot.soles_W(seen.foot_positions)
        return self.judge(state, bottoms, seen.body_touches)

    def command(self, gait: str, velocity) -> None:
        """Lets the robot walk in ``gait`` with ``velocity``, forward, left [m/s], turn [rad/s], from now on; ``live``.

        Raises:
            UserInputError: the gait is unknown, or the velocity makes no sense.
        """
        self.diagram.command.add(self.context, WalkCommand(self.context.get_time(), gait, [float(v) for v in velocity]))

    def time_is_up(self) -> Verdict:
        """The robot has not fallen."""
        return Verdict("upright", "")

    def _feasible(self, velocity: np.ndarray, gait: str) -> np.ndarray:
        """What the legs can do of a velocity command, (3,)."""
        return VelocityWalk(self.robot, self.config.stages.velocity_reference).feasible(velocity, load_gait(gait))

    def result(self, **more) -> TrialResult:
        """Returns what is known so far."""
        seen = observe(self.diagram, self.context)
        if len(self.log):
            self.log.references = [self._footholds.reference(seen.robot_state.stamp)]
            arrays = self.log.arrays()
            feet, contacts = arrays["foot_positions"], arrays["contacts"]
            more["footholds"] = foothold_statistics(self.log.references, arrays["time"], feet, contacts)
            more["walk"] = walk_statistics(arrays, self._feasible)
        return super().result(fallbacks=seen.fallbacks, **more)


def run_walk(config: WalkTrialConfig, out: Path, *, recording: bool = True, **options) -> TrialResult:
    """Runs a walk and writes its files into ``out``; for the ``options`` see ``record_trial`` and WalkTrial."""
    return record_trial(WalkTrial, config, out, recording=recording, **options)
