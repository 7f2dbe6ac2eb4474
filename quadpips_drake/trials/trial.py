"""One trial: a robot, a terrain, a planner and a seed, simulated until the judge says that it is over."""

from dataclasses import field, replace
from pathlib import Path

import numpy as np

from quadpips_drake.configuration.layers import ConfigLayer
from quadpips_drake.configuration.schema import configuration, ranged
from quadpips_drake.diagrams.planners import planners
from quadpips_drake.diagrams.quadpips import QuadpipsConfig, QuadpipsDiagram, stages_type
from quadpips_drake.errors import UserInputError
from quadpips_drake.faults.push_system import Push
from quadpips_drake.planning.experience.experience_file import save_library
from quadpips_drake.robots.robot_model import RobotModel
from quadpips_drake.terrain.placement import problem_with_goal
from quadpips_drake.terrain.terrain import Element, Terrain
from quadpips_drake.timing import StageTimings
from quadpips_drake.trials.judge import TrialJudge, Verdict
from quadpips_drake.trials.observation import observe, read
from quadpips_drake.trials.record import record_trial
from quadpips_drake.trials.result import TrialResult
from quadpips_drake.trials.simulated_trial import RECENT_TIMINGS, SimulatedTrial, SimulationConfig, problem_with_trial_start
from quadpips_drake.trials.spawning.spawner import Spawner, parse_spawns
from quadpips_drake.trials.steps.foothold_statistics import ends_in_force, foothold_statistics, swing_statistics
from quadpips_drake.trials.steps.touch_downs import touch_down_statistics
from quadpips_drake.trials.steps.walk_statistics import FootholdBook
from quadpips_drake.trials.trial_options import default_stages, planner_wishes
from quadpips_drake.trials.watching.notes import NoteTaker
from quadpips_drake.trials.watching.sight import Sight
from quadpips_drake.trials.watching.tracking_row import tracking_row
from quadpips_drake.trials.world import world_of


@configuration
class TrialConfig(SimulationConfig):
    """Everything that decides a trial; saved as config.yaml."""

    terrain: str = "stepping_stones"
    """Name in the library, or path of a terrain file."""
    planner: str = "quadpips"
    """Name of the planner."""
    threads: int = ranged(1, 1, 2)
    """2: late results are computed in the background, on another core. The numbers are those of 1, to the bit."""
    latency: str = "measured"
    """When results of the stages are there: a preset (zero, measured, paper), or a file with rates and latencies. It fills
    in these keys below ``stages``; what is set there itself counts more."""
    goal: list[float] = ranged([], -1000.0, 1000.0, lengths=(0, 2))
    """x, y [m]; empty: the terrain's own goal."""
    spawn: list[str] = field(default_factory=list)
    """What appears during the trial: KIND:SIZE@X,Y[,Z[,YAW]]@TIME, KIND:SIZE@foothold@TIME or FILE.yaml@TIME."""
    stages: QuadpipsConfig | None = None
    """All stages; default: for ``robot``, with the sections that planner, region source and state estimator need."""
    pushes: list[Push] = field(default_factory=list)
    """Forces on the base at set times."""

    @staticmethod
    def choices() -> dict[str, tuple]:
        """Where the names stand that decide which sections there are: arguments of ``stages_type``, and their keys."""
        return {
            "planner": ("planner",),
            "region_source": ("stages", "region_source"),
            "state_estimator": ("stages", "state_estimator"),
        }

    @staticmethod
    def wishes(planner: str | None) -> ConfigLayer:
        """What the planner (None: the default one) wants otherwise than the defaults in code, keys as below ``stages``."""
        return planner_wishes(planner or TrialConfig.planner)

    @staticmethod
    def stages_type(
        planner: str = "quadpips", region_source: str = "superpixels", state_estimator: str = "oracle"
    ) -> type[QuadpipsConfig]:
        """The type of ``stages`` for a choice of these."""
        return stages_type(planner, region_source, state_estimator)

    def __post_init__(self):
        super().__post_init__()
        planners.get(self.planner)
        parse_spawns(self.spawn, self.duration)
        if self.stages is None:
            wishes = self.wishes(self.planner)
            regions = wishes.data.get("region_source", QuadpipsConfig.region_source)
            stages = self.stages_type(self.planner, regions)
            self.stages = default_stages(stages, self.robot, self.latency, self.latency_scale, self.terrain, wishes)


