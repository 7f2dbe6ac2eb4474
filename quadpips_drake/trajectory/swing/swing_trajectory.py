"""The path of a swinging foot: two quintic pieces over an apex (OCS2's swing planner as used by QuadPiPS, section VI-D)."""

import numpy as np

from quadpips_drake.configuration.schema import configuration, ranged
from quadpips_drake.trajectory.swing.swing_kernels import (
    APEX_PART,
    END,
    START,
    clearing_path,
    depth_on_the_way,
    evaluate_swing,
    sample_swing,
    swing_path,
)

_UP = np.array([0.0, 0.0, 1.0])
_BLEND_START, _BLEND_END = 0.25, 0.75
"""Phases between which the normal turns from lift-off's to touch-down's."""
_RISE_LIMIT = 2.0
"""An apex rises by at most so many times its height to clear the ground."""


@configuration
class SwingConfig:
    """Shape of swings; defaults as in the authors' release."""

    apex_height: float = ranged(0.08, 0.0, 1.0)
    """Height of the apex over the line from lift-off to touch-down [m]."""
    liftoff_velocity: float = ranged(0.2, 0.0, 10.0)
    """Velocity along the normal when the foot leaves [m/s]."""
    touchdown_velocity: float = ranged(-0.4, -10.0, 0.0)
    """Velocity along the normal when the foot lands [m/s]."""
    time_scale: float = ranged(0.15, 0.001, 10.0)
    """Swings shorter than this [s] have their apex and end velocities scaled down in proportion."""
    clearance: float = ranged(0.02, 0.0, 1.0)
    """Least distance to the ground between the ends, where the way there is known or expected [m]."""


class SwingSpline:
    """Foot centre over one swing, from ``p0`` at ``t0`` to ``p1`` at ``t1``; at rest outside. Immutable; frame W.

    Position and velocity are continuous at the apex, the acceleration vanishes there and at both ends. With a ``profile`` of
    the ground (see ground_profile) the apex rises, and moves along the way if need be, until the foot clears it.
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
        profile=None,
        clearance: float = 0.02,
    ):
        """
        Args:
            p0, p1: foot centre at lift-off and touch-down [m], (3,).
            t0, t1: their times [s], t0 < t1.
            apex_height: over the chord [m].
            n0, n1: upward unit normals of the ground there, (3,).
            liftoff_velocity, touchdown_velocity: along these normals [m/s].
            time_scale: shorter swings [s] are flattened in proportion.
            profile: lowest admissible heights of the foot centre at equal parts of the way [m], (n,); None: none.
            clearance: wanted on top of them between the ends [m].
        """
        if not t1 > t0:
            raise ValueError(f"a swing must end after it began, not from {t0} to {t1}")
        self.start_time, self.end_time = float(t0), float(t1)
        self.ends = np.array((p0, p1, n0, n1), dtype=float)
        """Foot centres [m], then normals, at lift-off and touch-down, (4, 3)."""
        self.start_point, self.end_point, self.normals = self.ends[0], self.ends[1], self.ends[2:]
        duration = self.end_time - self.start_time
        shrink = min(1.0, duration / time_scale)
        v0, v1 = (shrink * liftoff_velocity) * self.ends[2], (shrink * touchdown_velocity) * self.ends[3]
        shape, rise, depth = (self.start_point, v0, self.end_point, v1, duration, shrink * apex_height), 0.0, 0.0
        self.profile = profile
        """As given."""
        if profile is None:
            self.path = swing_path(*shape, APEX_PART)
        else:
            heights = np.array(profile, dtype=float)
            self.path, rise = clearing_path(*shape, heights, shrink * clearance, _RISE_LIMIT * apex_height)
            depth = depth_on_the_way(self.path, duration, self.start_point, self.end_point, heights)
        """All of it in one array, for compiled functions; see ``swing_path``."""
        self.apex_height = float(apex_height + rise)
        """Over the chord [m]; of a short swing before it is flattened."""
        self.depth = float(depth)
        """By how much it is below the profile on its way, because no apex clears it [m]."""
        self.path[START], self.path[END] = self.start_time, self.end_time

    @staticmethod
    def plan(
        t0, t1, p0, p1, normal=_UP, config: SwingConfig | None = None, *, liftoff_normal=_UP, profile=None, least_apex=0.0
    ):
        """Returns the swing that ``config`` shapes; ``normal`` is that of the ground at touch-down, ``least_apex`` [m] the
        least height of the apex."""
        config = config or SwingConfig()
        return SwingSpline(
            p0,
            p1,
            t0,
            t1,
            max(config.apex_height, least_apex),
            liftoff_normal,
            normal,
            liftoff_velocity=config.liftoff_velocity,
            touchdown_velocity=config.touchdown_velocity,
            time_scale=config.time_scale,
            profile=profile,
            clearance=config.clearance,
        )

    def evaluate(self, t: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Returns position [m], velocity [m/s] and acceleration [m/s^2] at the time ``t`` [s], (3,) each."""
        out = np.empty((3, 3))
        evaluate_swing(self.path, float(t), out)
        return out[0], out[1], out[2]

    def sample(self, times) -> np.ndarray:
        """Position, velocity and acceleration at ``times`` (n,), as (n, 3, 3): moment, derivative, axis."""
        out = np.empty((len(times), 3, 3))
        sample_swing(self.path, np.array(times, dtype=float), out)
        return out

    def position(self, t) -> np.ndarray:
        """Position [m] at one time (3,) or several (n, 3)."""
        return self._derivative(t, 0)

    def velocity(self, t) -> np.ndarray:
        """Velocity [m/s] at one time (3,) or several (n, 3)."""
        return self._derivative(t, 1)

    def acceleration(self, t) -> np.ndarray:
        """Acceleration [m/s^2] at one time (3,) or several (n, 3)."""
        return self._derivative(t, 2)

    def normal(self, t) -> np.ndarray:
        """Unit normals along which the foot is held to the spline at one time (3,) or several (n, 3): they turn smoothly
        from lift-off's to touch-down's."""
        phase = (np.asarray(t, dtype=float)[..., None] - self.start_time) / (self.end_time - self.start_time)
        s = np.clip((phase - _BLEND_START) / (_BLEND_END - _BLEND_START), 0.0, 1.0)
        part = s * s * (3.0 - 2.0 * s)
        blend = (1.0 - part) * self.normals[0] + part * self.normals[1]
        return blend / np.linalg.norm(blend, axis=-1, keepdims=True)

    def _derivative(self, t, order):
        values = self.sample(np.atleast_1d(t))[:, order]
        return values[0] if np.ndim(t) == 0 else values
