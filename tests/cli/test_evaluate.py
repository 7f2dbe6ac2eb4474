"""``quadpips evaluate``: whose directory the reports go to."""

import pytest

from quadpips_drake.cli.evaluation.evaluate_perception import (
    chosen_sources,
    default_directory,
    resolve_evaluation_config,
)
from quadpips_drake.errors import UserInputError
from quadpips_drake.trials.result_directory import ResultDirectory
from tests.cli.test_run import quadpips


def test_different_evaluations_have_different_directories():
    options = {"robot": "go2", "terrain": "stairs", "seed": 1}
    variants = [
        ({}, False, None, [], False),
        ({}, True, None, [], False),
        ({}, False, "0.003,0.001,0.002", [], False),
        ({}, False, "0.004,0.001,0.002", [], False),
        ({}, False, None, ["stages.perception.superpixels.iterations=3"], False),
        ({}, False, None, [], True),
        ({"duration": 5.0}, False, None, [], False),
    ]
    names = [
        default_directory(resolve_evaluation_config(options | more, noise, drift, sets), scripted).name
        for more, noise, drift, sets, scripted in variants
    ]
    assert len(set(names)) == len(names), names
    assert names[0] == "perception-go2-stairs-1"


def test_sources_of_regions_have_names_and_their_scores_a_directory():
    config = resolve_evaluation_config({"terrain": "flat"}, False, None, [])
    assert chosen_sources(None, config) == ["superpixels"]
    sources = chosen_sources("superpixels, elevation", config)
    assert sources == ["superpixels", "elevation"]
    assert default_directory(config, False, sources).name.endswith("-superpixels-elevation")
    assert default_directory(config, False, ["superpixels"]) == default_directory(config, False)
    for wrong, message in (("elevatoin", "unknown region source"), ("oracle,oracle", "twice")):
        with pytest.raises(UserInputError, match=message):
            chosen_sources(wrong, config)


def test_scores_are_replaced_only_when_it_is_asked_for(tmp_path):
    (tmp_path / "scores.json").write_text("{}")
    status, _, errors = quadpips("evaluate", "perception", "--terrain", "flat", "--out", tmp_path)
    assert (status, errors.count("\n")) == (2, 1)
    assert "holds results already (scores.json); add --overwrite" in errors


@pytest.mark.parametrize("study", ["gaits", "robustness"])
def test_two_studies_do_not_write_into_one_directory(study, tmp_path):
    with ResultDirectory(tmp_path, ()):
        status, _, errors = quadpips("evaluate", study, "--robots", "go2", "--out", tmp_path)
    assert status == 2
    assert "another process is writing" in errors
    status, _, errors = quadpips("evaluate", study, "--out", "")
    assert status == 2
    assert "--out" in errors
