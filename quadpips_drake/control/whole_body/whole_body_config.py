"""Settings of whole-body control."""

from dataclasses import dataclass

from quadpips_drake.control.early_contact import EARLY_CONTACT_PHASE
from quadpips_drake.errors import UserInputError, unknown_name
from quadpips_drake.framework.stage_config import StageConfig

METHODS = ("weighted", "hierarchical")


@dataclass
class WbcConfig(StageConfig):
    """Gains and weights of whole-body control. Weights multiply squared accelerations, so they compare one with another."""

    rate: float = 500.0
    """How often it solves [Hz] (QuadPiPS: 500 to 1000)."""

    method: str = "weighted"
    """How tasks are ranked: weighted (one program, errors are traded by weight) or hierarchical (strictly by priority)."""
    solver: str = "piqp_direct"
    """Solver of the quadratic program: piqp_direct (repeatable to the bit), proxqp_dense (warm-started, not repeatable
    to the bit), or any of the registry (proxqp, osqp, clarabel, ...)."""
    friction: float = 0.6
    """Friction coefficient mu that the forces respect [1]."""
    max_force_ratio: float = 1.5
    """Largest normal force of one foot, as a multiple of the robot's weight [1]."""
    base_linear_kp: float = 60.0
    """[1/s^2]"""
    base_linear_kd: float = 12.0
    """[1/s]"""
    base_angular_kp: float = 150.0
    """[1/s^2]"""
    base_angular_kd: float = 20.0
    """[1/s]"""
    swing_kp: float = 550.0
    """[1/s^2] (QuadPiPS release: 550)"""
    swing_kd: float = 40.0
    """[1/s] (QuadPiPS release: 50)"""
    stance_damping: float = 20.0
    """Decelerates a stance foot that slides [1/s]."""
    search_speed: float = 0.4
    """How fast a foot that misses its ground is lowered [m/s]."""
    search_depth: float = 0.12
    """How far below its foothold it is lowered at most [m]."""
    early_contact_phase: float = EARLY_CONTACT_PHASE
    """From this part of a swing on a touch counts as touch-down [1], for the MPC as well."""
    base_weight: float = 1.0
    """Of errors of the base's acceleration [s^4/m^2, s^4/rad^2]."""
    stance_weight: float = 500.0
    """Of accelerations of feet on the ground [s^4/m^2]."""
    swing_weight: float = 100.0
    """Of errors of the acceleration of feet in the air [s^4/m^2]."""
    force_weight: float = 0.2
    """Of force errors divided by the robot's mass [s^4/m^2]."""
    joint_weight: float = 1e-5
    """Of the joints' accelerations, to keep them small [s^4/rad^2]."""
    joint_stops: bool = False
    """Whether joints are braked ahead of their position limits (a soft constraint)."""
    joint_stop_rate: float = 25.0
    """How briskly: a joint may come as near to its stop as a critically damped motion of this rate does [1/s]."""
    joint_stop_margin: float = 0.02
    """Distance from the limits that they keep [rad]."""
    joint_stop_weight: float = 50.0
    """Of accelerations beyond that bound, in the weighted program [s^4/rad^2]."""
    stand_stiffness: float = 2.5
    """Joint stiffness without a policy, as a multiple of the effort limit [1/rad]."""
    stand_damping: float = 0.06
    """Joint damping without a policy, as a multiple of the effort limit [s/rad]."""
    max_consecutive_failures: int = 10
    """After so many failed programs in a row the robot stands by joint control alone."""

    def __post_init__(self):
        super().__post_init__()
        if self.method not in METHODS:
            raise unknown_name("method of whole-body control", self.method, METHODS)
        for name in (
            "friction",
            "max_force_ratio",
            "base_weight",
            "stance_weight",
            "swing_weight",
            "force_weight",
            "joint_weight",
            "joint_stop_rate",
            "joint_stop_weight",
        ):
            if getattr(self, name) <= 0.0:
                raise UserInputError(f"whole_body_controller.{name} must be positive, is {getattr(self, name)}")
