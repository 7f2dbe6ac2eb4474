"""What the memoryless stages of perception share: sample the input with a period, or compute on demand."""

from pydrake.common.value import AbstractValue
from pydrake.systems.framework import EventStatus, LeafSystem


def declare_periodic_output(system: LeafSystem, name: str, example, compute, inputs, period: float):
    """Declares the abstract output port ``name`` of ``system``, whose value is ``compute(context)``.

    With a ``period`` [s] above zero the value is computed at the start and then at that rate, kept in abstract state and
    held in between; with zero it is a cache entry that depends on ``inputs`` (input ports) and is computed when read.
    ``example`` is an (immutable) value of the port's type, the value before the first update.
    """
    if period <= 0:
        return system.DeclareAbstractOutputPort(
            name,
            lambda: AbstractValue.Make(example),
            lambda context, output: output.set_value(compute(context)),
            {port.ticket() for port in inputs},
        )
    index = system.DeclareAbstractState(AbstractValue.Make(example))

    def update(context, state):
        state.get_mutable_abstract_state(index).set_value(compute(context))
        return EventStatus.Succeeded()

    system.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, update)
    return system.DeclareStateOutputPort(name, index)
