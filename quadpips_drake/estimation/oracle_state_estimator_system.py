"""The robot's state, exactly as simulated."""

from pydrake.common.value import AbstractValue
from pydrake.multibody.plant import ContactResults
from pydrake.systems.framework import LeafSystem

from quadpips_drake.math.rotations import attitude_from_quaternion
from quadpips_drake.robots.robot_model import RobotModel
from quadpips_drake.sensing.contact_sensing import ContactGeometries, foot_contact_forces
from quadpips_drake.values.legs import NUM_JOINTS
from quadpips_drake.values.robot_state import RobotState

_BASE_STATE_SIZE = 13
"""Quaternion, position, angular and linear velocity."""


class OracleStateEstimator(LeafSystem):
    """Reports the simulated state of the robot without error or delay.

    Base pose and velocity and the joints are read from the multibody state, forces at the feet from the contact solver. A
    foot counts as in contact when its force exceeds a threshold. Before the first step of the simulation nothing is known
    about forces: they are zero and no foot is in contact.

    .. pydrake_system::

        name: OracleStateEstimator
        input_ports:
        - state
        - contact_results
        - joint_torques
        output_ports:
        - robot_state

    - state: the robot's positions (base quaternion w x y z, base position [m], joints [rad]) and velocities (base angular
      [rad/s] and linear [m/s] velocity in W, joints [rad/s]), vector (37,).
    - contact_results: pydrake ContactResults of the plant.
    - joint_torques: torques that the drives applied last [N m], vector (12,).
    - robot_state: RobotState; frame W; stamped with the time of evaluation; continuous.
    """

    def __init__(self, robot: RobotModel, geometries: ContactGeometries, *, contact_threshold: float = 5.0):
        """Args: robot; its geometries in the plant (``find_contact_geometries``); least force of a contact [N]."""
        LeafSystem.__init__(self)
        self._geometries = geometries
        self._threshold = contact_threshold
        self._state = self.DeclareVectorInputPort("state", 2 * len(robot.joint_names) + _BASE_STATE_SIZE)
        self._contacts = self.DeclareAbstractInputPort("contact_results", AbstractValue.Make(ContactResults()))
        self._torques = self.DeclareVectorInputPort("joint_torques", NUM_JOINTS)
        self.DeclareAbstractOutputPort("robot_state", lambda: AbstractValue.Make(RobotState.empty()), self._calc_state)

    def _calc_state(self, context, output):
        forces = foot_contact_forces(self._contacts.Eval(context), self._geometries)
        state = self._state.Eval(context)
        rpy, rotation = attitude_from_quaternion(state[:4])
        output.set_value(
            RobotState(
                stamp=context.get_time(),
                p_WB=state[4:7].copy(),
                rpy_WB=rpy,
                R_WB=rotation,
                v_WB=state[22:25].copy(),
                w_WB=state[19:22].copy(),
                joint_positions=state[7:19].copy(),
                joint_velocities=state[25:37].copy(),
                joint_torques=self._torques.Eval(context).copy(),
                contact_forces=forces,
                contacts=(forces * forces).sum(axis=1) > self._threshold**2,
            )
        )
