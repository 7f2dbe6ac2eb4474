"""A trial of a bench, simulated."""

from quadpips_drake.benchmark.bench.bench_trial import run_bench_trial
from quadpips_drake.benchmark.bench.settings import BenchSettings, Course


def test_a_failed_trial_names_its_cause():
    blind = "stages.perception.depth_noise.dropout=1"
    settings = BenchSettings(courses=[Course("anymal_c", "flat")], trials=1, seed=0, duration=1.0, sets=(blind,))
    (spec,) = settings.trial_specs()
    row = run_bench_trial(spec, settings).row
    assert row["reason"] == "timeout" and len(row["digest"]) == 16
    assert row["cause"]["cause"] == "camera blind"
