"""What all trials have in common: a robot in a simulated world, watched by a judge until it is over."""

import gc
import traceback
from collections.abc import Callable
from dataclasses import field, replace

import numpy as np
from pydrake.systems.analysis import Simulator

from quadpips_drake.compiling import work_clock
from quadpips_drake.configuration.schema import MAX_DURATION, MAX_SEED, configuration, ranged
from quadpips_drake.errors import UserInputError
from quadpips_drake.faults.push_system import Push, force_at
from quadpips_drake.framework.background import Background
from quadpips_drake.framework.stage import compute_in_background
from quadpips_drake.interruption import check as check_interruption
from quadpips_drake.terrain.appearing.appearances import Appearance
from quadpips_drake.terrain.placement import problem_with_start
from quadpips_drake.timing import StageTimings
from quadpips_drake.trials.judge import JudgeConfig, TrialJudge, Verdict
from quadpips_drake.trials.observation import read
from quadpips_drake.trials.result import TrialResult, installed_versions
from quadpips_drake.trials.spawning.spawner import Spawner
from quadpips_drake.trials.trial_log import TrialLog

_START_STREAM = 1
"""Separates the random numbers of the start from those of the sensors, which come from the same seed."""
PROGRESS_PERIOD = 0.5
"""Between two entries of result.json's progress [s]."""

RECENT_TIMINGS = 500
"""Computations of each stage whose time a ``live`` trial remembers."""
MAX_SAMPLES = 300_000
"""Longest log: a sample takes some 2 kB of memory."""


@configuration
class SimulationConfig:
    """What every trial needs to know."""

    robot: str = "anymal_c"
    """Name of a robot."""
    terrain: str = "flat"
    """Name in the library, or path of a terrain file."""
    difficulty: float | None = ranged(None, 0.0, 1000.0)
    """How hard a terrain of the library is: its one number, in its unit, which 'quadpips terrain list' names; null: the
    terrain's own."""
    seed: int = ranged(0, 0, MAX_SEED)
    """Of all that is random."""
    start: list[float] = ranged([], -1000.0, 1000.0, lengths=(0, 3))
    """x, y [m], yaw [rad]; empty: the terrain's own start."""
    start_position_noise: float = ranged(0.05, 0.0, 1.0)
    """The seed moves the start, the terrain's own as well as one that was asked for, by up to this much in x and y [m]; with
    0 it stays where it is."""
    start_yaw_noise: float = ranged(0.05, 0.0, 1.0)
    """... and turns it by up to this much [rad]."""
    duration: float = ranged(120.0, 0.001, MAX_DURATION)
    """Longest simulated time [s]."""
    latency: str = "zero"
    """When results of the stages are there: a preset (zero, measured, paper), or a file with rates and latencies. It fills
    in these keys below ``stages``; what is set there itself counts more."""
    latency_scale: float = ranged(1.0, 0.0, 100.0)
    """Factor on the latencies of the preset [1]."""
    log_rate: float = ranged(100.0, 1.0, 1000.0)
    """Samples per simulated second in log.npz and for the judge [Hz]."""
    judge: JudgeConfig = field(default_factory=JudgeConfig)

    def __post_init__(self):
        if self.duration * self.log_rate > MAX_SAMPLES:
            raise UserInputError(
                f"duration x log_rate must be at most {MAX_SAMPLES} samples of the log, "
                f"not {self.duration:g} s x {self.log_rate:g} Hz; lower log_rate"
            )


BREAKDOWNS = (Exception, SystemExit)
"""What a trial survives that breaks off in it: also Drake's failed assertions, which arrive as SystemExit."""


def in_one_line(error: BaseException) -> str:
    """What an exception says, in one line."""
    return next(iter(str(error).splitlines()), "") or repr(error)


