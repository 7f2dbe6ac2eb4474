"""Settings of the optimal control problem."""

from dataclasses import dataclass, field

from quadpips_drake.errors import UserInputError, unknown_name
from quadpips_drake.trajectory.centroidal.centroidal_model import MODEL_KINDS

FRICTION_PYRAMIDS = ("inscribed", "circumscribed")


@dataclass
class TrackingWeights:
    """Weights of the squared tracking errors per second; defaults as in the authors' release."""

    base_position: list[float] = field(default_factory=lambda: [1000.0, 1000.0, 1500.0])
    """x, y, z in W [1/m^2]."""
    base_orientation: list[float] = field(default_factory=lambda: [100.0, 300.0, 300.0])
    """Roll, pitch, yaw [1/rad^2]."""
    linear_velocity: list[float] = field(default_factory=lambda: [15.0, 15.0, 30.0])
    """Velocity of the centre of mass, x, y, z in W [s^2/m^2]."""
    angular_velocity: list[float] = field(default_factory=lambda: [10.0, 30.0, 30.0])
    """Angular velocity that the angular momentum amounts to with locked joints, x, y, z [s^2/rad^2]."""
    joint_position: list[float] = field(default_factory=lambda: [2.0, 2.0, 1.0])
    """HAA, HFE, KFE [1/rad^2]."""
    joint_velocity: list[float] = field(default_factory=lambda: [0.02, 0.02, 0.01])
    """HAA, HFE, KFE [s^2/rad^2]."""
    foot_position: list[float] = field(default_factory=lambda: [100.0, 100.0, 100.0])
    """Swinging feet, x, y, z in W [1/m^2]."""
    foot_velocity: list[float] = field(default_factory=lambda: [10.0, 10.0, 10.0])
    """Swinging feet, x, y, z in W [s^2/m^2]."""
    contact_force: list[float] = field(default_factory=lambda: [0.001, 0.001, 0.001])
    """x, y, z in W [1/N^2]; must be positive, or the forces would not be determined."""

    def __post_init__(self):
        for name, values in vars(self).items():
            if len(values) != 3 or min(values) < 0:
                raise UserInputError(f"weights.{name} must be three numbers >= 0, not {values}")
        if min(self.contact_force) <= 0 or min(self.joint_velocity) <= 0:
            raise UserInputError("weights.contact_force and weights.joint_velocity must be > 0")


@dataclass
class Barrier:
    """Relaxed logarithmic barrier: -mu ln(h) for h > delta, a parabola below."""

    mu: float = 0.1
    """Weight per second [-]."""
    delta: float = 0.1
    """Distance from the limit below which the parabola takes over, in the unit of what is limited."""

    def __post_init__(self):
        if self.mu < 0 or self.delta <= 0:
            raise UserInputError(f"a barrier needs mu >= 0 and delta > 0, not mu = {self.mu}, delta = {self.delta}")


@dataclass
class OcpConfig:
    """Settings of the optimal control problem (QuadPiPS eq. 19)."""

    model: str = "centroidal"
    """Dynamics: centroidal (momentum of all links) or single_rigid_body (massless legs)."""
    weights: TrackingWeights = field(default_factory=TrackingWeights)
    friction: float = 0.5
    """Friction coefficient, unless the task brings its own [-]."""
    friction_pyramid: str = "inscribed"
    """inscribed: |tangential components| <= friction / sqrt(2) * normal, all of it inside the cone; circumscribed: without
    the root, so the corners lie outside."""
    min_normal_force: float = 0.0
    """Least normal force of a stance foot [N]."""
    joint_position_barrier: Barrier = field(default_factory=lambda: Barrier(0.1, 0.01))
    """delta in rad."""
    joint_velocity_barrier: Barrier = field(default_factory=lambda: Barrier(0.1, 0.1))
    """delta in rad/s."""
    joint_torque_barrier: Barrier = field(default_factory=lambda: Barrier(1.0, 1.0))
    """delta in N m."""
    foothold_barrier: Barrier = field(default_factory=lambda: Barrier(0.1, 0.01))
    """delta in m."""
    torque_limit_factor: float = 1.0
    """Part of the joints' torque limits that may be used [-]."""
    stance_position_gain: float = 5.0
    """How fast a stance foot returns to its touch-down point [1/s]."""
    swing_error_gain: float = 15.0
    """How fast a swing foot returns to its spline, in the constrained directions [1/s]."""
    swing_constraint_directions: int = 1
    """1: the spline binds a swing foot along the surface normal, tracking cost does the rest; 3: in all directions."""
    terminal_cost_scale: float = 1.0
    """Factor on the terminal cost from the linear-quadratic regulator [-]; 0 switches it off."""
    terminal_horizon: float = 2.0
    """Time over which the regulator's cost is summed up [s]."""
    max_step: float = 0.5
    """Largest change of a pose coordinate or joint in one real-time iteration [m, rad]; larger steps are scaled down."""
    solver: str = "piqp"
    """Back-end for the quadratic programs, see quadpips_drake.solvers.registry."""
    qp_tolerance: float = 1e-5
    """Tolerance on the residuals of the quadratic programs [-]."""

    def __post_init__(self):
        if self.model not in MODEL_KINDS:
            raise unknown_name("model", self.model, MODEL_KINDS)
        if self.friction_pyramid not in FRICTION_PYRAMIDS:
            raise unknown_name("friction pyramid", self.friction_pyramid, FRICTION_PYRAMIDS)
        if self.friction <= 0:
            raise UserInputError(f"friction must be > 0, not {self.friction}")
        if self.swing_constraint_directions not in (1, 3):
            raise UserInputError(f"swing_constraint_directions must be 1 or 3, not {self.swing_constraint_directions}")
        if self.min_normal_force < 0 or min(self.max_step, self.terminal_horizon, self.qp_tolerance) <= 0:
            raise UserInputError("min_normal_force must be >= 0; max_step, terminal_horizon and qp_tolerance must be > 0")

    @property
    def pyramid_friction(self) -> float:
        """Slope of the pyramid's faces for a coefficient of 1 [-]."""
        return 2.0**-0.5 if self.friction_pyramid == "inscribed" else 1.0
