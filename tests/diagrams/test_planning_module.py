"""The planning module as a whole: a swing that no motion is found for, and the search that goes on around it."""

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.analysis import Simulator

from quadpips_drake.diagrams.planning_module import PlanningModule
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.trajectory.swing.swing_optimizer import SwingOptimizer
from tests.planning import worlds


def test_the_search_goes_on_around_a_swing_that_is_refused(monkeypatch):
    robot, refused = load_robot("anymal_c"), []
    module = PlanningModule(robot)
    verdict = SwingOptimizer._verdict

    def refusing_the_first(self, solution, landing, heights):
        feet = self.model.foot_positions(solution.X[-1])
        if not refused:
            refused.append(feet)
        return "no" if np.abs(feet - refused[0]).max() < 0.03 else verdict(self, solution, landing, heights)

    monkeypatch.setattr(SwingOptimizer, "_verdict", refusing_the_first)
    simulator = Simulator(module)
    context = simulator.get_mutable_context()
    for name, value in {"robot_state": worlds.standing_state(robot), "region_set": worlds.flat_ground()}.items():
        module.GetInputPort(name).FixValue(context, AbstractValue.Make(value))
    module.GetInputPort("goal").FixValue(context, np.array([2.0, 0.0]))
    simulator.AdvanceTo(2.0)
    status = module.GetOutputPort("status").Eval(context)
    reference = module.GetOutputPort("reference").Eval(context)
    assert status.phase == "walking" and status.replans >= 1
    assert status.fallbacks["failed_plans"] == 0 and status.fallbacks["swing_trajectory"] == status.replans
    plan = module.GetOutputPort("foothold_plan").Eval(context)
    assert reference.request_id == plan.request_id > 1
    landed = plan.stances[1].footholds + np.array([0.0, 0.0, robot.foot_radius])
    assert np.abs(landed - refused[0]).max() > 0.03
