"""CentroidalMpc system: a new policy at 50 Hz."""

from quadpips_drake.control.early_contact import EARLY_CONTACT_PHASE
from quadpips_drake.control.mpc.mpc_config import MpcConfig
from quadpips_drake.control.mpc.real_time_iteration import MpcMemory, RealTimeIteration
from quadpips_drake.framework.stage import Inputs, Stage
from quadpips_drake.timing import StageTimings
from quadpips_drake.values.mpc_policy import MpcPolicy
from quadpips_drake.values.reference import WholeBodyReference
from quadpips_drake.values.regions import SignedDistance
from quadpips_drake.values.robot_state import RobotState


class CentroidalMpc(Stage):
    """Tracks a whole-body reference by model predictive control on the centroidal model.

    min sum |x - x_ref|_Q^2 + |u - u_ref|_R^2 subject to the centroidal dynamics, friction cones, contact and joint limits
    (QuadPiPS section VII-B, eq. 19); one SQP iteration per update, started from the last solution. Without a reference the
    robot stands where it is. A failed solve carries the last policy on and is counted in it.

    .. pydrake_system::

        name: CentroidalMpc
        input_ports:
        - robot_state
        - reference
        - signed_distance (optional)
        output_ports:
        - mpc_policy

    - robot_state: RobotState, frame W.
    - reference: WholeBodyReference in absolute time, frame W; without samples: stand.
    - signed_distance (optional): SignedDistance from the ground, frame W, that knees and trunk keep if
      ``config.ocp.sdf_clearance`` says so.
    - mpc_policy: MpcPolicy in absolute time, frame W; empty before the first one. Updated at ``config.rate`` (50 Hz).
    """

    def __init__(
        self,
        robot,
        config: MpcConfig | None = None,
        *,
        early_contact_phase: float = EARLY_CONTACT_PHASE,
        timings: StageTimings | None = None,
    ):
        """``early_contact_phase``: that of whole-body control [1]."""
        super().__init__("centroidal_mpc", config or MpcConfig(), memory=MpcMemory.empty(), timings=timings)
        self._mpc = RealTimeIteration(robot, self.config, early_contact_phase)
        self.declare_input("robot_state", RobotState)
        self.declare_input("reference", WholeBodyReference)
        self.declare_input("signed_distance", SignedDistance, default=SignedDistance.empty())
        self.declare_output("mpc_policy", MpcPolicy, lambda memory: memory.policy)

    def update(self, inputs: Inputs, memory: MpcMemory, time: float) -> MpcMemory:
        """One solve, once there is a state to start from."""
        if not inputs.robot_state.is_known:
            return memory
        return self._mpc.compute(inputs.robot_state, inputs.reference, memory, ground=inputs.signed_distance)
