"""In simulation, a robot stands at the start of each environment that is made for it."""

import numpy as np
import pytest

from quadpips_drake.terrain.suites import suite_terrains
from quadpips_drake.trials.loading import load_walk_config
from quadpips_drake.trials.walk_trial import WalkTrial

PLACES = [("anymal_c", name) for name in suite_terrains("paper", "anymal_c")]
PLACES += [("go2", name) for name in suite_terrains("go2_hardware", "go2")]


@pytest.mark.parametrize(("robot", "name"), PLACES)
def test_it_stands_where_the_seed_puts_it(robot, name):
    options = {"gait": "stance", "velocity": [0.0, 0.0, 0.0], "duration": 0.3}
    trial = WalkTrial(load_walk_config(robot, terrain=name, seed=3, **options))
    assert trial.run().reason == "upright"
    state = trial.diagram.GetOutputPort("robot_state").Eval(trial.diagram.GetMyContextFromRoot(trial.context))
    assert np.linalg.norm(state.p_WB[:2] - trial.start[:2]) < 0.03
    assert (np.abs(trial.start - trial.terrain.start) > 1e-6).all()
