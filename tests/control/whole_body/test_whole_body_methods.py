"""Ranking by weight and by priority: they agree where all can be had, and differ as they should where not."""

from dataclasses import replace

import numpy as np
import pytest

from quadpips_drake.control.whole_body import whole_body_methods as methods
from quadpips_drake.control.whole_body.contact_logic import foot_targets
from quadpips_drake.control.whole_body.robot_dynamics import RobotDynamics
from quadpips_drake.control.whole_body.task_space_inverse_dynamics import TaskSpaceInverseDynamics
from quadpips_drake.control.whole_body.whole_body_assembly import AssemblySettings, assembled_matrices
from quadpips_drake.control.whole_body.whole_body_config import WbcConfig
from quadpips_drake.control.whole_body.whole_body_qp import QpSolution, make_whole_body_qp
from quadpips_drake.control.whole_body.whole_body_tasks import Level, Limits, Task, base_acceleration, joint_stops
from quadpips_drake.errors import UserInputError
from quadpips_drake.math.constants import GRAVITY
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.values.whole_body_command import WholeBodyCommand
from tests.control.whole_body.trotting import TROT, mid_trot

ROBOTS = ("anymal_c", "go2")
ALL_DOWN = np.ones(4, dtype=bool)


def compute(robot, state, policy, **settings):
    control = TaskSpaceInverseDynamics(robot, WbcConfig(**settings))
    return control.compute(state, policy, replace(WholeBodyCommand.empty(), foot_modes=np.array([0, 1, 1, 0])))


def program(levels, lower, upper, n=2):
    limits = Limits(np.eye(n), np.asarray(lower, float), np.asarray(upper, float))
    return methods.WholeBodyProgram(np.zeros((0, n)), np.zeros(0), np.zeros(n, dtype=bool), limits, levels, np.ones(n))


def wish(matrix, target):
    return Task(np.atleast_2d(np.array(matrix, dtype=float)), np.atleast_1d(np.array(target, dtype=float)))


def test_lower_levels_use_only_what_higher_ones_leave():
    levels = (Level("first", 1.0, wish([1, 1], 2)), Level("second", 100.0, wish([[1, 0], [0, 1]], [5, 0])))
    solution = methods.HierarchicalMethod("proxqp_dense").solve(program(levels, [-9, -9], [9, 9]))
    assert solution.x == pytest.approx([3.5, -1.5])  # on the line x + y = 2, closest to (5, 0)
    traded = methods.WeightedMethod("proxqp_dense", 2, 0, 2).solve(program(levels, [-9, -9], [9, 9]), None)
    assert traded.x.sum() > 4.0  # the heavy second task outweighs the first


def test_limits_bind_and_what_cannot_be_had_is_split_by_priority():
    levels = (Level("first", 1.0, wish([1, 1], 2)), Level("second", 1.0, wish([1, 0], 5)))
    solution = methods.HierarchicalMethod("proxqp_dense").solve(program(levels, [-9, -1], [9, 1]))
    assert solution.x == pytest.approx([3.0, -1.0], abs=1e-4)
    solution = methods.HierarchicalMethod("proxqp_dense").solve(program(levels, [-9, -9], [0, 0.5]))
    assert solution.x == pytest.approx([0.0, 0.5], abs=1e-4)  # not even the first can be had: as near as it gets


def test_soft_limits_give_way_as_little_as_possible():
    levels = (Level("first", 1.0, wish([0, 1], 0)),)
    hard = Limits(np.eye(2), np.array([3.0, -9.0]), np.array([9.0, 9.0]))
    stops = Limits(np.array([[1.0, 0.0]]), np.array([-1.0]), np.array([1.0]))
    both = replace(program(levels, [0, 0], [0, 0]), limits=hard, stops=stops, stop_weight=50.0)
    for solution in (
        methods.HierarchicalMethod("proxqp_dense").solve(both),
        methods.WeightedMethod("proxqp_dense", 2, 0, 2, 1).solve(both, None),
    ):
        assert solution.success
        assert solution.x[0] == pytest.approx(3.0, abs=1e-3)


