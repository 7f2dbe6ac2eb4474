"""Tells the cameras' scene where the elements are that appear."""

from pydrake.common.value import AbstractValue
from pydrake.geometry import FrameId, FramePoseVector
from pydrake.math import RigidTransform

from quadpips_drake.framework.systems import LeafSystem


class AppearingPoses(LeafSystem):
    """Passes the poses of some bodies of a plant on to frames of another plant's scene.

    .. pydrake_system::

        name: AppearingPoses
        input_ports:
        - body_poses
        output_ports:
        - frame_poses

    - body_poses: list of pydrake RigidTransform, the poses of all bodies of the plant in W.
    - frame_poses: pydrake FramePoseVector of the frames, in W; computed when it is read.
    """

    def __init__(self, bodies: list, frames: list[FrameId]):
        """``bodies``: BodyIndices in the plant; ``frames``: that of each in the scene."""
        super().__init__()
        self.set_name("appearing_poses")
        self._pairs = [(int(body), frame) for body, frame in zip(bodies, frames, strict=True)]
        self._poses_port = self.DeclareAbstractInputPort("body_poses", AbstractValue.Make([RigidTransform()]))
        self.DeclareAbstractOutputPort("frame_poses", lambda: AbstractValue.Make(FramePoseVector()), self._write)

    def _write(self, context, output) -> None:
        bodies, poses = self._poses_port.Eval(context), FramePoseVector()
        for body, frame in self._pairs:
            poses.set_value(frame, bodies[body])
        output.set_value(poses)
