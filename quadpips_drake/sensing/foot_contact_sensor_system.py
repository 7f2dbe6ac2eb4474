"""What the feet feel, read from the plant's contact results."""

from pydrake.multibody.plant import ContactResults

from quadpips_drake.framework.ports import declare_input, declare_output
from quadpips_drake.framework.systems import LeafSystem
from quadpips_drake.sensing.contact_sensing import ContactGeometries, foot_contact_forces
from quadpips_drake.values.sensing import FootContacts


class FootContactSensor(LeafSystem):
    """Measures the force on each foot; a foot counts as in contact when its force exceeds a threshold.

    Before the first step of the simulation nothing is known about forces: they are zero and no foot is in contact.

    .. pydrake_system::

        name: FootContactSensor
        input_ports:
        - contact_results
        output_ports:
        - foot_contacts

    - contact_results: pydrake ContactResults of the plant.
    - foot_contacts: FootContacts, forces in W; stamped with the time of evaluation; continuous.
    """

    def __init__(self, geometries: ContactGeometries, *, threshold: float = 5.0):
        """Args: the robot's geometries in the plant (``find_contact_geometries``); least force of a contact [N]."""
        super().__init__()
        self.set_name("foot_contact_sensor")
        self._geometries, self._threshold = geometries, threshold
        self._results = declare_input(self, "contact_results", ContactResults)
        declare_output(self, "foot_contacts", FootContacts, self._measure)

    def _measure(self, context) -> FootContacts:
        forces = foot_contact_forces(self._results.Eval(context), self._geometries)
        return FootContacts(context.get_time(), forces, (forces * forces).sum(axis=1) > self._threshold**2)
