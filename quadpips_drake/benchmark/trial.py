"""One trial: a robot, a terrain, a planner and a seed, simulated until the judge says that it is over."""

import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from pydrake.systems.analysis import Simulator

from quadpips_drake.benchmark.foothold_statistics import foothold_statistics
from quadpips_drake.benchmark.judge import JudgeConfig, TrialJudge, Verdict
from quadpips_drake.benchmark.result import TrialResult, installed_versions
from quadpips_drake.benchmark.trial_log import TrialLog
from quadpips_drake.config import save_config
from quadpips_drake.diagrams.quadpips import QuadpipsConfig, QuadpipsDiagram
from quadpips_drake.errors import UserInputError, unknown_name
from quadpips_drake.planning.replan_monitor import PHASES
from quadpips_drake.robots.robot_model import load_robot
from quadpips_drake.terrain.library import load_terrain
from quadpips_drake.timing import StageTimings

PLANNERS = ("quadpips",)
_START_STREAM = 1
"""Separates the random numbers of the start from those of the sensors, which come from the same seed."""
PROGRESS_PERIOD = 0.5
"""Between two entries of result.json's progress [s]."""


@dataclass
class TrialConfig:
    """Everything that decides a trial; saved as config.yaml."""

    robot: str = "anymal_c"
    terrain: str = "stepping_stones"
    """Name in the library, or path of a terrain file."""
    planner: str = "quadpips"
    seed: int = 0
    start: list[float] = field(default_factory=list)
    """x, y [m], yaw [rad]; empty: the terrain's own start."""
    goal: list[float] = field(default_factory=list)
    """x, y [m]; empty: the terrain's own goal."""
    start_position_noise: float = 0.05
    """The seed moves the terrain's own start by up to this much in x and y [m]; a start that was asked for stays."""
    start_yaw_noise: float = 0.05
    """... and turns it by up to this much [rad]."""
    duration: float = 60.0
    """Longest simulated time [s]."""
    log_rate: float = 100.0
    """Samples per simulated second in log.npz and for the judge [Hz]."""
    judge: JudgeConfig = field(default_factory=JudgeConfig)
    stages: QuadpipsConfig = field(default_factory=QuadpipsConfig)

    def __post_init__(self):
        if self.planner not in PLANNERS:
            raise unknown_name("planner", self.planner, PLANNERS)
        if self.start and len(self.start) != 3:
            raise UserInputError("start must be X,Y,YAW (m, m, rad)")
        if self.goal and len(self.goal) != 2:
            raise UserInputError("goal must be X,Y (m)")
        if not np.isfinite([*self.start, *self.goal]).all():
            raise UserInputError("start and goal must be finite numbers")
        for name in ("start_position_noise", "start_yaw_noise"):
            if not 0.0 <= getattr(self, name) <= 1.0:
                raise UserInputError(f"{name} must be between 0 and 1")
        if not (np.isfinite(self.duration) and self.duration > 0):
            raise UserInputError("duration must be a positive number of seconds")
        if self.seed < 0:
            raise UserInputError("seed must not be negative")
        if not 1 <= self.log_rate <= 1000:
            raise UserInputError("log_rate must be between 1 and 1000 Hz")