class Trial(SimulatedTrial):
    """The robot walks to the goal by its own eyes."""

    SUCCESS = "goal_reached"

    def __init__(
        self,
        config: TrialConfig,
        *,
        robot: RobotModel | None = None,
        terrain: Terrain | None = None,
        meshcat=None,
        live: bool = False,
        spare: tuple[Element, ...] = (),
    ):
        """Loads and builds everything.

        Args:
            config: what to run.
            robot: the robot; default: what the configuration names.
            terrain: the world; default: what the configuration names.
            meshcat: where to draw.
            live: whether somebody has a hand in it while it goes on (``push``, ``spawn``, ``move_goal``).
            spare: elements that wait for ``spawn``; the station counts them before those of the configuration.

        Raises:
            UserInputError: something that was asked for cannot be had.
        """
        robot, terrain = world_of(config, robot, terrain)
        problem = problem_with_trial_start(config, robot, terrain) or problem_with_goal(terrain)
        if problem:
            raise UserInputError(problem)
        timings = StageTimings(RECENT_TIMINGS if live else None)
        spawns = parse_spawns(config.spawn, config.duration)
        diagram = QuadpipsDiagram(
            robot,
            terrain,
            config.stages,
            planner=config.planner,
            appearing=(*spare, *(element for spawn in spawns for element in spawn.elements)),
            pushes=config.pushes,
            live=live,
            seed=config.seed,
            timings=timings,
            meshcat=meshcat,
        )
        spawner = Spawner(spawns, diagram, terrain, first=len(spare))
        # Whoever has a hand in it moves the goal: being there is not the end.
        judge = TrialJudge(terrain, config.judge, has_goal=not live)
        super().__init__(config, terrain, diagram, timings, judge, spawner=spawner, live=live)
        self.log.keep_references = not live
        self._notes, self._sight = NoteTaker(self.log), Sight(diagram.regions)
        self._rolling = FootholdBook()
        self.use_threads(config.threads)

    def move_goal(self, goal) -> None:
        """Puts the goal to ``goal``, x, y in W [m].

        Raises:
            UserInputError: nobody can walk there.
        """
        moved = replace(self.present_terrain, goal=goal)
        problem = problem_with_goal(moved)
        if problem:
            raise UserInputError(problem)
        self.terrain = replace(self.terrain, goal=goal)
        self.diagram.move_goal(self.context, moved.goal)
        self.judge.move_goal(moved.goal)

    def sample(self) -> Verdict | None:
        """Logs the present moment and judges it."""
        observation, status = observe(self.diagram, self.context), read(self.diagram, "status", self.context)
        state = observation.robot_state
        self.log.append(
            state,
            observation.foot_positions,
            observation.reference,
            phase=status.phase.number,
            push=self.force_on_base(state.stamp),
            **tracking_row(observation),
            **self._sight.row(self.diagram, self.context),
        )
        self._notes.look(observation, status, self._foothold_plan())
        if observation.reference.rolling:
            self._rolling.note(observation.reference, state.stamp)
        self.spawner.watch(self.context, state.stamp)
        initial = np.linalg.norm(self.start[:2] - np.asarray(self.terrain.goal))
        self.note_progress(state.stamp, 1.0 - self.judge.distance_to_goal(state) / max(initial, 1e-9))
        bottoms = self.robot.soles_W(observation.foot_positions)
        verdict = self.judge(state, bottoms, observation.body_touches)
        if verdict is None and status.gave_up:
            verdict = Verdict("no_plan", status.reason)
        return verdict

    def further_files(self) -> dict:
        """The experience, where there is any."""
        library = self._of_planner("experience")
        return {} if library is None else {"experience.npz": lambda path: save_library(path, library)}

    def _foothold_plan(self):
        """The FootholdPlan of the last request; None where the planner has no such port."""
        return self._of_planner("foothold_plan")

    def _of_planner(self, port: str):
        """The value at an output port that only some planners have; None where this one has not."""
        planner = self.diagram.planning
        if not planner.HasOutputPort(port):
            return None
        return read(planner, port, planner.GetMyContextFromRoot(self.context))

    def time_is_up(self) -> Verdict:
        """The goal has not been reached."""
        return Verdict("timeout", f"the goal was not reached within {self.config.duration:g} s")

    def result(self, **more) -> TrialResult:
        """Returns what is known so far."""
        observation, status = observe(self.diagram, self.context), read(self.diagram, "status", self.context)
        if len(self.log):
            more |= self._step_statistics(observation.robot_state.stamp)
        report = self._of_planner("report")
        if report is not None:
            more["planning"] = report.facts
        return super().result(
            planner=self.config.planner,
            distance_to_goal=round(self.judge.distance_to_goal(observation.robot_state), 4),
            replans=status.replans,
            events={**status.events, **observation.instabilities},
            spawned=self.spawner.plain(),
            fallbacks={**status.fallbacks, **observation.fallbacks},
            **more,
        )

    def _step_statistics(self, now: float) -> dict:
        """What there is to say about footholds and swings; of a rolling reference, about the footholds alone."""
        if self._rolling:
            self.log.references = [self._rolling.reference(now)]
        arrays = self.log.arrays()
        samples = arrays["time"], arrays["foot_positions"], arrays["contacts"]
        landed = touch_down_statistics(arrays, self.present_terrain, self.robot.foot_radius)
        if self._rolling:
            return {"footholds": foothold_statistics(self.log.references, *samples) | landed}
        ends = ends_in_force(self.log.references, arrays)
        return {
            "footholds": foothold_statistics(self.log.references, *samples, until=ends) | landed,
            "clearance": swing_statistics(self.log.references, arrays, self.robot, self.terrain, self.spawner.appeared()),
        }


def run_trial(config: TrialConfig, out: Path, *, recording: bool = True, **options) -> TrialResult:
    """Runs a trial and writes its files into ``out``; for the ``options`` see ``record_trial`` and Trial."""
    return record_trial(Trial, config, out, recording=recording, **options)
