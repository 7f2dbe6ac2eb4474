"""Pushes: forces on the base at set times."""

from collections.abc import Sequence

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.multibody.math import SpatialForce
from pydrake.multibody.plant import ExternallyAppliedSpatialForce
from pydrake.systems.framework import AbstractParameterIndex

from quadpips_drake.configuration.schema import MAX_DURATION, configuration, ranged
from quadpips_drake.framework.systems import LeafSystem


@configuration
class Push:
    """A constant force on the base for a while."""

    force: list[float] = ranged([0.0, 0.0, 0.0], -1e5, 1e5)
    """Vector in W [N]."""
    time: float = ranged(0.0, 0.0, MAX_DURATION)
    """When it begins [s]."""
    duration: float = ranged(0.1, 1e-4, MAX_DURATION)
    """How long it lasts [s]."""


def force_at(pushes: Sequence[Push], time: float) -> np.ndarray:
    """Sum of the forces that act at ``time`` [s], in W [N], (3,)."""
    acting = [push.force for push in pushes if push.time - 1e-9 <= time < push.time + push.duration - 1e-9]
    return np.sum(acting, axis=0) if acting else np.zeros(3)


class PushSource(LeafSystem):
    """Applies pushes at the base's centre of mass. They are a parameter of the context: ``add`` gives it one more.

    .. pydrake_system::

        name: PushSource
        output_ports:
        - applied_spatial_force

    - applied_spatial_force: list of pydrake ExternallyAppliedSpatialForce, frame W; empty while nobody pushes.
    """

    def __init__(self, pushes: Sequence[Push], body, p_BoBq_B=(0.0, 0.0, 0.0)):
        """Args: pushes; the plant's RigidBody that is pushed; where, in its frame [m], (3,)."""
        super().__init__()
        self.set_name("pushes")
        self._body, self._point = body, np.array(p_BoBq_B, dtype=float)
        self._pushes = self.DeclareAbstractParameter(AbstractValue.Make(tuple(pushes)))
        example = AbstractValue.Make([ExternallyAppliedSpatialForce()])
        causes = {self.time_ticket(), self.abstract_parameter_ticket(AbstractParameterIndex(self._pushes))}
        self.DeclareAbstractOutputPort("applied_spatial_force", lambda: example.Clone(), self._calc, causes)

    def add(self, root_context, push: Push) -> None:
        """Lets ``push`` act as well, in a simulation that goes on; those that are over are forgotten."""
        context = self.GetMyMutableContextFromRoot(root_context)
        pushes = (*self._pushes_in(context), push)
        now = [p for p in pushes if p.time + p.duration > root_context.get_time()]
        context.get_mutable_abstract_parameter(int(self._pushes)).set_value(tuple(now))

    def _pushes_in(self, context) -> tuple[Push, ...]:
        return context.get_abstract_parameter(int(self._pushes)).get_value()

    def _calc(self, context, output):
        force = force_at(self._pushes_in(context), context.get_time())
        applied = []
        if force.any():
            push = ExternallyAppliedSpatialForce()
            push.body_index = self._body.index()
            push.p_BoBq_B = self._point
            push.F_Bq_W = SpatialForce(np.zeros(3), force)
            applied.append(push)
        output.set_value(applied)
