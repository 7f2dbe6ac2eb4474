"""The simulation station with a state estimate: the smallest world to try a stage in."""

from quadpips_drake.diagrams.simulation_station import SimulationStation, StationConfig
from quadpips_drake.estimation.oracle_state_estimator_system import OracleStateEstimator
from quadpips_drake.framework.ports import DiagramBuilder, connect_by_name, input_names, output_names
from quadpips_drake.framework.systems import Diagram
from quadpips_drake.robots.robot_model import RobotModel
from quadpips_drake.terrain.terrain import Terrain


class ObservedStation(Diagram):
    """SimulationStation -> OracleStateEstimator; all ports of the station, and the robot's state.

    .. pydrake_system::

        name: ObservedStation
        input_ports:
        - feedforward_torque (optional)
        - desired_joint_state (optional)
        - applied_spatial_force (optional)
        output_ports:
        - depth_image
        - camera_pose
        - depth_image_<camera> (one for each of further_cameras)
        - camera_pose_<camera> (one for each of further_cameras)
        - foot_contacts
        - joint_encoders
        - imu
        - joint_torques
        - plant_state
        - contact_results
        - query_object
        - robot_state

    - feedforward_torque, desired_joint_state, applied_spatial_force, depth_image, camera_pose, depth_image_<camera>,
      camera_pose_<camera>, foot_contacts, joint_encoders, imu, joint_torques, plant_state, contact_results, query_object: as
      of SimulationStation.
    - robot_state: RobotState without error, frame W.
    """

    def __init__(
        self, robot: RobotModel, terrain: Terrain, config: StationConfig | None = None, meshcat=None, *, seed: int = 0
    ):
        """Args: as of SimulationStation."""
        super().__init__()
        builder = DiagramBuilder()
        self.station = builder.AddSystem(SimulationStation(robot, terrain, config or StationConfig(), meshcat, seed=seed))
        self.robot = self.station.robot
        self.camera_intrinsics = self.station.camera_intrinsics
        estimator = builder.AddSystem(OracleStateEstimator())
        outputs = {name: self.station.GetOutputPort(name) for name in output_names(self.station)}
        connect_by_name(builder, estimator, outputs)
        for name in input_names(self.station):
            builder.ExportInput(self.station.GetInputPort(name), name)
        for name, port in outputs.items():
            builder.ExportOutput(port, name)
        builder.ExportOutput(estimator.GetOutputPort("robot_state"), "robot_state")
        builder.BuildInto(self)
        self.set_name("observed_station")

    def set_initial_state(self, root_context, x: float, y: float, yaw: float) -> None:
        """Stands the robot on the terrain; see SimulationStation."""
        self.station.set_initial_state(root_context, x, y, yaw)
