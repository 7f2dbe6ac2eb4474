"""A plan is published once, a little ahead of time, and dropped on abort."""

import numpy as np
import pytest
from pydrake.common.value import AbstractValue
from pydrake.systems.analysis import Simulator

from quadpips_drake.supervision.reference_publisher import Publication, ReferencePublisherConfig, publish
from quadpips_drake.supervision.reference_publisher_system import ReferencePublisher
from quadpips_drake.values.contact_schedule import ContactSchedule
from quadpips_drake.values.reference import WholeBodyReference

CONFIG = ReferencePublisherConfig()


def _plan(request_id):
    return WholeBodyReference(
        0.0, request_id, np.array([0.0, 1.0]), np.zeros((2, 24)), np.zeros((2, 24)), ContactSchedule.standing()
    )


def test_a_new_plan_is_shifted_once_and_kept():
    first = publish(Publication(WholeBodyReference.empty()), _plan(1), False, 2.0, CONFIG)
    assert first.reference.times == pytest.approx([2.25, 3.25])
    assert publish(first, _plan(1), False, 2.5, CONFIG) is first
    second = publish(first, _plan(2), False, 4.0, CONFIG)
    assert second.reference.times[0] == pytest.approx(4.25)


def test_abort_drops_the_reference_and_the_plan_behind_it():
    first = publish(Publication(WholeBodyReference.empty()), _plan(1), False, 0.0, CONFIG)
    aborted = publish(first, _plan(2), True, 1.0, CONFIG)
    assert len(aborted.reference.times) == 0
    assert publish(aborted, _plan(2), False, 1.1, CONFIG) is aborted
    assert publish(aborted, _plan(2), True, 1.1, CONFIG) is aborted
    assert publish(aborted, _plan(3), False, 1.2, CONFIG).reference.request_id == 3


def test_the_system_publishes_what_its_port_brings():
    system = ReferencePublisher()
    simulator = Simulator(system)
    context = simulator.get_mutable_context()
    port = system.GetInputPort("planned_reference")
    port.FixValue(context, AbstractValue.Make(WholeBodyReference.empty()))
    simulator.AdvanceTo(0.1)
    assert len(system.GetOutputPort("reference").Eval(context).times) == 0
    port.FixValue(context, AbstractValue.Make(_plan(1)))
    simulator.AdvanceTo(0.2)
    reference = system.GetOutputPort("reference").Eval(context)
    assert reference.times[0] == pytest.approx(reference.stamp + CONFIG.time_ahead)
    assert 0.1 <= reference.stamp <= 0.12
