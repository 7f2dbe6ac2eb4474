"""ReferencePublisher: puts planned references on the robot's clock."""

from quadpips_drake.framework.stage import Inputs, Stage
from quadpips_drake.supervision.reference_publisher import Publication, ReferencePublisherConfig, publish
from quadpips_drake.timing import StageTimings
from quadpips_drake.values.reference import ReferenceCut, WholeBodyReference


class ReferencePublisher(Stage):
    """Publishes each new plan once, shifted in time to start a little in the future, and holds it until the next one.

    QuadPiPS section VII-A: the reference is shifted to now + ``time_ahead`` (0.25 s), which leaves the MPC time to see it
    coming.

    .. pydrake_system::

        name: ReferencePublisher
        input_ports:
        - planned_reference
        - abort (optional)
        - cut (optional)
        output_ports:
        - reference

    - planned_reference: WholeBodyReference with times relative to its own start; frame W; published once for each new
      ``request_id``; without samples or with an id seen before: ignored.
    - abort (optional): bool; while True the reference is dropped and the robot stands.
    - cut (optional): ReferenceCut: where the reference that is followed ends early, and the robot comes to rest.
    - reference: WholeBodyReference in absolute time, frame W; without samples (request id 0) while there is nothing to
      follow. Updated at ``config.rate`` (100 Hz).
    """

    def __init__(self, config: ReferencePublisherConfig | None = None, *, timings: StageTimings | None = None):
        config = config or ReferencePublisherConfig()
        memory = Publication(WholeBodyReference.empty())
        super().__init__("reference_publisher", config, memory=memory, timings=timings)
        self.declare_input("planned_reference", WholeBodyReference)
        self.declare_input("abort", bool, default=False)
        self.declare_input("cut", ReferenceCut, default=ReferenceCut.empty())
        self.declare_output("reference", WholeBodyReference, lambda publication: publication.reference)

    def update(self, inputs: Inputs, memory: Publication, time: float) -> Publication:
        """Publishes a new plan if there is one."""
        return publish(memory, inputs.planned_reference, inputs.abort, time, self.config, inputs.cut)