@pytest.mark.parametrize("name", ROBOTS)
def test_both_methods_agree_where_every_task_can_be_met(name):
    robot = load_robot(name)
    state, policy = mid_trot(robot, ALL_DOWN)
    # At rest, and 1 cm beside the planned place: that is no more than the feet can do.
    at_rest = {name: np.zeros_like(getattr(state, name)) for name in ("v_WB", "w_WB", "joint_velocities")}
    state = replace(state, p_WB=state.p_WB + np.array([0.0, 0.01, 0.0]), **at_rest)
    policy = replace(policy, base_twists=np.zeros((2, 6)))
    # Forces are compared with those of the policy last, so that they give way to the base in either method.
    weighted = compute(robot, state, policy, force_weight=1e-3)
    strict = compute(robot, state, policy, method="hierarchical")
    assert weighted.success and strict.success
    assert strict.torque == pytest.approx(weighted.torque, abs=1e-2 * robot.effort_limits.max())
    assert strict.forces == pytest.approx(weighted.forces, abs=1e-2 * GRAVITY * robot.mass)


@pytest.mark.parametrize("name", ROBOTS)
def test_the_compiled_assembly_says_the_same_as_the_tasks(name):
    robot = load_robot(name)
    state, policy = mid_trot(robot)
    control = TaskSpaceInverseDynamics(robot)
    dynamics = RobotDynamics(robot).evaluate(state)
    modes = np.array([0, 1, 1, 0])
    planned = foot_targets(state, policy, TROT, modes, dynamics.p_WF, dynamics.v_WF, WbcConfig())
    base, forces = np.arange(6.0), 10.0 * np.arange(12.0).reshape(4, 3)
    normals = np.tile([0.1, -0.2, 1.0] / np.linalg.norm([0.1, -0.2, 1.0]), (4, 1))
    settings = AssemblySettings.of(robot, WbcConfig())
    compiled = assembled_matrices(settings, dynamics, planned, base, forces, normals)
    tasks = control._method.matrices(control.program(state, normals, planned, dynamics, base, forces))
    for ours, expected in zip(compiled, tasks, strict=True):
        np.testing.assert_allclose(ours, expected, atol=1e-9 * np.abs(expected[np.isfinite(expected)]).max())


@pytest.mark.parametrize("name", ROBOTS)
@pytest.mark.parametrize("moment", ["in mid-swing", "early touch", "missing ground", "dropped swing", "after the plan"])
def test_the_compiled_tick_is_the_one_by_tasks(name, moment, monkeypatch):
    """To rounding: the program, and what becomes of its solution."""
    robot = load_robot(name)
    state, policy = mid_trot(robot)
    policy = replace(policy, normals=np.tile([0.1, -0.2, 1.0] / np.linalg.norm([0.1, -0.2, 1.0]), (4, 1)))
    if moment == "early touch":
        state = replace(state, stamp=0.25, contacts=np.array([True, True, False, True]))
    if moment in ("missing ground", "dropped swing"):
        state = replace(state, stamp=0.32)  # RF and LH should be down
    if moment == "dropped swing":
        policy = replace(policy, swings=((), (), (), ()))
    if moment == "after the plan":
        state = replace(state, stamp=0.5, contacts=ALL_DOWN)
    solve, programs = methods.WeightedMethod.solve_matrices, []

    def noting(self, matrices, scale, warm):
        programs.append([np.array(part) for part in matrices])
        if len(programs) == 2:  # both go on from the solution of one program: rounding in it is not what this is about
            matrices = programs[0]
        return solve(self, matrices, scale, warm)

    monkeypatch.setattr(methods.WeightedMethod, "solve_matrices", noting)
    compiled, by_tasks = TaskSpaceInverseDynamics(robot), TaskSpaceInverseDynamics(robot)
    by_tasks._tick = None
    last = replace(WholeBodyCommand.empty(), foot_modes=np.array([0, 1, 1, 0]))
    one, other = (control.compute(state, policy, last) for control in (compiled, by_tasks))
    for ours, expected in zip(*programs, strict=True):
        np.testing.assert_allclose(ours, expected, atol=1e-9 * np.abs(expected[np.isfinite(expected)]).max())
    assert one.success and other.success
    np.testing.assert_array_equal(one.foot_modes, other.foot_modes)
    np.testing.assert_array_equal(one.forces, other.forces)
    for name in ("torque", "joint_positions", "joint_velocities"):
        np.testing.assert_allclose(getattr(one, name), getattr(other, name), atol=1e-9)
        assert not getattr(one, name).flags.writeable


