"""The path of a swinging foot: two quintic pieces over an apex (OCS2's swing planner as used by QuadPiPS, section VI-D)."""

from dataclasses import dataclass

import numpy as np

from quadpips_drake.errors import UserInputError

_UP = np.array([0.0, 0.0, 1.0])
_MIN_HORIZONTAL = 0.01
"""Below this horizontal distance [m] the apex lies straight above."""
_APEX_PART = 0.6
"""Part of the chord that is behind the foot at half time: it lands more slowly than it leaves."""
_BLEND_START, _BLEND_END = 0.25, 0.75
"""Phases between which the normal turns from lift-off's to touch-down's."""
_RISE_LIMIT = 2.0
"""Obstacle clearance is at most so many times the apex height."""


@dataclass
class SwingConfig:
    """Shape of swings; defaults as in the authors' release."""

    apex_height: float = 0.08
    """Height of the apex over the line from lift-off to touch-down [m]."""
    liftoff_velocity: float = 0.2
    """Velocity along the normal when the foot leaves [m/s]."""
    touchdown_velocity: float = -0.4
    """Velocity along the normal when the foot lands [m/s]."""
    time_scale: float = 0.15
    """Swings shorter than this [s] have their apex and end velocities scaled down in proportion."""

    def __post_init__(self):
        if self.apex_height < 0 or self.time_scale <= 0:
            raise UserInputError("swing.apex_height must be >= 0 and swing.time_scale > 0")
        if self.liftoff_velocity < 0 or self.touchdown_velocity > 0:
            raise UserInputError("swing.liftoff_velocity must be >= 0 and swing.touchdown_velocity <= 0")


class SwingSpline:
    """Foot centre over one swing, from ``p0`` at ``t0`` to ``p1`` at ``t1``; at rest outside. Immutable; frame W.

    Position and velocity are continuous at the apex, the acceleration vanishes there and at both ends.
    """

    def __init__(
        self,
        p0,
        p1,
        t0: float,
        t1: float,
        apex_height: float = 0.08,
        n0=_UP,
        n1=_UP,
        *,
        liftoff_velocity: float = 0.2,
        touchdown_velocity: float = -0.4,
        time_scale: float = 0.15,
        obstacle_height: float = 0.0,
    ):
        """
        Args:
            p0, p1: foot centre at lift-off and touch-down [m], (3,).
            t0, t1: their times [s], t0 < t1.
            apex_height: over the chord [m].
            n0, n1: upward unit normals of the ground there, (3,).
            liftoff_velocity, touchdown_velocity: along these normals [m/s].
            time_scale: shorter swings [s] are flattened in proportion.
            obstacle_height: how far the ground in between rises above the chord [m]; added to the apex.
        """
        if not t1 > t0:
            raise ValueError(f"a swing must end after it began, not from {t0} to {t1}")
        self.start_time, self.end_time = float(t0), float(t1)
        p0, p1 = np.array(p0, dtype=float), np.array(p1, dtype=float)
        self._normals = np.array(n0, dtype=float), np.array(n1, dtype=float)
        duration = self.end_time - self.start_time
        shrink = min(1.0, duration / time_scale)
        height = shrink * apex_height + np.clip(obstacle_height, 0.0, _RISE_LIMIT * apex_height)
        middle, middle_velocity = _apex(p0, p1, duration, height)
        ends = (p0, shrink * liftoff_velocity * self._normals[0]), (p1, shrink * touchdown_velocity * self._normals[1])
        half = 0.5 * duration
        self._half = half
        pieces = (*ends[0], middle, middle_velocity, half), (middle, middle_velocity, *ends[1], half)
        self._coefficients = tuple(_quintic(*piece) for piece in pieces)
        self._ends = p0, p1

    @staticmethod
    def plan(t0, t1, p0, p1, normal=_UP, config: SwingConfig | None = None, *, obstacle_height=0.0, liftoff_normal=_UP):
        """Returns the swing that ``config`` shapes; ``normal`` is that of the ground at touch-down."""
        config = config or SwingConfig()
        return SwingSpline(
            p0,
            p1,
            t0,
            t1,
            config.apex_height,
            liftoff_normal,
            normal,
            liftoff_velocity=config.liftoff_velocity,
            touchdown_velocity=config.touchdown_velocity,
            time_scale=config.time_scale,
            obstacle_height=obstacle_height,
        )

    def evaluate(self, t: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Returns position [m], velocity [m/s] and acceleration [m/s^2] at the time ``t`` [s], (3,) each."""
        if t <= self.start_time or t >= self.end_time:
            rest = np.zeros(3)
            return self._ends[int(t >= self.end_time)].copy(), rest, rest.copy()
        s = t - self.start_time
        piece = int(s >= self._half)
        s -= piece * self._half
        powers = np.array([1.0, s, s**2, s**3, s**4, s**5])
        first = np.array([0.0, 1.0, 2 * s, 3 * s**2, 4 * s**3, 5 * s**4])
        second = np.array([0.0, 0.0, 2.0, 6 * s, 12 * s**2, 20 * s**3])
        coefficients = self._coefficients[piece]
        return powers @ coefficients, first @ coefficients, second @ coefficients

    def position(self, t) -> np.ndarray:
        """Position [m] at one time (3,) or several (n, 3)."""
        return self._sample(t, 0)

    def velocity(self, t) -> np.ndarray:
        """Velocity [m/s] at one time (3,) or several (n, 3)."""
        return self._sample(t, 1)

    def acceleration(self, t) -> np.ndarray:
        """Acceleration [m/s^2] at one time (3,) or several (n, 3)."""
        return self._sample(t, 2)

    def normal(self, t: float) -> np.ndarray:
        """Unit normal (3,) along which the foot is held to the spline: turns smoothly from lift-off's to touch-down's."""
        phase = (t - self.start_time) / (self.end_time - self.start_time)
        s = np.clip((phase - _BLEND_START) / (_BLEND_END - _BLEND_START), 0.0, 1.0)
        part = s * s * (3.0 - 2.0 * s)
        blend = (1.0 - part) * self._normals[0] + part * self._normals[1]
        return blend / np.linalg.norm(blend)

    def _sample(self, t, index):
        if np.ndim(t) == 0:
            return self.evaluate(float(t))[index]
        return np.array([self.evaluate(float(moment))[index] for moment in t]).reshape(-1, 3)


def _apex(p0, p1, duration, height):
    """Returns position and velocity at half time."""
    chord = p1 - p0
    horizontal = np.hypot(chord[0], chord[1])
    if horizontal < _MIN_HORIZONTAL:
        middle = 0.5 * (p0 + p1)
        middle[2] = max(p0[2], p1[2]) + height
        return middle, np.zeros(3)
    along = np.array([chord[0], chord[1], 0.0]) / horizontal
    # Perpendicular to the chord in the vertical plane that holds it, pointing up.
    raised = (horizontal * _UP - chord[2] * along) / np.hypot(horizontal, chord[2])
    return p0 + _APEX_PART * chord + height * raised, 2.0 * chord / duration


def _quintic(p0, v0, p1, v1, duration):
    """Coefficients (6, 3), constant first, of the quintic with these end points and velocities and no end acceleration."""
    d, t = p1 - p0, duration
    c3 = (10 * d - (6 * v0 + 4 * v1) * t) / t**3
    c4 = (-15 * d + (8 * v0 + 7 * v1) * t) / t**4
    c5 = (6 * d - 3 * (v0 + v1) * t) / t**5
    return np.array([p0, v0, np.zeros(3), c3, c4, c5])