class Trial:
    """A trial that is under way: built in the constructor, carried on by ``run``, written down by ``save``."""

    def __init__(self, config: TrialConfig, *, meshcat=None):
        """Loads and builds everything; raises UserInputError when something that was asked for cannot be had."""
        self.config = config
        self.robot = load_robot(config.robot)
        self.terrain = load_terrain(config.terrain, seed=config.seed, start=config.start or None, goal=config.goal or None)
        footprint = self.robot.nominal_footholds_B[:, :2]
        problem = self.terrain.problem_with_start(footprint) or self.terrain.problem_with_goal()
        if problem:
            raise UserInputError(problem)
        self.timings = StageTimings()
        self.diagram = QuadpipsDiagram(
            self.robot, self.terrain, config.stages, seed=config.seed, timings=self.timings, meshcat=meshcat
        )
        self.simulator = Simulator(self.diagram)
        self.context = self.simulator.get_mutable_context()
        self.start = _start_of(config, self.terrain)
        self.diagram.set_initial_state(self.context, self.start)
        self.judge = TrialJudge(self.terrain, config.judge)
        self.log = TrialLog()
        self.progress: list = []
        self._swing_plans: dict = {}
        self.verdict: Verdict | None = None
        self.wall_time = 0.0
        self.traceback = ""

    def run(self, progress: Callable[[float], None] | None = None) -> Verdict:
        """Simulates until the verdict; whatever goes wrong inside becomes a verdict too.

        Args:
            progress: called with the simulated time [s] now and then.
        """
        started = time.perf_counter()
        step = 1.0 / self.config.log_rate
        try:
            self.simulator.Initialize()
            ticks = 0
            while self.verdict is None:
                self.verdict = self._sample()
                if self.verdict is None and ticks * step >= self.config.duration:
                    self.verdict = Verdict("timeout", f"the goal was not reached within {self.config.duration:g} s")
                if self.verdict is None:
                    ticks += 1
                    self.simulator.AdvanceTo(ticks * step)
                if progress is not None and ticks % 10 == 0:
                    progress(self.context.get_time())
        except KeyboardInterrupt:
            self.verdict = Verdict("error", "interrupted")
            raise
        except (RuntimeError, ValueError, FloatingPointError) as error:
            self.traceback = traceback.format_exc()
            self.verdict = Verdict("error", f"the simulation stopped: {(str(error) or repr(error)).splitlines()[0]}")
        finally:
            self.wall_time = time.perf_counter() - started
        return self.verdict

    def _sample(self) -> Verdict | None:
        """Logs the present moment and judges it."""
        observation = self.diagram.observe(self.context)
        state = observation.robot_state
        self._swing_plans[observation.swing_plan.reference.request_id] = observation.swing_plan
        self.log.append(state, observation.foot_positions, observation.reference, phase=PHASES.index(observation.phase))
        if not self.progress or state.stamp - self.progress[-1][0] >= PROGRESS_PERIOD - 1e-9:
            initial = np.linalg.norm(self.start[:2] - np.asarray(self.terrain.goal))
            fraction = 1.0 - self.judge.distance_to_goal(state) / max(initial, 1e-9)
            self.progress.append([round(state.stamp, 3), round(float(np.clip(fraction, 0.0, 1.0)), 4)])
        bottoms = observation.foot_positions - np.array([0.0, 0.0, self.robot.foot_radius])
        verdict = self.judge(state, bottoms, observation.body_touches)
        if verdict is None and observation.gave_up:
            verdict = Verdict("no_plan", observation.gave_up)
        return verdict

    def result(self) -> TrialResult:
        """Returns what is known so far."""
        verdict = self.verdict or Verdict("error", "the trial was not run")
        observation = self.diagram.observe(self.context)
        arrays = self.log.arrays()
        sim_time = self.context.get_time()
        return TrialResult(
            success=verdict.reason == "goal_reached",
            reason=verdict.reason,
            detail=verdict.detail,
            robot=self.robot.name,
            terrain=self.terrain.name,
            planner=self.config.planner,
            seed=self.config.seed,
            sim_time=round(sim_time, 4),
            wall_time=round(self.wall_time, 3),
            realtime_factor=round(sim_time / self.wall_time, 4) if self.wall_time > 0 else 0.0,
            distance_to_goal=round(self.judge.distance_to_goal(observation.robot_state), 4),
            progress=self.progress,
            timings_ms=self.timings.summary_ms(),
            replans=observation.replans,
            fallbacks={
                **observation.fallbacks,
                "swing_trajectory": sum(plan.fallbacks for plan in self._swing_plans.values()),
            },
            footholds=foothold_statistics(self.log.references, arrays["time"], arrays["foot_positions"], arrays["contacts"])
            if len(self.log)
            else {"planned": 0, "slipped": 0, "missed": 0},
            versions=installed_versions(),
        )


def _start_of(config: TrialConfig, terrain) -> np.ndarray:
    """Start pose x, y [m], yaw [rad]: as asked for, or the terrain's own, moved a little by the seed."""
    start = np.array(terrain.start, dtype=float)
    if not config.start:
        reach = np.array([config.start_position_noise, config.start_position_noise, config.start_yaw_noise])
        start += np.random.default_rng([config.seed, _START_STREAM]).uniform(-reach, reach)
    return start


def run_trial(
    config: TrialConfig, out: Path, *, recording: bool = True, meshcat=None, progress: Callable[[float], None] | None = None
) -> TrialResult:
    """Runs a trial and writes result.json, config.yaml, log.npz and (if wanted) recording.html into ``out``.

    What was computed is written even when the trial is interrupted or breaks off; then error.txt has the details. For a
    start or goal that makes no sense result.json says so before the UserInputError goes on to the caller.

    Args:
        config: what to run.
        out: directory for the files, made when missing.
        recording: whether to write recording.html.
        meshcat: a Meshcat to show the trial in while it runs; made when a recording is wanted.
        progress: called with the simulated time [s] now and then.
    """
    out = Path(out)
    out.mkdir(parents=True, exist_ok=True)
    for stale in ("result.json", "recording.html", "log.npz", "error.txt"):
        (out / stale).unlink(missing_ok=True)
    save_config(config, out / "config.yaml")
    if recording and meshcat is None:
        from quadpips_drake.visualization.recording import make_quiet_meshcat

        meshcat = make_quiet_meshcat()
    try:
        trial = Trial(config, meshcat=meshcat)
    except UserInputError as error:
        TrialResult(
            False,
            "error",
            config.robot,
            config.terrain,
            config.planner,
            config.seed,
            detail=str(error),
            versions=installed_versions(),
        ).save(out / "result.json")
        raise
    if recording:
        trial.diagram.start_recording()
    try:
        trial.run(progress)
    finally:
        result = trial.result()
        result.save(out / "result.json")
        trial.log.save(out / "log.npz")
        if trial.traceback:
            (out / "error.txt").write_text(trial.traceback, encoding="utf-8")
        if recording:
            trial.diagram.save_recording(out / "recording.html")
    return result
