"""What is drawn into a film at a moment, from the log alone: footholds, ways of feet and base, commands, pushes, regions."""

import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw

from quadpips_drake.trials.telling.replay import Replay
from quadpips_drake.values.legs import Leg
from quadpips_drake.visualization.colors import BASE_REFERENCE_COLOR, LEG_COLORS
from quadpips_drake.visualization.film.scene_meshes import SceneMeshes
from quadpips_drake.visualization.meshes.arrows import command_mesh, push_mesh
from quadpips_drake.visualization.meshes.ground_meshes import checkered_mesh, edge_mesh
from quadpips_drake.visualization.meshes.plan_meshes import goal_mesh, region_mesh, start_mesh
from quadpips_drake.visualization.shapes import ColorMesh

RUN_LAYERS = ("regions", "footholds", "swings", "base_reference", "course/goal")
WALK_LAYERS = ("footholds", "command")
PUSH_LAYERS = ("pushes",)
"""Where there are any."""
REGION_PERIOD = 0.5
"""Between two drawings of regions [s]."""
_SOON, _AGO = 0.6, 0.1
"""A walk has no plans: its footholds are drawn so long before and after touch-down [s]."""
_BALL, _TUBE = 0.03, 0.009
"""Radii [m]."""
_ABOVE = 0.35
"""Where the command floats above the base [m]."""
_PUSH_SHOWN = 0.25
"""A push is shown for so long at least [s]."""


class FilmDrawings:
    """Keeps the meshes of a scene up to date; draws anew only what has changed."""

    def __init__(self, replay: Replay, meshes: SceneMeshes):
        self._replay, self._files, self._meshes = replay, replay.files, meshes
        self._keys: dict[str, object] = {}
        log = self._files.log
        self._published = log.get("foothold_published", log["foothold_touchdown"] - _SOON)
        self._plans = np.unique(log["foothold_plan"]) if len(log["foothold_plan"]) else np.zeros(0, int)
        self._begins = np.array([self._published[log["foothold_plan"] == plan].min() for plan in self._plans])

    def draw_ground(self, context) -> None:
        """What stays all the time."""
        terrain, has_goal = self._replay.terrain, not self._files.is_walk
        still = {"edges": edge_mesh(terrain), "start": start_mesh(terrain)}
        still |= {"goal": goal_mesh(terrain)} if has_goal else {"floor": checkered_mesh(terrain)}
        for name, mesh in still.items():
            self._meshes.show(context, name, mesh)

    def draw(self, context, time: float, region_set=None) -> None:
        """What there is at ``time`` [s], and the regions seen then."""
        if self._files.is_walk:
            self._draw_command(context, time)
            due = self._files.log["foothold_touchdown"]
            self._draw_footholds(context, np.flatnonzero((due > time - _AGO) & (due < time + _SOON)))
        else:
            self._draw_plan(context, time)
        if self._files.config.pushes:
            self._draw_pushes(context, time)
        if region_set is not None and region_set.regions and self._is_new("regions", int(time / REGION_PERIOD + 1e-6)):
            self._meshes.show(context, "regions", region_mesh(region_set, varied=False))

    def _is_new(self, name: str, key) -> bool:
        """Whether a drawing has to be made anew; then it is taken as made."""
        was, self._keys[name] = self._keys.get(name), key
        return was != key

    def _draw_plan(self, context, time: float) -> None:
        """Footholds of the plan in force, and the ways that feet and base went from its begin to the next one's."""
        number = int(np.searchsorted(self._begins, time + 1e-9)) - 1
        if number < 0 or not self._is_new("plan", number):
            return
        self._draw_footholds(context, np.flatnonzero(self._files.log["foothold_plan"] == self._plans[number]))
        end = self._begins[number + 1] if number + 1 < len(self._begins) else self._files.end
        span = slice(self._files.index(self._begins[number]), self._files.index(end) + 1)
        self._meshes.show(context, "swings", _swing_tubes(self._files.log, span))
        base, path = ColorMesh(), self._files.log["reference_p_WB"][span][::5]
        base.add_tube(path[np.isfinite(path).all(axis=1)], _TUBE, BASE_REFERENCE_COLOR)
        self._meshes.show(context, "base_reference", base)

    def _draw_footholds(self, context, which: np.ndarray) -> None:
        if self._is_new("footholds", which.tobytes()):
            mesh, log = ColorMesh(), self._files.log
            for k in which:
                mesh.add_ball(log["foothold_position"][k], _BALL, LEG_COLORS[Leg(int(log["foothold_leg"][k]))])
            self._meshes.show(context, "footholds", mesh)

    def _draw_command(self, context, time: float) -> None:
        log, k = self._files.log, self._files.index(time)
        heading = RigidTransform(RollPitchYaw(0, 0, log["rpy_WB"][k, 2]), log["p_WB"][k] + np.array([0, 0, _ABOVE]))
        self._meshes.show(context, "command", command_mesh(log["velocity_command"][k]), heading)

    def _draw_pushes(self, context, time: float) -> None:
        force = np.zeros(3)
        for push in self._files.config.pushes:
            if push.time <= time < push.time + max(push.duration, _PUSH_SHOWN):
                force = force + push.force
        at = RigidTransform(self._files.log["p_WB"][self._files.index(time)])
        self._meshes.show(context, "push", push_mesh(force), at)


def _swing_tubes(log: dict, span: slice) -> ColorMesh:
    """The way of each foot while it was in the air."""
    mesh = ColorMesh()
    for leg in Leg:
        in_air = ~np.asarray(log["contacts"][span][:, leg], bool)
        for first, last in zip(*(np.flatnonzero(np.diff(np.r_[0, in_air, 0]) == step) for step in (1, -1)), strict=True):
            if last - first > 10:  # shorter ones are no swings
                mesh.add_tube(log["foot_positions"][span][first:last:4, leg], _TUBE, LEG_COLORS[leg])
    return mesh
