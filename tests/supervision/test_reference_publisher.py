"""A plan is published once, a little ahead of time, and dropped on abort."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.common.value import AbstractValue
from pydrake.systems.analysis import Simulator

from quadpips_drake.supervision.reference_publisher import Publication, ReferencePublisherConfig, publish
from quadpips_drake.supervision.reference_publisher_system import ReferencePublisher
from quadpips_drake.values.contact_schedule import ContactSchedule
from quadpips_drake.values.plans import PlanStart
from quadpips_drake.values.reference import ReferenceCut, WholeBodyReference
from tests.values.test_reference import trot

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


def made_ahead(request_id, follows, begin):
    return replace(trot(request_id, 0.0, 4, 2.0), start=PlanStart(follows, begin, np.zeros(24)))


@pytest.mark.parametrize(("now", "follows", "in_force"), [(3.2, 1, 2), (3.5, 1, 2), (3.6, 1, 1), (3.2, 7, 1)])
def test_a_plan_made_ahead_continues_what_it_was_made_for_in_time_or_is_left_out(now, follows, in_force):
    followed = Publication(trot(1, 0.0, 8, 1.0), 1)
    published = publish(followed, made_ahead(2, follows, 3.5), False, now, ReferencePublisherConfig())
    assert published.last_id == 2
    assert published.reference.request_id == in_force
    assert published.reference.end_time == pytest.approx(5.5 if in_force == 2 else 4.0)
    again = publish(published, made_ahead(2, follows, 3.5), False, now + 0.01, ReferencePublisherConfig())
    assert again is published


def test_a_plan_made_ahead_does_not_revive_an_aborted_reference():
    aborted = publish(Publication(trot(1, 0.0, 8, 1.0), 1), made_ahead(2, 1, 3.5), True, 3.0, ReferencePublisherConfig())
    late = publish(aborted, made_ahead(3, 1, 3.5), False, 3.1, ReferencePublisherConfig())
    assert len(late.reference.times) == 0


def test_a_reference_is_cut_off_once_and_may_go_on_from_there():
    first = Publication(trot(1, 0.0, 8, 1.0), 1)
    cut = ReferenceCut(1, 2.0)
    assert publish(first, _plan(1), False, 1.0, CONFIG, ReferenceCut(7, 2.0)) is first, "another one"
    assert publish(first, _plan(1), False, 2.2, CONFIG, cut) is first, "too late"
    short = publish(first, _plan(1), False, 1.0, CONFIG, cut)
    assert short.reference.request_id == 1 and 2.0 < short.reference.end_time < 2.5
    assert all(f.touchdown_time <= 2.0 for f in short.reference.footholds)
    assert publish(short, _plan(1), False, 1.1, CONFIG, cut) is short
    late = publish(short, made_ahead(2, 1, 3.5), False, 1.2, CONFIG, cut)
    assert late.reference is short.reference and late.last_id == 2, "made for what was cut off"
    joined = publish(late, made_ahead(3, 1, 2.0), False, 1.3, CONFIG, cut)
    assert joined.reference.request_id == 3 and joined.reference.end_time == pytest.approx(4.0)
    assert publish(joined, made_ahead(3, 1, 2.0), False, 1.4, CONFIG, cut) is joined
    shorter = publish(late, _plan(2), False, 1.2, CONFIG, ReferenceCut(1, 1.5))
    assert shorter.reference.end_time < 2.0 and shorter.cut_at == 1.5
