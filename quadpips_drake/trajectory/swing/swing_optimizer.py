"""From a foothold plan to a whole-body reference: a chain of swing optimisations (QuadPiPS section VI-D)."""

from dataclasses import field, replace

import numpy as np

from quadpips_drake.compiling import work_clock
from quadpips_drake.configuration.schema import configuration, ranged
from quadpips_drake.framework.stage_config import StageConfig, stage_rate
from quadpips_drake.robots.robot_model import RobotModel
from quadpips_drake.trajectory.centroidal.centroidal_model import CentroidalModel
from quadpips_drake.trajectory.ocp.ocp_config import TrackingWeights, TrajectoryOcpConfig
from quadpips_drake.trajectory.ocp.optimal_control_problem import OptimalControlProblem
from quadpips_drake.trajectory.ocp.tracking_task import Guess, joined_tasks
from quadpips_drake.trajectory.swing.ground_profile import KnownGround
from quadpips_drake.trajectory.swing.swing_task import SwingSetup, make_swing_task
from quadpips_drake.trajectory.swing.swing_trajectory import SwingConfig
from quadpips_drake.trajectory.swing.target_configuration import TargetConfig, find_target, foot_centers
from quadpips_drake.trajectory.swing.thigh_clearance import room_below_thighs
from quadpips_drake.values.centroidal import CentroidalState
from quadpips_drake.values.contact_schedule import ContactSchedule
from quadpips_drake.values.legs import Leg
from quadpips_drake.values.plans import FootholdPlan, RefusedSwing, Stance
from quadpips_drake.values.reference import FootholdTarget, WholeBodyReference
from quadpips_drake.values.regions import GroundHeights, RegionSet
from quadpips_drake.values.swing_plan import SwingPlan, SwingReport

_GIVES_WAY = 0.005
"""How much nearer to the ground a thigh may come that is too near already [m]."""


def _swing_problem() -> TrajectoryOcpConfig:
    """A foot keeps to its way and lands on its foothold: with the release's weight (100) a swing that joints are almost too
    slow for landed up to 12 cm beside it, and took more iterations to do so."""
    return TrajectoryOcpConfig(swing_error_gain=20.0, weights=TrackingWeights(foot_position=[3000.0, 3000.0, 3000.0]))


@configuration
class SwingOptimizerConfig(StageConfig):
    """How swings are optimised."""

    rate: float = stage_rate(50.0)
    """How often it looks for a new foothold plan [Hz]."""

    ocp: TrajectoryOcpConfig = field(default_factory=lambda: _swing_problem())
    """Of the optimal control problem."""
    swing: SwingConfig = field(default_factory=SwingConfig)
    """Shape of the swings."""
    target: TargetConfig = field(default_factory=TargetConfig)
    """How target configurations are found."""
    time_step: float = ranged(0.01, 0.002, 0.1)
    """Distance of knots [s]."""
    max_iterations: int = ranged(25, 1, 200)
    """SQP iterations for one swing [-]."""
    tolerance: float = ranged(1e-4, 1e-15, 1.0)
    """Convergence tolerance of the SQP [-]."""
    max_landing_error: float = ranged(0.04, 0.0, 10.0)
    """No motion in which a foot lands farther from its foothold than this [m] is used."""
    max_depth: float = ranged(0.015, 0.0, 1.0)
    """No swing that goes deeper than this [m] through what is known of the ground is used."""
    thigh_clearance: float = ranged(0.01, -10.0, 1.0)
    """No motion in which ground comes nearer than this from below to a thigh or knee [m] is used."""
    max_violation: float = ranged(1e-2, 0.0, 1e3)
    """An unconverged solution with less constraint violation than this is still used [-]."""
    refinement_iterations: int = ranged(1, 0, 50)
    """SQP iterations over the whole plan at once, after its swings; 0 leaves the swings as they are [-]."""
    carry_momentum: bool = True
    """Whether the base keeps moving from swing to swing, at the mean velocity of the neighbouring stances; else it stops."""


