"""A trial in which one has a hand while it goes on: what one may do to it."""

from dataclasses import replace

import numpy as np
from pydrake.math import RigidTransform

from quadpips_drake.cockpit.choices import Choice
from quadpips_drake.cockpit.stock import Stock
from quadpips_drake.errors import UserInputError
from quadpips_drake.faults.push_system import Push
from quadpips_drake.math.rotations import yaw_matrix
from quadpips_drake.trials.observation import Observation, observe, read
from quadpips_drake.values.robot_state import RobotState
from quadpips_drake.visualization.meshcat_layers import ROOT, draw_course, set_color_mesh
from quadpips_drake.visualization.meshes.arrows import push_mesh
from quadpips_drake.visualization.meshes.plan_meshes import goal_mesh
from quadpips_drake.visualization.overlay.legend import LEGEND

LAYERS = tuple(entry.layer for entry in LEGEND)
"""What can be shown or not, in the order of the switches."""
_OF_WALKS = ("course/start", "command", "pushes")
_OF_RUNS = tuple(layer for layer in LAYERS if layer != "command")
MAX_FORCE = 2000.0
"""Of a push [N]."""
MAX_PUSH_TIME = 2.0
"""Longest push [s]."""
_PUSH_PATH = f"{ROOT}/pushes/by_hand"
_PUSH_SHOWN = 0.4
"""The arrow of a push is there for so long at least [s]."""


class LiveTrial:
    """Each method that changes something may be called between two steps; it raises UserInputError where it cannot be."""

    def __init__(self, choice: Choice, *, meshcat=None):
        """Builds everything; ``meshcat``: where to draw, whatever it shows is deleted."""
        self.choice, self._meshcat, self.stock = choice, meshcat, Stock()
        self.layers = dict.fromkeys(_OF_WALKS if choice.is_walk else _OF_RUNS, True)
        """Those that there are, and whether they are shown."""
        self._push_ends: float | None = None
        if meshcat is not None:
            meshcat.Delete()
        self.trial = choice.trial(meshcat=meshcat, spare=self.stock.elements)
        if meshcat is not None:
            draw_course(meshcat, self.trial.terrain, has_goal=self.trial.HAS_GOAL)

    @property
    def state(self) -> RobotState:
        """Of the robot, without error."""
        return read(self.trial.diagram, "true_robot_state", self.trial.context)

    @property
    def goal(self) -> np.ndarray | None:
        """x, y [m]; None: the robot walks by velocity command."""
        return None if self.choice.is_walk else np.asarray(self.trial.terrain.goal)

    def observe(self) -> Observation:
        """What there is to see at this moment."""
        return observe(self.trial.diagram, self.trial.context)

    def pushing(self) -> np.ndarray:
        """The force on the base at this moment, in W [N], (3,)."""
        return self.trial.force_on_base(self.trial.context.get_time())

    def port(self, name: str):
        """The value at a port of the whole diagram; None where there is none."""
        diagram = self.trial.diagram
        return read(diagram, name, self.trial.context) if diagram.HasOutputPort(name) else None

    def move_goal(self, x: float, y: float) -> str:
        """Puts the goal there [m]; returns what has happened, in words, as the others do."""
        if self.choice.is_walk:
            raise UserInputError("a walk by velocity has no goal; choose a planner")
        self.trial.move_goal((x, y))
        if self._meshcat is not None:
            set_color_mesh(self._meshcat, f"{ROOT}/course/goal", goal_mesh(self.trial.terrain))
        return f"goal at {x:.2f}, {y:.2f}"

    def push(self, forward: float, left: float, up: float, duration: float) -> str:
        """Pushes the base with this force [N], in the robot's heading frame, from now on for ``duration`` [s]."""
        force = yaw_matrix(self.state.rpy_WB[2]) @ np.array([forward, left, up])
        size = float(np.linalg.norm(force))
        if not 0.0 < size <= MAX_FORCE or not 0.0 < duration <= MAX_PUSH_TIME:
            raise UserInputError(f"a push must have up to {MAX_FORCE:g} N and last up to {MAX_PUSH_TIME:g} s")
        push = Push([float(f) for f in force], self.trial.context.get_time(), duration)
        self.trial.push(push)
        self._draw_push(push)
        return f"pushed with {size:.0f} N for {duration:g} s ({size * duration:.0f} N s)"

    def spawn(self, kind: str, x: float, y: float) -> str:
        """Puts something into the world, at x, y [m]."""
        spawn, number = self.stock.offer(kind, x, y, self.trial.context.get_time())
        self.trial.spawn(spawn, number)
        self.stock.take(kind)
        return f"a {kind} at {x:.2f}, {y:.2f}"

    def command(self, gait: str, velocity: tuple[float, float, float]) -> str:
        """Lets the robot walk like this from now on: forward, left [m/s], turn [rad/s]."""
        if not self.choice.is_walk:
            raise UserInputError("with a planner there is no velocity to command")
        before = self.port("gait")
        self.trial.command(gait, velocity)
        return f"gait {gait}" if gait != before else ""

    def show_layer(self, layer: str, shown: bool) -> str:
        """Shows or hides one of LAYERS in Meshcat; does nothing where this trial has no such layer."""
        if layer not in self.layers:
            return ""
        self.layers[layer] = shown
        if self._meshcat is not None:
            self._meshcat.SetProperty(f"{ROOT}/{layer}", "visible", shown)
        return ""

    def draw_push(self) -> None:
        """Lets the arrow of a push go with the robot, and vanish _PUSH_SHOWN after it."""
        if self._meshcat is None or self._push_ends is None:
            return
        if self.trial.context.get_time() >= self._push_ends:
            self._meshcat.SetProperty(_PUSH_PATH, "visible", False)
            self._push_ends = None
        else:
            self._meshcat.SetTransform(_PUSH_PATH, RigidTransform(self.state.p_WB))

    def _draw_push(self, push: Push) -> None:
        if self._meshcat is not None:
            set_color_mesh(self._meshcat, _PUSH_PATH, push_mesh(push.force))
            self._meshcat.SetProperty(_PUSH_PATH, "visible", True)
            self._push_ends = push.time + max(push.duration, _PUSH_SHOWN)
            self.draw_push()

    def take_notes(self) -> list[tuple[float, str, str]]:
        """What systems have said in words since the last call: (time [s], who, what)."""
        notes, self.trial.log.notes = self.trial.log.notes, []
        return notes

    def noticed(self) -> dict[str, tuple]:
        """Of each thing that has been put there: whether the robot's map shows it, and what has touched it."""
        told = self.trial.spawner.plain()
        return {item["what"]: (item["noticed"] is not None, tuple(item["touched_by"])) for item in told}

    def world(self):
        """The Terrain as it is now."""
        return replace(self.trial.present_terrain, goal=self.trial.terrain.goal)
