"""FailingMpc: the centroidal MPC with a solver that gives up now and then."""

from quadpips_drake.control.early_contact import EARLY_CONTACT_PHASE
from quadpips_drake.control.mpc.centroidal_mpc_system import CentroidalMpc
from quadpips_drake.control.mpc.mpc_config import MpcConfig
from quadpips_drake.control.mpc.real_time_iteration import MpcMemory
from quadpips_drake.faults.control_faults import ControlFaultConfig
from quadpips_drake.faults.failing_solver import FailingSolver
from quadpips_drake.framework.stage import Inputs
from quadpips_drake.timing import StageTimings


class FailingMpc(CentroidalMpc):
    """Stands in for CentroidalMpc in studies: during set windows of time its solver finds nothing.

    .. pydrake_system::

        name: FailingMpc
        input_ports:
        - robot_state
        - reference
        - signed_distance (optional)
        output_ports:
        - mpc_policy

    - robot_state, reference, signed_distance, mpc_policy: as of CentroidalMpc.
    """

    def __init__(
        self,
        robot,
        config: MpcConfig | None = None,
        faults: ControlFaultConfig | None = None,
        *,
        early_contact_phase: float = EARLY_CONTACT_PHASE,
        timings: StageTimings | None = None,
    ):
        super().__init__(robot, config, early_contact_phase=early_contact_phase, timings=timings)
        self._faults = faults or ControlFaultConfig()
        self._solver = FailingSolver()

    def update(self, inputs: Inputs, memory: MpcMemory, time: float) -> MpcMemory:
        """One solve, or one that fails."""
        solver = self._solver if self._faults.is_out(inputs.robot_state.stamp) else None
        return self._mpc.compute(inputs.robot_state, inputs.reference, memory, solver, inputs.signed_distance)
