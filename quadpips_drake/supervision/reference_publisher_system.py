"""ReferencePublisher: puts planned references on the robot's clock."""

from pydrake.common.value import AbstractValue
from pydrake.systems.framework import LeafSystem

from quadpips_drake.supervision.reference_publisher import Publication, ReferencePublisherConfig, publish
from quadpips_drake.values.reference import WholeBodyReference


class ReferencePublisher(LeafSystem):
    """Publishes each new plan once, shifted in time to start a little in the future, and holds it until the next one.

    QuadPiPS section VII-A: the reference is shifted to now + ``time_ahead`` (0.25 s), which leaves the MPC time to see it
    coming.

    .. pydrake_system::

        name: ReferencePublisher
        input_ports:
        - planned_reference
        - abort (optional)
        output_ports:
        - reference

    - planned_reference: WholeBodyReference with times relative to its own start; frame W; published once for each new
      ``request_id``; without samples or with an id seen before: ignored.
    - abort (optional): bool; while True the reference is dropped and the robot stands.
    - reference: WholeBodyReference in absolute time, frame W; without samples (request id 0) while there is nothing to
      follow. Updated at 1 / ``period``.
    """

    def __init__(self, config: ReferencePublisherConfig | None = None, *, period: float = 0.01):
        super().__init__()
        self.set_name("reference_publisher")
        self._config = config or ReferencePublisherConfig()
        self._planned = self.DeclareAbstractInputPort("planned_reference", AbstractValue.Make(WholeBodyReference.empty()))
        self._abort = self.DeclareAbstractInputPort("abort", AbstractValue.Make(False))
        self._state = self.DeclareAbstractState(AbstractValue.Make(Publication(WholeBodyReference.empty())))
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._update)
        self.DeclareAbstractOutputPort(
            "reference",
            lambda: AbstractValue.Make(WholeBodyReference.empty()),
            lambda context, output: output.set_value(context.get_abstract_state(int(self._state)).get_value().reference),
            {self.abstract_state_ticket(self._state)},
        )

    def _update(self, context, state):
        last = context.get_abstract_state(int(self._state)).get_value()
        abort = self._abort.HasValue(context) and self._abort.Eval(context)
        new = publish(last, self._planned.Eval(context), abort, context.get_time(), self._config)
        if new is not last:
            state.get_mutable_abstract_state(int(self._state)).set_value(new)
