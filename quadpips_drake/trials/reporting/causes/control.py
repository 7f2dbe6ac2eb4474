"""Causes in the controllers: solvers that find nothing, policies that come late, a base that drifts off its reference."""

from collections.abc import Iterator

from quadpips_drake.trials.reporting.case import Case, Finding
from quadpips_drake.trials.reporting.measurements import lateness_of, outages_of

_AFTER_OUTAGE = 1.5
"""A fall that begins later than this after an outage is not blamed on it [s]."""
_LONG = 0.04
"""Outages shorter than this are bridged by the policy before [s]."""
_LATE = 0.03
"""Policies later than this are more than the controllers are made for [s]."""


def no_solution(case: Case) -> Iterator[Finding]:
    """A solver failed for a while before the chain begins, or in it."""
    if not case.fell:
        return
    for solver, system, key in (
        ("mpc", "centroidal_mpc", "stages.tracking.mpc.ocp.solver"),
        ("wbc", "whole_body_controller", "stages.tracking.wbc.solver"),
    ):
        for outage in outages_of(case.record, solver):
            before = outage.begin <= case.begin + 0.02 and case.begin <= outage.end + _AFTER_OUTAGE
            if not before or outage.end - outage.begin < _LONG:
                continue
            said = [text for time, text in case.notes(solver) if abs(time - outage.begin) < 0.1]
            why = f" ({said[0]})" if said else ""
            when = f"from t = {outage.begin:.2f} s to {outage.end:.2f} s"
            text = f"the solver of {system} failed {outage.failures} times {when}{why}"
            weight = min(0.95, 0.7 + 0.5 * (outage.end - outage.begin))
            keys = (key, "stages.tracking.faults.outage_start") if solver == "mpc" else (key,)
            yield Finding(f"{solver} solver failed", outage.begin, text, system, keys, weight)
            break


def late_policies(case: Case) -> Iterator[Finding]:
    """The policies in force started from old states, all the time."""
    late = lateness_of(case.record) if case.fell else None
    if late is None or late.latency < _LATE:
        return
    text = (
        f"policies of the MPC came into force {1e3 * late.latency:.0f} ms after the state that they start from, with a "
        f"period of {1e3 * late.period:.0f} ms"
    )
    time = float(case.log["time"][0])
    weight = min(0.8, 0.45 + 5.0 * (late.latency - _LATE))
    yield Finding("MPC delay", time, text, "centroidal_mpc", ("stages.tracking.mpc.latency", "latency"), weight)


def off_reference(case: Case) -> Iterator[Finding]:
    """The base left its reference, and nothing else explains it."""
    first = case.chain[0] if case.chain and case.fell else None
    if first is not None and first.kind in ("tilt", "height", "aside"):
        keys = ("velocity",) if case.record.is_walk else ("stages.tracking.mpc.ocp.weights.base_orientation",)
        yield Finding("base off its reference", first.time, first.text, "centroidal_mpc", keys, 0.35)