class SimulatedTrial:
    """A trial that is under way: carried on by ``run``, told by ``result``; kinds of trials fill in what differs."""

    SUCCESS = ""
    """The reason that means success."""
    HAS_GOAL = True
    """Whether it is about reaching the terrain's goal."""

    def __init__(
        self,
        config: SimulationConfig,
        terrain,
        diagram,
        timings: StageTimings,
        judge: TrialJudge,
        *,
        spawner: Spawner | None = None,
        live: bool = False,
    ):
        """
        Args:
            config: what to run.
            terrain: the world.
            diagram: of all (``set_initial_state``, ``observe``).
            timings: of its stages.
            judge: says when it is over.
            spawner: lets appear what is not there from the beginning; None: nothing.
            live: whether somebody has a hand in it, for as long as they like: only the last sample is kept, no result.
        """
        gc.collect()  # earlier trials: few objects for the collector, which would wait for more, but tens of megabytes each
        self.config, self.terrain, self.diagram, self.timings, self.judge = config, terrain, diagram, timings, judge
        self.robot = diagram.robot
        self._background: Background | None = None
        self.simulator = Simulator(diagram)
        self.context = self.simulator.get_mutable_context()
        self.start = _start_of(config, terrain)
        diagram.set_initial_state(self.context, self.start)
        self.spawner = spawner
        self.live = live
        self.pushes = list(getattr(config, "pushes", ()))
        """Forces on the base, those included that came up while it went on."""
        self.log = TrialLog(keep=1 if live else None)
        self.progress: list = []
        self.verdict: Verdict | None = None
        self.wall_time = 0.0
        self.traceback = ""
        self.refusal: UserInputError | None = None
        """What was wrong with the input, if that came to light only during the trial."""

    def use_threads(self, number: int) -> None:
        """With two, late results are computed in the background from now on, until ``run`` has ended."""
        self._background = Background() if number > 1 else None
        compute_in_background(self.diagram, self._background)

    def title(self) -> str:
        """What the trial is, for people."""
        return f"{self.robot.name} on {self.terrain.name}"

    def sample(self) -> Verdict | None:
        """Logs the present moment and judges it."""
        raise NotImplementedError

    def time_is_up(self) -> Verdict:
        """The verdict when nothing else has ended the trial."""
        raise NotImplementedError

    @property
    def present_terrain(self):
        """The Terrain as it is now, with all that has appeared."""
        return self.terrain if self.spawner is None else self.spawner.terrain

    def appeared(self) -> list[list]:
        """Number in the station, time [s] and X_WE (16 numbers) of each element that has appeared."""
        return [] if self.spawner is None else self.spawner.places()

    def force_on_base(self, time: float) -> np.ndarray:
        """Sum of the pushes at ``time`` [s], in W [N], (3,)."""
        return force_at(self.pushes, time)

    def further_files(self) -> dict[str, Callable]:
        """What only this kind of trial writes: by the name of the file, a function of its path."""
        return {}

    def prepare_world(self) -> None:
        """Called before each step: lets appear what is due; raises UserInputError for what makes no sense now."""
        self.diagram.station.bring_ground_near(self.context)
        if self.spawner is None or not self.spawner.is_waiting:
            return
        time, reference = self.context.get_time(), read(self.diagram, "reference", self.context)
        if self.spawner.advance(self.context, time, reference):
            self.judge.look_at(self.spawner.terrain)
            new = [elements for at, elements in self.spawner.appeared() if at == time]
            self.log.appeared += [(time, *element.bounds()) for elements in new for element in elements.elements]

    def push(self, push: Push) -> None:
        """Lets ``push`` act as well; in a ``live`` trial, which forgets those that are over."""
        self.diagram.pushes.add(self.context, push)
        now = self.context.get_time()
        self.pushes = [*(p for p in self.pushes if p.time + p.duration > now), push]

    def spawn(self, spawn: Appearance, first: int) -> None:
        """Lets ``spawn`` appear now, as the station's elements from number ``first`` on; in a ``live`` trial.

        Raises:
            UserInputError: it cannot be there; nothing has changed then.
        """
        self.spawner.add(spawn, first, self.context, self.context.get_time())
        self.judge.look_at(self.spawner.terrain)

    def run(
        self, progress: Callable[[float], None] | None = None, look: Callable[["SimulatedTrial"], None] | None = None
    ) -> Verdict:
        """Simulates until the verdict; whatever goes wrong inside becomes a verdict too.

        Args:
            progress: called with the simulated time [s] now and then.
            look: called with this trial at each sample.

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
                if look is not None:
                    look(self)
                if self.verdict is None and ticks * step >= self.config.duration:
                    self.verdict = self.time_is_up()
                if self.verdict is None:
                    ticks += 1
                    self.prepare_world()
                    self.simulator.AdvanceTo(ticks * step)
                    check_interruption()
                if progress is not None and ticks % 10 == 0:
                    progress(self.context.get_time())
        except KeyboardInterrupt as interrupt:
            self.verdict = Verdict("interrupted", f"by {interrupt}" if str(interrupt) else "by Ctrl-C")
            raise
        except UserInputError as error:
            self.refusal, self.verdict = error, Verdict("error", str(error))
        except BREAKDOWNS as error:
            self.traceback = traceback.format_exc()
            self.verdict = Verdict("error", f"the simulation stopped: {in_one_line(error)}")
        finally:
            self.wall_time = work_clock() - started
            if self._background is not None:
                self._background.close()
                compute_in_background(self.diagram, None)
        return self.verdict

    def go_on(self, duration: float) -> None:
        """Simulates on for ``duration`` [s] after the verdict, for those who watch; nothing is logged or judged any more."""
        step, start = 1.0 / self.config.log_rate, self.context.get_time()
        try:
            for tick in range(1, round(duration / step) + 1):
                self.prepare_world()
                self.simulator.AdvanceTo(start + tick * step)
        except (UserInputError, *BREAKDOWNS):
            return  # what lies on the ground may break off; the verdict stands

    def note_progress(self, stamp: float, fraction: float) -> None:
        """Enters ``fraction`` (0..1) into the result's progress, every PROGRESS_PERIOD; a ``live`` trial has none."""
        if self.live:
            return
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


def problem_with_trial_start(config: SimulationConfig, robot, terrain) -> str | None:
    """Says in one line why ``robot`` cannot stand at the terrain's start, or where the seed moves that; or returns None."""
    footprint = robot.nominal_footholds_B[:, :2]
    problem = problem_with_start(terrain, footprint)
    if problem:
        return problem
    start = _start_of(config, terrain)
    problem = problem_with_start(replace(terrain, start=start), footprint)
    if problem is None:
        return None
    x, y, yaw = start - terrain.start
    return (
        f"seed {config.seed} moves the start by {x:.3f}, {y:.3f} m and turns it by {yaw:.3f} rad: {problem}, or set "
        "start_position_noise and start_yaw_noise to 0"
    )


def _start_of(config: SimulationConfig, terrain) -> np.ndarray:
    """Start pose x, y [m], yaw [rad]: as asked for, or the terrain's own, moved a little by the seed."""
    reach = np.array([config.start_position_noise, config.start_position_noise, config.start_yaw_noise])
    moved = np.random.default_rng([config.seed, _START_STREAM]).uniform(-reach, reach)
    return np.array(terrain.start, dtype=float) + moved
