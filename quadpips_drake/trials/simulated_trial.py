"""What all trials have in common: a robot in a simulated world, watched by a judge until it is over."""

import traceback
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from pydrake.systems.analysis import Simulator

from quadpips_drake.compiling import work_clock
from quadpips_drake.errors import UserInputError
from quadpips_drake.interruption import check as check_interruption
from quadpips_drake.timing import StageTimings
from quadpips_drake.trials.judge import JudgeConfig, TrialJudge, Verdict
from quadpips_drake.trials.result import TrialResult, installed_versions
from quadpips_drake.trials.trial_log import TrialLog

_START_STREAM = 1
"""Separates the random numbers of the start from those of the sensors, which come from the same seed."""
PROGRESS_PERIOD = 0.5
"""Between two entries of result.json's progress [s]."""


@dataclass
class SimulationConfig:
    """What every trial needs to know."""

    robot: str = "anymal_c"
    terrain: str = "flat"
    """Name in the library, or path of a terrain file."""
    seed: int = 0
    start: list[float] = field(default_factory=list)
    """x, y [m], yaw [rad]; empty: the terrain's own start."""
    start_position_noise: float = 0.05
    """The seed moves the terrain's own start by up to this much in x and y [m]; a start that was asked for stays."""
    start_yaw_noise: float = 0.05
    """... and turns it by up to this much [rad]."""
    duration: float = 60.0
    """Longest simulated time [s]."""
    log_rate: float = 100.0
    """Samples per simulated second in log.npz and for the judge [Hz]."""
    judge: JudgeConfig = field(default_factory=JudgeConfig)

    def __post_init__(self):
        if self.start and len(self.start) != 3:
            raise UserInputError("start must be X,Y,YAW (m, m, rad)")
        if not np.isfinite(self.start).all():
            raise UserInputError("start must consist of finite numbers")
        for name in ("start_position_noise", "start_yaw_noise"):
            if not 0.0 <= getattr(self, name) <= 1.0:
                raise UserInputError(f"{name} must be between 0 and 1")
        if not (np.isfinite(self.duration) and self.duration > 0):
            raise UserInputError("duration must be a positive number of seconds")
        if self.seed < 0:
            raise UserInputError("seed must not be negative")
        if not 1 <= self.log_rate <= 1000:
            raise UserInputError("log_rate must be between 1 and 1000 Hz")


BREAKDOWNS = (Exception, SystemExit)
"""What a trial survives that breaks off in it: also Drake's failed assertions, which arrive as SystemExit."""


def in_one_line(error: BaseException) -> str:
    """What an exception says, in one line."""
    return next(iter(str(error).splitlines()), "") or repr(error)


class SimulatedTrial:
    """A trial that is under way: carried on by ``run``, told by ``result``; kinds of trials fill in what differs."""

    SUCCESS = ""
    """The reason that means success."""

    def __init__(self, config: SimulationConfig, terrain, diagram, timings: StageTimings, judge: TrialJudge):
        """Args: what to run; the world; the diagram of all (``set_initial_state``, ``observe``); its timings; the judge."""
        self.config, self.terrain, self.diagram, self.timings, self.judge = config, terrain, diagram, timings, judge
        self.robot = diagram.robot
        self.simulator = Simulator(diagram)
        self.context = self.simulator.get_mutable_context()
        self.start = _start_of(config, terrain)
        diagram.set_initial_state(self.context, self.start)
        self.log = TrialLog()
        self.progress: list = []
        self.verdict: Verdict | None = None
        self.wall_time = 0.0
        self.traceback = ""

    def title(self) -> str:
        """What the trial is, for people."""
        return f"{self.robot.name} on {self.terrain.name}"

    def sample(self) -> Verdict | None:
        """Logs the present moment and judges it."""
        raise NotImplementedError

    def time_is_up(self) -> Verdict:
        """The verdict when nothing else has ended the trial."""
        raise NotImplementedError

    def run(self, progress: Callable[[float], None] | None = None) -> Verdict:
        """Simulates until the verdict; whatever goes wrong inside becomes a verdict too.

        Args:
            progress: called with the simulated time [s] now and then.

        Raises:
            KeyboardInterrupt: the program was interrupted; the verdict says so.
        """
        started = work_clock()
        step = 1.0 / self.config.log_rate
        try:
            self.simulator.Initialize()
            ticks = 0
            while self.verdict is None:
                self.verdict = self.sample()
                if self.verdict is None and ticks * step >= self.config.duration:
                    self.verdict = self.time_is_up()
                if self.verdict is None:
                    ticks += 1
                    self.diagram.station.bring_ground_near(self.context)
                    self.simulator.AdvanceTo(ticks * step)
                    check_interruption()
                if progress is not None and ticks % 10 == 0:
                    progress(self.context.get_time())
        except KeyboardInterrupt as interrupt:
            self.verdict = Verdict("interrupted", f"by {interrupt}" if str(interrupt) else "by Ctrl-C")
            raise
        except BREAKDOWNS as error:
            self.traceback = traceback.format_exc()
            self.verdict = Verdict("error", f"the simulation stopped: {in_one_line(error)}")
        finally:
            self.wall_time = work_clock() - started
        return self.verdict

    def note_progress(self, stamp: float, fraction: float) -> None:
        """Enters ``fraction`` (0..1) into the result's progress, every PROGRESS_PERIOD."""
        if not self.progress or stamp - self.progress[-1][0] >= PROGRESS_PERIOD - 1e-9:
            self.progress.append([round(stamp, 3), round(float(np.clip(fraction, 0.0, 1.0)), 4)])

    def result(self, **more) -> TrialResult:
        """Returns what is known so far; ``more`` are the fields that only this kind of trial can fill in."""
        verdict = self.verdict or Verdict("error", "the trial was not run")
        sim_time = self.context.get_time()
        return TrialResult(
            success=verdict.reason == self.SUCCESS,
            reason=verdict.reason,
            detail=verdict.detail,
            robot=self.robot.name,
            terrain=self.terrain.name,
            seed=self.config.seed,
            sim_time=round(sim_time, 4),
            wall_time=round(self.wall_time, 3),
            realtime_factor=round(sim_time / self.wall_time, 4) if self.wall_time > 0 else 0.0,
            progress=self.progress,
            timings_ms=self.timings.summary_ms(),
            versions=installed_versions(),
            **more,
        )


def _start_of(config: SimulationConfig, terrain) -> np.ndarray:
    """Start pose x, y [m], yaw [rad]: as asked for, or the terrain's own, moved a little by the seed."""
    start = np.array(terrain.start, dtype=float)
    if not config.start:
        reach = np.array([config.start_position_noise, config.start_position_noise, config.start_yaw_noise])
        start += np.random.default_rng([config.seed, _START_STREAM]).uniform(-reach, reach)
    return start
