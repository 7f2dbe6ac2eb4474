"""The robot's state, exactly as simulated."""

from quadpips_drake.framework.ports import declare_input, declare_output
from quadpips_drake.framework.systems import LeafSystem
from quadpips_drake.math.rotations import attitude_from_quaternion
from quadpips_drake.values.legs import NUM_JOINTS
from quadpips_drake.values.robot_state import RobotState
from quadpips_drake.values.sensing import FootContacts

_BASE_STATE_SIZE = 13
"""Quaternion, position, angular and linear velocity."""


class OracleStateEstimator(LeafSystem):
    """Reports the simulated state of the robot without error or delay.

    Base pose and velocity and the joints are read from the multibody state, what the feet feel from their sensors.

    .. pydrake_system::

        name: OracleStateEstimator
        input_ports:
        - plant_state
        - joint_torques
        - foot_contacts
        output_ports:
        - robot_state

    - plant_state: the robot's positions (base quaternion w x y z, base position [m], joints [rad]) and velocities (base
      angular [rad/s] and linear [m/s] velocity in W, joints [rad/s]), vector (37,).
    - joint_torques: torques that the drives applied last [N m], vector (12,).
    - foot_contacts: FootContacts of the sensors in the feet.
    - robot_state: RobotState; frame W; stamped with the time of evaluation; continuous.
    """

    def __init__(self):
        super().__init__()
        self.set_name("oracle_state_estimator")
        self._state = self.DeclareVectorInputPort("plant_state", 2 * NUM_JOINTS + _BASE_STATE_SIZE)
        self._torques = self.DeclareVectorInputPort("joint_torques", NUM_JOINTS)
        self._contacts = declare_input(self, "foot_contacts", FootContacts)
        declare_output(self, "robot_state", RobotState, self._estimate)

    def _estimate(self, context) -> RobotState:
        feet = self._contacts.Eval(context)
        state = self._state.Eval(context)
        rpy, rotation = attitude_from_quaternion(state[:4])
        return RobotState(
            stamp=context.get_time(),
            p_WB=state[4:7].copy(),
            rpy_WB=rpy,
            R_WB=rotation,
            v_WB=state[22:25].copy(),
            w_WB=state[19:22].copy(),
            joint_positions=state[7:19].copy(),
            joint_velocities=state[25:37].copy(),
            joint_torques=self._torques.Eval(context).copy(),
            contact_forces=feet.forces,
            contacts=feet.contacts,
        )
