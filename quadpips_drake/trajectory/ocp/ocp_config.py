"""Settings of the optimal control problem."""

from dataclasses import field

from quadpips_drake.configuration.schema import configuration, ranged
from quadpips_drake.errors import UserInputError, unknown_name
from quadpips_drake.trajectory.centroidal.centroidal_model import MODEL_KINDS
from quadpips_drake.trajectory.ocp.terms.friction_cone import FRICTION


@configuration
class TrackingWeights:
    """Weights of the squared tracking errors per second; defaults as in the authors' release."""

    base_position: list[float] = ranged([1000.0, 1000.0, 1500.0], 0.0, 1e6)
    """Position of the base, x, y, z in W [1/m^2]."""
    base_orientation: list[float] = ranged([100.0, 300.0, 300.0], 0.0, 1e6)
    """Roll, pitch, yaw [1/rad^2]."""
    linear_velocity: list[float] = ranged([15.0, 15.0, 30.0], 0.0, 1e6)
    """Velocity of the centre of mass, x, y, z in W [s^2/m^2]."""
    angular_velocity: list[float] = ranged([10.0, 30.0, 30.0], 0.0, 1e6)
    """Angular velocity that the angular momentum amounts to with locked joints, x, y, z [s^2/rad^2]."""
    joint_position: list[float] = ranged([2.0, 2.0, 1.0], 0.0, 1e6)
    """HAA, HFE, KFE [1/rad^2]."""
    joint_velocity: list[float] = ranged([0.02, 0.02, 0.01], 1e-6, 1e6)
    """HAA, HFE, KFE [s^2/rad^2]."""
    foot_position: list[float] = ranged([100.0, 100.0, 100.0], 0.0, 1e6)
    """Swinging feet, x, y, z in W [1/m^2]."""
    foot_velocity: list[float] = ranged([10.0, 10.0, 10.0], 0.0, 1e6)
    """Swinging feet, x, y, z in W [s^2/m^2]."""
    contact_force: list[float] = ranged([0.001, 0.001, 0.001], 1e-8, 1e6)
    """x, y, z in W [1/N^2]; must be positive, or the forces would not be determined."""


@configuration
class Barrier:
    """Relaxed logarithmic barrier: -mu ln(h) for h > delta, a parabola below."""

    mu: float = ranged(0.1, 0.0, 1e6)
    """Weight per second [-]."""
    delta: float = ranged(0.1, 1e-6, 1e3)
    """Distance from the limit below which the parabola takes over, in the unit of what is limited."""


@configuration
class SdfClearanceConfig:
    """Knees and trunk stay clear of the ground, where a region source knows its signed distance; only the MPC is told it."""

    enabled: bool = False
    """Whether they do."""
    barrier: Barrier = field(default_factory=lambda: Barrier(2.5, 0.005))
    """delta in m."""
    reach: float = ranged(0.1, 0.01, 10.0)
    """A sphere that is further from the ground than this does not notice it [m]."""
    knee_radius: float = ranged(0.08, 0.0, 1.0)
    """Of the spheres at the knees [m]."""
    trunk_radius: float = ranged(0.05, 0.0, 1.0)
    """Of the spheres at the lower corners of the trunk [m]."""


@configuration
class TrajectoryOcpConfig:
    """Settings of the optimal control problem (QuadPiPS eq. 19), whoever solves it."""

    model: str = "centroidal"
    """Dynamics: centroidal (momentum of all links) or single_rigid_body (massless legs)."""
    weights: TrackingWeights = field(default_factory=TrackingWeights)
    friction: float = ranged(FRICTION, 0.01, 10.0)
    """Friction coefficient, unless the task brings its own [-]."""
    min_normal_force: float = ranged(0.0, 0.0, 1e4)
    """Least normal force of a stance foot [N]."""
    joint_position_barrier: Barrier = field(default_factory=lambda: Barrier(0.1, 0.01))
    """delta in rad."""
    joint_velocity_barrier: Barrier = field(default_factory=lambda: Barrier(0.1, 0.1))
    """delta in rad/s."""
    joint_torque_barrier: Barrier = field(default_factory=lambda: Barrier(1.0, 1.0))
    """delta in N m."""
    foothold_barrier: Barrier = field(default_factory=lambda: Barrier(0.1, 0.01))
    """delta in m."""
    torque_limit_factor: float = ranged(1.0, 0.01, 100.0)
    """Part of the joints' torque limits that may be used [-]."""
    stance_position_gain: float = ranged(5.0, 0.0, 1000.0)
    """How fast a stance foot returns to its touch-down point [1/s]."""
    swing_error_gain: float = ranged(15.0, 0.0, 1000.0)
    """How fast a swing foot returns to its spline, in the constrained directions [1/s]."""
    swing_constraint_directions: int = ranged(1, 1, 3)
    """1: the spline binds a swing foot along the surface normal, tracking cost does the rest; 3: in all directions."""
    terminal_cost_scale: float = ranged(1.0, 0.0, 1e3)
    """Factor on the terminal cost from the linear-quadratic regulator [-]; 0 switches it off."""
    terminal_horizon: float = ranged(2.0, 0.05, 20.0)
    """Time over which the regulator's cost is summed up [s]."""
    solver: str = "piqp"
    """Back-end for the quadratic programs, see quadpips_drake.solvers.registry."""
    qp_tolerance: float = ranged(1e-5, 1e-15, 1.0)
    """Tolerance on the residuals of the quadratic programs [-]."""

    def __post_init__(self):
        if self.model not in MODEL_KINDS:
            raise unknown_name("model", self.model, MODEL_KINDS)
        if self.swing_constraint_directions not in (1, 3):
            raise UserInputError(f"swing_constraint_directions must be 1 or 3, not {self.swing_constraint_directions}")


@configuration
class OcpConfig(TrajectoryOcpConfig):
    """The same of a problem that is solved by real-time iterations, as the MPC does."""

    max_step: float = ranged(0.5, 1e-3, 10.0)
    """Largest change of a pose coordinate or joint in one real-time iteration [m, rad]; larger steps are scaled down."""
    sdf_clearance: SdfClearanceConfig = field(default_factory=SdfClearanceConfig)
