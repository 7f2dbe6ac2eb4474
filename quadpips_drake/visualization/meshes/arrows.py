"""Arrows for commanded velocities, turns and pushes."""

import numpy as np

from quadpips_drake.visualization.colors import COMMAND_COLOR, PUSH_COLOR
from quadpips_drake.visualization.shapes import ColorMesh

METRES_PER_SPEED = 1.0
"""Length of an arrow per speed [s]: 0.5 m/s are 0.5 m."""
_TURN_RADIUS = 0.28
"""Of the arc that stands for a yaw rate; 1 rad/s is an arc of 1 rad twice over [m]."""
_LEAST_SPEED, _LEAST_TURN = 0.02, 0.02
"""Below these [m/s], [rad/s] nothing is drawn."""
_PUSH_LENGTHS = 0.3, 1.2
"""Shortest and longest arrow of a push [m]."""
_METRES_PER_NEWTON = 0.002


def command_mesh(velocity: np.ndarray) -> ColorMesh:
    """An arrow for forward and left [m/s], an arc for the yaw rate [rad/s] of a ``velocity`` (3,), in the heading frame."""
    mesh = ColorMesh()
    along = np.array([velocity[0], velocity[1], 0.0])
    if np.linalg.norm(along) > _LEAST_SPEED:
        add_arrow(mesh, np.zeros(3), METRES_PER_SPEED * along, 0.018, COMMAND_COLOR)
    if abs(velocity[2]) > _LEAST_TURN:
        angle = np.clip(2 * velocity[2], -4.5, 4.5) * np.linspace(0, 1, 24)
        arc = _TURN_RADIUS * np.column_stack((np.cos(angle), np.sin(angle), 0 * angle))
        mesh.add_tube(arc[:-3], 0.012, COMMAND_COLOR)
        tip = arc[-1] - arc[-2]
        add_arrow(mesh, arc[-4], arc[-4] + 0.09 * tip / np.linalg.norm(tip), 0.012, COMMAND_COLOR)
    return mesh


def push_mesh(force: np.ndarray) -> ColorMesh:
    """An arrow along a ``force`` in W [N] that ends where it acts, the origin."""
    mesh, size = ColorMesh(), np.linalg.norm(force)
    if size > 0:
        length = np.clip(_METRES_PER_NEWTON * size, *_PUSH_LENGTHS)
        add_arrow(mesh, -length * np.asarray(force) / size, np.zeros(3), 0.03, PUSH_COLOR)
    return mesh


def add_arrow(mesh: ColorMesh, tail: np.ndarray, tip: np.ndarray, radius: float, color) -> None:
    """Adds an arrow with a shaft of ``radius`` [m]; its head is as long as five of them, or half the arrow."""
    tail, tip = np.asarray(tail, float), np.asarray(tip, float)
    along = tip - tail
    length = np.linalg.norm(along)
    neck = tip - along * min(5 * radius / length, 0.5)
    mesh.add_tube(np.array([tail, 0.5 * (tail + neck), neck]), radius, color, sides=10)
    _add_cone(mesh, neck, tip, 2.4 * radius, color)


def _add_cone(mesh: ColorMesh, base: np.ndarray, tip: np.ndarray, radius: float, color, sides: int = 12) -> None:
    axis = (tip - base) / np.linalg.norm(tip - base)
    u = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    u /= np.linalg.norm(u)
    angle = 2 * np.pi * np.arange(sides) / sides
    ring = base + radius * (np.outer(np.cos(angle), u) + np.outer(np.sin(angle), np.cross(axis, u)))
    i = np.arange(sides)
    k = (i + 1) % sides
    faces = np.concatenate((np.column_stack((i, k, 0 * i + sides)), np.column_stack((k, i, 0 * i + sides + 1))))
    mesh.add_triangles(np.concatenate((ring, [tip, base])), faces, color)