class SwingOptimizer:
    """Optimises the swings of a foothold plan one after the other; each starts where the last one ended.

    A swing is refused when no leg configuration reaches its target, when no apex clears the ground on the way, when the SQP
    does not come to a feasible point, when a foot would miss its foothold, or when a knee would hit the ground. Then the
    swing before it is optimised anew to end at rest, where the plan ends; what was refused, and why, comes with it. Nothing
    that is not feasible is in the reference.
    """

    def __init__(self, robot: RobotModel, config: SwingOptimizerConfig | None = None):
        self.robot = robot
        self.config = config or SwingOptimizerConfig()
        self.model = CentroidalModel(robot, self.config.ocp.model)
        self._problems: dict[int, OptimalControlProblem] = {}
        self._warm_up()

    def _warm_up(self):
        """Loads the compiled code, so that the first plan takes hardly longer than any other."""
        robot = self.robot
        base = np.array([0.0, 0.0, robot.nominal_base_height])
        normals = np.tile([0.0, 0.0, 1.0], (len(Leg), 1))
        footholds = base + robot.nominal_footholds_B - robot.foot_radius * normals
        stance = Stance(footholds, normals, (None,) * len(Leg), base, np.zeros(3))
        brief = 2.0 * self.config.time_step
        plan = FootholdPlan(0.0, 0, (stance,) * 3, ((Leg.LF,), (Leg.RF,)), "", brief, brief)
        spot = GroundHeights(0.0, np.zeros(2), 0.01, np.zeros((1, 1), np.float32))
        self.optimize(self.model.nominal_state(), plan, ground=known_ground(plan, heights=spot))

    def optimize(self, x0, plan: FootholdPlan, stamp: float = 0.0, ground: KnownGround | None = None) -> SwingPlan:
        """Returns the reference from state ``x0`` (24,) along ``plan``. Default of ``ground``: what the plan knows."""
        if not plan.success:
            return SwingPlan.without_motion(stamp, plan.request_id, plan.reason or "empty foothold plan")
        x = np.array(x0, dtype=float)
        setups, unreached = self._setups(x, plan, ground or known_ground(plan))
        setups, tasks, pieces, splines, reports = self._chain(x, setups)
        failed = [report for report in reports if not report.used]
        refused, reason = None, failed[0].status if failed else unreached
        if reason:
            number = failed[0].number if failed else len(setups)
            refused, reason = _refusal(plan, number, reason)
        fields = {"reports": tuple(reports), "planned": len(plan.swing_legs), "reason": reason, "refused": refused}
        if not pieces:
            return SwingPlan.without_motion(stamp, plan.request_id, **fields)
        start = work_clock()
        refined = self._refine(tasks, pieces, setups)
        fields |= {"refined": refined is not None, "refinement_time": work_clock() - start}
        states = np.concatenate([*(piece[0][:-1] for piece in pieces), pieces[-1][0][-1:]])
        states, inputs = refined or (states, np.concatenate([piece[1] for piece in pieces]))
        return SwingPlan(_assemble(states, inputs, setups, splines, plan, stamp), **fields)

    def _setups(self, x, plan, ground):
        """Returns the SwingSetups up to the first target out of reach, and why that is; else the empty string."""
        feet = [foot_centers(stance, self.robot.foot_radius) for stance in plan.stances]
        targets, reason, guess = [], "", x[CentroidalState.JOINTS]
        for k in range(len(plan.swing_legs)):
            stance = plan.stances[k + 1]
            target = find_target(self.robot, stance.p_WB, stance.rpy_WB, feet[k + 1], self.config.target, guess)
            if not target.reached:
                reason = f"no configuration reaches with {_names(target.unreached)}"
                break
            targets.append(target)
            guess = target.joints
        duration = plan.swing_duration + plan.stance_duration
        positions = np.array([x[CentroidalState.POSITION], *(target.p_WB for target in targets)])
        velocities = self._boundary_velocities(x, positions, duration)
        liftoff = 0.5 * plan.stance_duration
        return [
            SwingSetup(
                legs=tuple(plan.swing_legs[k]),
                liftoff_time=liftoff,
                touchdown_time=liftoff + plan.swing_duration,
                duration=duration,
                num_knots=max(2, round(duration / self.config.time_step)),
                targets=feet[k + 1],
                normals=np.array([plan.stances[k].normals, plan.stances[k + 1].normals]),
                regions=plan.stances[k + 1].regions,
                ground=ground,
                end=target,
                start_velocity=velocities[k],
                end_velocity=velocities[k + 1],
            )
            for k, target in enumerate(targets)
        ], reason

    def _boundary_velocities(self, x, positions, duration):
        """Base velocities at the beginning, between swings and at the end, (n + 1, 3)."""
        velocities = np.zeros_like(positions)
        velocities[0] = x[CentroidalState.LINEAR]
        if self.config.carry_momentum and len(positions) > 2:
            velocities[1:-1] = (positions[2:] - positions[:-2]) / (2.0 * duration)
        return velocities

    def _chain(self, x, setups):
        """Optimises one swing after the other, up to the first that fails; the one before it then ends at rest.

        Returns the setups, TrackingTasks, (states, inputs) and SwingSplines of those that can be used, and the SwingReports
        of all.
        """
        solved, failed = [], []
        while len(solved) < len(setups):
            k = len(solved)
            *parts, report = self._swing(solved[-1][1][0][-1] if solved else x, setups[k], k)
            if report.used:
                solved.append((*parts, report))
                continue
            failed.append(report)
            if solved:
                solved.pop()
                setups[k - 1] = replace(setups[k - 1], end_velocity=np.zeros(3))
            setups = setups[:k]
        tasks, pieces, splines, reports = ([parts[i] for parts in solved] for i in range(4))
        return setups, tasks, pieces, splines, reports + failed

    def _swing(self, x, setup, number):
        """Returns the TrackingTask, (states, inputs), the SwingSplines and the SwingReport."""
        start = work_clock()
        task, splines = make_swing_task(self.model, x, setup, self.config.swing)
        depth = max(spline.depth for spline in splines.values())
        if depth > self.config.max_depth:
            report = SwingReport(setup.legs, f"a foot would go through {100 * depth:.1f} cm of ground", number=number)
            return task, None, splines, replace(report, elapsed=work_clock() - start)
        problem = self._problem(setup.num_knots)
        solution = problem.solve(x, task, None, self.config.max_iterations, self.config.tolerance)
        landing = self._landing_error(solution.X[-1], setup)
        report = SwingReport(
            setup.legs,
            self._verdict(solution, landing, setup.ground.heights),
            solution.iterations,
            solution.cost,
            solution.constraint_violation,
            landing,
            work_clock() - start,
            number,
        )
        return task, (solution.X, solution.U), splines, report

    def _verdict(self, solution, landing, heights):
        """The status of a SwingReport."""
        violation = solution.constraint_violation
        if not np.isfinite(violation) or violation > self.config.max_violation:
            return f"optimisation failed ({solution.status}, constraints violated by {violation:.2g})"
        if landing > self.config.max_landing_error:
            return f"a foot would land {100 * landing:.1f} cm from its foothold"
        if hit := self._knee_hit(solution.X, heights):
            return hit
        return "converged" if solution.success else "unconverged"

    def _knee_hit(self, states, heights):
        """Says which knee would hit the ground; one that is close to it already may stay: else no step led away."""
        room = room_below_thighs(self.robot, states, heights)
        at_first = room_below_thighs(self.robot, states[:1], heights)
        short = np.minimum(self.config.thigh_clearance, at_first - _GIVES_WAY) - room
        leg = int(np.argmax(short))
        if short[leg] <= 0.0:
            return ""
        return f"the {Leg(leg).name} knee would come within {100 * room[leg]:.1f} cm of the ground"

    def _refine(self, tasks, pieces, setups):
        """Returns states and inputs of the whole plan after some more iterations over all swings at once, or None.

        The swings were optimised one by one, each up to its own end; now each may prepare for the next (the refinement of
        QuadPiPS section VI-D). What that would spoil is left as it was.
        """
        if self.config.refinement_iterations == 0 or len(pieces) < 2:
            return None
        task = joined_tasks(tasks)
        guess = Guess(
            np.concatenate([*(piece[0][:-1] for piece in pieces), pieces[-1][0][-1:]]),
            np.concatenate([piece[1] for piece in pieces]),
            task.times,
        )
        problem = self._problem(task.num_knots)
        solution = problem.solve(guess.X[0], task, guess, self.config.refinement_iterations, self.config.tolerance)
        ends = np.cumsum([setup.num_knots for setup in setups])
        errors = [self._landing_error(solution.X[end], setup) for end, setup in zip(ends, setups, strict=True)]
        # The violation is a norm over all knots: as much for each swing as when it was solved alone.
        most = self.config.max_violation * np.sqrt(len(setups))
        usable = solution.constraint_violation <= most and solution.iterations > 0
        return (solution.X, solution.U) if usable and max(errors) <= self.config.max_landing_error else None

    def _problem(self, num_knots):
        if num_knots not in self._problems:
            known = next((problem.terminal_cost for problem in self._problems.values()), None)
            self._problems[num_knots] = OptimalControlProblem(self.model, self.config.ocp, num_knots, known)
        return self._problems[num_knots]

    def _landing_error(self, x, setup):
        feet = self.model.foot_positions(x)
        return float(max(np.linalg.norm(feet[leg] - setup.targets[leg]) for leg in setup.legs))