class StillBase(TaskSpaceInverseDynamics):
    """Has one task more than the class that it derives from: the base shall not accelerate, whatever else is wanted."""

    def program(self, state, normals, targets, dynamics, base, forces):
        found = super().program(state, normals, targets, dynamics, base, forces)
        still = Level("still", 1e6, base_acceleration(np.zeros(6)))
        return replace(found, levels=(*found.levels[:1], still, *found.levels[1:]))


@pytest.mark.parametrize("settings", [{}, {"joint_stops": True}, {"method": "hierarchical"}], ids=str)
def test_a_task_that_is_added_takes_effect(settings):
    robot = load_robot("go2")
    state, policy = mid_trot(robot, ALL_DOWN)
    policy = replace(policy, states=policy.states + 0.05 * np.eye(24)[8])  # the base is to rise by 5 cm
    for control, rises in ((TaskSpaceInverseDynamics, True), (StillBase, False)):
        command = control(robot, WbcConfig(**settings)).compute(state, policy, WholeBodyCommand.empty())
        assert command.success
        assert (accelerations(robot, state, command)[0][5] > 0.3) == rises


def test_the_shortcut_steps_aside_for_any_other_program():
    robot = load_robot("go2")

    class Heavier(TaskSpaceInverseDynamics):
        def program(self, *args):
            found = super().program(*args)
            return replace(found, levels=tuple(replace(level, weight=1.1 * level.weight) for level in found.levels))

    class Freer(TaskSpaceInverseDynamics):
        def program(self, *args):
            found = super().program(*args)
            return replace(found, limits=replace(found.limits, upper=2.0 * found.limits.upper))

    assert TaskSpaceInverseDynamics(robot)._tick is not None
    for other in (StillBase, Heavier, Freer):
        assert other(robot)._tick is None


def accelerations(robot, state, command):
    """Generalised accelerations that the command's torques and forces cause, (18,)."""
    terms = RobotDynamics(robot).evaluate(state)
    drive = np.concatenate((np.zeros(6), command.torque)) + terms.foot_jacobian.T @ command.forces.ravel() - terms.bias
    return np.linalg.solve(terms.mass_matrix, drive), terms


@pytest.mark.parametrize("name", ROBOTS)
def test_priority_shows_where_a_swing_and_the_base_ask_for_too_much(name):
    """On two feet the base cannot be turned about the line between them, except by swinging the legs."""
    robot = load_robot(name)
    state, policy = mid_trot(robot)
    policy = replace(policy, states=policy.states + 0.15 * np.eye(24)[9])  # the base is to roll by 0.15 rad

    def swing_error(command):
        acceleration, terms = accelerations(robot, state, command)
        got = (terms.foot_jacobian @ acceleration + terms.foot_bias).reshape(4, 3)[1:3]
        spline = [policy.swing(leg, state.stamp).evaluate(state.stamp) for leg in (1, 2)]
        c = WbcConfig()
        asked = [
            a + c.swing_kp * (p - terms.p_WF[leg]) + c.swing_kd * (v - terms.v_WF[leg])
            for leg, (p, v, a) in zip((1, 2), spline, strict=True)
        ]
        return np.abs(got - asked).max()

    strict = compute(robot, state, policy, method="hierarchical")
    base_first = compute(robot, state, policy, swing_weight=0.01)
    assert strict.success
    assert swing_error(strict) < 0.02
    assert swing_error(base_first) > 10.0 * swing_error(strict)
    weighted = compute(robot, state, policy)
    assert swing_error(strict) <= swing_error(weighted) + 0.01


def test_a_level_that_fails_leaves_what_the_levels_above_found(monkeypatch):
    robot = load_robot("go2")
    state, policy = mid_trot(robot)
    # Friction that cannot hold what the base asks for, so that programs have to be solved.
    policy = replace(policy, states=policy.states + 0.3 * np.eye(24)[6])
    control = TaskSpaceInverseDynamics(robot, WbcConfig(method="hierarchical"))
    last = replace(WholeBodyCommand.empty(), foot_modes=np.array([0, 1, 1, 0]))
    assert control.compute(state, policy, last).iterations > 0
    failed = QpSolution(False, "max_iter_reached", 100, np.zeros(30), np.zeros(0), np.zeros(32))
    original, calls = methods.HierarchicalMethod._constrained, []

    def fails(self, A, *args):
        calls.append(A.shape)
        first = A.shape[1] == 18  # variables that the dynamics and two feet in the air leave
        return original(self, A, *args) if first else failed

    monkeypatch.setattr(methods.HierarchicalMethod, "_constrained", fails)
    command = control.compute(state, policy, last)
    assert calls, "some level needed a program"
    assert "level" in command.status and "max_iter" in command.status
    assert (command.success, command.fallbacks, command.consecutive_failures) == (False, 1, 0)
    assert np.isfinite(command.torque).all() and np.abs(command.torque).max() > 1.0


