"""A trial of nothing, for tests of what surrounds a simulation."""

import os
import signal
import time
from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource

from quadpips_drake.errors import UserInputError
from quadpips_drake.timing import StageTimings
from quadpips_drake.trials.judge import Verdict
from quadpips_drake.trials.simulated_trial import SimulatedTrial, SimulationConfig


@dataclass
class ToyConfig(SimulationConfig):
    """What goes wrong, and when."""

    planner: str = "toy"
    fails: str = ""
    """"input" or "assertion" when it is built; "assertion", "memory", "SIGINT", "SIGTERM" at 0.05 s when it runs."""


class ToyTrial(SimulatedTrial):
    """Time passes."""

    SUCCESS = "goal_reached"
    built = 0

    def __init__(self, config, *, meshcat=None):
        if config.fails == "input":
            raise UserInputError("the goal makes no sense")
        if config.fails == "building":
            raise SystemExit("Failure at plant.cc:1 in Plant(): condition 'mass > 0' failed.")
        type(self).built += 1
        builder = DiagramBuilder()
        builder.AddSystem(ConstantVectorSource([0.0]))
        diagram = builder.Build()
        diagram.robot = SimpleNamespace(name=config.robot)
        diagram.station = SimpleNamespace(bring_ground_near=lambda context: None)
        diagram.set_initial_state = lambda context, start: None
        diagram.station = SimpleNamespace(bring_ground_near=lambda context: None)
        terrain = SimpleNamespace(name=config.terrain, start=np.zeros(3))
        super().__init__(config, terrain, diagram, StageTimings(), judge=None)

    def sample(self):
        fails = self.config.fails
        if self.context.get_time() > 0.05:
            if fails == "assertion":
                raise SystemExit("Failure at simulator.cc:1 in Step(): condition 'ok' failed.")
            if fails == "memory":
                raise MemoryError
            if fails.startswith("SIG"):
                os.kill(os.getpid(), getattr(signal, fails))
        state = SimpleNamespace(
            stamp=self.context.get_time(),
            **dict.fromkeys(("p_WB", "rpy_WB", "v_WB", "w_WB"), np.zeros(3)),
            **dict.fromkeys(("joint_positions", "joint_velocities", "joint_torques"), np.zeros(12)),
            contact_forces=np.zeros((4, 3)),
            contacts=np.ones(4, bool),
        )
        self.log.append(state, np.zeros((4, 3)), None)

    def time_is_up(self):
        return Verdict("goal_reached", "it has come")

    def title(self):
        return "nothing"


def save_recording(recorder, path, story, *, robot):
    """Slow to write, so that a signal can come meanwhile."""
    with path.open("w") as file:
        for line in range(3):
            file.write(f"{line}\n")
            os.kill(os.getpid(), signal.SIGINT)
            time.sleep(0.01)