def _assemble(states, inputs, setups, splines, plan, stamp):
    """Puts the solutions on one clock."""
    times, events, footholds, stance, start = [np.zeros(1)], [], [], [np.ones(4, dtype=bool)], 0.0
    for setup, paths in zip(setups, splines, strict=True):
        times.append(start + setup.times[1:])
        lifted, landed = start + setup.liftoff_time, start + setup.touchdown_time
        events += [lifted, landed]
        stance += [~np.isin(np.arange(4), setup.legs), np.ones(4, dtype=bool)]
        for leg in setup.legs:
            position, normal, path = setup.targets[leg], setup.normals[1, leg], paths[leg]
            way = path.profile, path.apex_height
            footholds.append(FootholdTarget(leg, lifted, landed, position, normal, setup.regions[leg], *way))
        start += setup.duration
    return WholeBodyReference(
        stamp,
        plan.request_id,
        np.concatenate(times),
        states,
        np.vstack((inputs, inputs[-1:])),
        ContactSchedule(np.array(events), np.array(stance)),
        tuple(footholds),
        plan.start,
    )


def _refusal(plan, number, why):
    """The swing ``number`` of the plan, counted from 0, as what is refused; and why, in words."""
    legs, before, after = plan.swing_legs[number], plan.stances[number], plan.stances[number + 1]
    reason = f"swing {number + 1} ({_names(legs)}): {why}"
    return RefusedSwing(tuple(legs), before.footholds, after.footholds, reason), reason


def known_ground(plan: FootholdPlan, regions: RegionSet | None = None, heights: GroundHeights | None = None) -> KnownGround:
    """What is known of the ground along ``plan``: the regions under its feet and all others, each once; and heights."""
    under_feet = [region for stance in plan.stances for region in stance.regions if region is not None]
    found = {id(region): region for region in (*under_feet, *(regions.regions if regions is not None else ()))}
    return KnownGround(tuple(found.values()), heights)


def _names(legs) -> str:
    return "+".join(leg.name for leg in legs)