def test_a_first_level_that_fails_is_a_failure(monkeypatch):
    robot = load_robot("go2")
    state, policy = mid_trot(robot)
    control = TaskSpaceInverseDynamics(robot, WbcConfig(method="hierarchical"))
    good = control.compute(state, policy, WholeBodyCommand.empty())
    nothing = methods.MethodSolution(False, False, "level 1 (contact): max_iter_reached", 100, np.zeros(30))
    monkeypatch.setattr(control._method, "solve", lambda *args: nothing)
    bad = control.compute(replace(state, stamp=0.152, joint_velocities=np.zeros(12)), policy, good)
    assert (bad.success, bad.fallbacks, bad.consecutive_failures) == (False, 1, 1)
    assert bad.torque == pytest.approx(good.torque)


@pytest.mark.parametrize("method", ["weighted", "hierarchical"])
def test_joint_stops_brake_a_joint_ahead_of_its_limit(method):
    robot = load_robot("go2")
    state, policy = mid_trot(robot)
    state = replace(state, p_WB=state.p_WB + np.array([0.0, 0.0, 0.02]), joint_velocities=np.zeros(12))
    knee = 5  # of the swinging right fore leg, whose foot is now too high
    wanted = accelerations(robot, state, compute(robot, state, policy, method=method))[0][6 + knee]
    assert abs(wanted) > 5.0
    near = state.joint_positions[knee] + np.sign(wanted) * 0.022
    limits = {"position_limits_lower": np.full(12, -9.0), "position_limits_upper": np.full(12, 9.0)}
    limits["position_limits_upper" if wanted > 0 else "position_limits_lower"][knee] = near
    robot = replace(robot, **limits)
    held = compute(robot, state, policy, method=method, joint_stops=True)
    assert held.success
    rate, margin = WbcConfig().joint_stop_rate, WbcConfig().joint_stop_margin
    stops = joint_stops(
        state.joint_positions,
        state.joint_velocities,
        robot.position_limits_lower + margin,
        robot.position_limits_upper - margin,
        rate,
    )
    got = accelerations(robot, state, held)[0][6:]
    slack = 0.1 * abs(wanted)
    assert stops.lower[knee] - slack < got[knee] < stops.upper[knee] + slack


def test_stops_act_like_a_critically_damped_spring():
    limits = joint_stops(np.zeros(12), np.full(12, 1.0), np.full(12, -0.5), np.full(12, 0.5), 10.0)
    assert limits.upper == pytest.approx(np.full(12, 100.0 * 0.5 - 20.0))
    assert limits.lower == pytest.approx(np.full(12, -100.0 * 0.5 - 20.0))


def test_unknown_methods_are_refused():
    with pytest.raises(UserInputError, match="weighted"):
        WbcConfig(method="democratic")


def test_the_direct_solver_repeats_itself_to_the_bit():
    rng = np.random.default_rng(0)
    root, C = rng.standard_normal((30, 30)), rng.standard_normal((44, 30))
    problem = (
        root @ root.T + 30.0 * np.eye(30),
        rng.standard_normal(30),
        rng.standard_normal((6, 30)),
        rng.standard_normal(6),
        C,
    )
    bounds, keep = (np.full(44, -3.0), np.full(44, 3.0)), []
    solvers = [make_whole_body_qp("piqp_direct", 30, 6, 44)]
    first = solvers[0].solve(*problem, *bounds)
    assert first.success
    other = solvers[0].solve(2.0 * problem[0], *problem[1:], *bounds)
    assert not np.array_equal(other.x, first.x)
    for size in range(20):
        keep.append(np.zeros(100 + 37 * size))  # moves what is allocated next
        solvers.append(make_whole_body_qp("piqp_direct", 30, 6, 44))
    for solver in solvers:
        assert np.array_equal(solver.solve(*problem, *bounds).x, first.x)
    proxqp = make_whole_body_qp("proxqp_dense", 30, 6, 44).solve(*problem, *bounds)
    np.testing.assert_allclose(first.x, proxqp.x, atol=1e-3)
