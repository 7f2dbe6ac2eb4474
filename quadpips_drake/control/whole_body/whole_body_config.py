"""Settings of whole-body control."""

from quadpips_drake.configuration.schema import configuration, ranged
from quadpips_drake.control.early_contact import EARLY_CONTACT_PHASE
from quadpips_drake.errors import unknown_name
from quadpips_drake.framework.stage_config import StageConfig, stage_rate
from quadpips_drake.trajectory.ocp.terms.friction_cone import FRICTION

METHODS = ("weighted", "hierarchical")


@configuration
class WbcConfig(StageConfig):
    """Gains and weights of whole-body control. Weights multiply squared accelerations, so they compare one with another."""

    rate: float = stage_rate(500.0)
    """How often it solves [Hz] (QuadPiPS: 500 to 1000)."""

    method: str = "weighted"
    """How tasks are ranked: weighted (one program, errors are traded by weight) or hierarchical (strictly by priority)."""
    solver: str = "piqp_direct"
    """Solver of the quadratic program: piqp_direct (repeatable to the bit), proxqp_dense (warm-started, not repeatable
    to the bit), or any of the registry (proxqp, osqp, clarabel, ...)."""
    friction: float = ranged(FRICTION, 0.01, 10.0)
    """Friction coefficient mu that the forces respect [1]."""
    max_force_ratio: float = ranged(1.5, 0.1, 100.0)
    """Largest normal force of one foot, as a multiple of the robot's weight [1]."""
    base_linear_kp: float = ranged(60.0, 0.0, 1e5)
    """Acceleration of the base per error of its position [1/s^2]."""
    base_linear_kd: float = ranged(12.0, 0.0, 1e4)
    """... per error of its velocity [1/s]."""
    base_angular_kp: float = ranged(150.0, 0.0, 1e5)
    """Angular acceleration of the base per error of its attitude [1/s^2]."""
    base_angular_kd: float = ranged(20.0, 0.0, 1e4)
    """... per error of its angular velocity [1/s]."""
    swing_kp: float = ranged(550.0, 0.0, 1e5)
    """Acceleration of a swinging foot per error of its position [1/s^2] (QuadPiPS release: 550)."""
    swing_kd: float = ranged(40.0, 0.0, 1e4)
    """... per error of its velocity [1/s] (QuadPiPS release: 50)."""
    stance_damping: float = ranged(20.0, 0.0, 1e4)
    """Decelerates a stance foot that slides [1/s]."""
    search_speed: float = ranged(0.4, 0.0, 10.0)
    """How fast a foot that misses its ground is lowered [m/s]."""
    search_depth: float = ranged(0.12, 0.0, 1.0)
    """How far below its foothold it is lowered at most [m]."""
    early_contact_phase: float = ranged(EARLY_CONTACT_PHASE, 0.0, 1.0)
    """From this part of a swing on a touch counts as touch-down [1], for the MPC as well."""
    base_weight: float = ranged(1.0, 1e-6, 1e6)
    """Of errors of the base's acceleration [s^4/m^2, s^4/rad^2]."""
    stance_weight: float = ranged(500.0, 1e-6, 1e6)
    """Of accelerations of feet on the ground [s^4/m^2]."""
    swing_weight: float = ranged(100.0, 1e-6, 1e6)
    """Of errors of the acceleration of feet in the air [s^4/m^2]."""
    force_weight: float = ranged(0.2, 1e-6, 1e6)
    """Of force errors divided by the robot's mass [s^4/m^2]."""
    joint_weight: float = ranged(1e-5, 1e-8, 1e6)
    """Of the joints' accelerations, to keep them small [s^4/rad^2]."""
    joint_stops: bool = False
    """Whether joints are braked ahead of their position limits (a soft constraint)."""
    joint_stop_rate: float = ranged(25.0, 0.1, 1000.0)
    """How briskly: a joint may come as near to its stop as a critically damped motion of this rate does [1/s]."""
    joint_stop_margin: float = ranged(0.02, 0.0, 1.0)
    """Distance from the limits that they keep [rad]."""
    joint_stop_weight: float = ranged(50.0, 1e-6, 1e6)
    """Of accelerations beyond that bound, in the weighted program [s^4/rad^2]."""
    stand_stiffness: float = ranged(2.5, 0.0, 100.0)
    """Joint stiffness without a policy, as a multiple of the effort limit [1/rad]."""
    stand_damping: float = ranged(0.06, 0.0, 10.0)
    """Joint damping without a policy, as a multiple of the effort limit [s/rad]."""
    max_consecutive_failures: int = ranged(10, 0, 1_000_000)
    """After so many failed programs in a row the robot stands by joint control alone."""

    def __post_init__(self):
        super().__post_init__()
        if self.method not in METHODS:
            raise unknown_name("method of whole-body control", self.method, METHODS)
