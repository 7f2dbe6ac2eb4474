"""RaisedFootholds: a reference whose footholds lie at the wrong height."""

from quadpips_drake.framework.ports import declare_input, declare_output
from quadpips_drake.framework.systems import LeafSystem
from quadpips_drake.values.reference import WholeBodyReference


class RaisedFootholds(LeafSystem):
    """Shifts the footholds of a reference up or down: the ground is believed to be where it is not.

    .. pydrake_system::

        name: RaisedFootholds
        input_ports:
        - reference
        output_ports:
        - raised_reference

    - reference: WholeBodyReference in absolute time, frame W.
    - raised_reference: the same with footholds ``height`` higher; computed when read.
    """

    def __init__(self, height: float):
        """``height`` in [m]."""
        super().__init__()
        self.set_name("raised_footholds")
        self._height = float(height)
        self._reference = declare_input(self, "reference", WholeBodyReference)
        declare_output(self, "raised_reference", WholeBodyReference, self._raise, {self._reference.ticket()})

    def _raise(self, context) -> WholeBodyReference:
        return self._reference.Eval(context).with_raised_footholds(self._height)
