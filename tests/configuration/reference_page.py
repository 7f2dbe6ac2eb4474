"""Writes docs/configuration_reference.md: ``python -m tests.configuration.reference_page``."""

from quadpips_drake.configuration.reference import reference
from quadpips_drake.learning.dataset_config import DatasetConfig
from quadpips_drake.learning.training import TrainingConfig
from quadpips_drake.robots.robot_description import RobotDescription
from quadpips_drake.trials.trial import TrialConfig
from quadpips_drake.trials.walk_trial import WalkTrialConfig
from tests.source_tree import ROOT

PAGE = ROOT / "docs" / "configuration_reference.md"
_INTRODUCTION = """\
# Reference of all keys

This page is written by `python -m tests.configuration.reference_page` from what the configuration classes say; a test
compares. How keys are set is told in [configuration.md](configuration.md). Defaults are those in code;
`models/<robot>/defaults.yaml` may say otherwise for a robot. Ranges include their ends. They leave out what crashes, never
ends or fills the memory, and what has no meaning; within them, values may still be foolish. `null` stands for "not given".
"""

_RIVAL = """\
## A run with a rival

`quadpips run --planner s_mpc`, see [baselines.md](baselines.md): what it has beside that, or with another default.
"""

_MOTION_MODELS = """## A run by velocity commands

`quadpips run --planner motion_models`, see [motion_models.md](motion_models.md): what it has beside a run, or other than it.
"""


def page() -> str:
    """The whole page."""
    return "\n".join(
        [
            _INTRODUCTION,
            "## A run\n\n`quadpips run`; sections are nested mappings in `config.yaml`.\n",
            reference(TrialConfig()),
            _RIVAL,
            reference(TrialConfig(planner="s_mpc"), without=TrialConfig()),
            "`--planner em_mpc`: what is different again.\n",
            reference(TrialConfig(planner="em_mpc"), without=TrialConfig(planner="s_mpc")),
            "`--planner lf_mpc`: likewise.\n",
            reference(TrialConfig(planner="lf_mpc"), without=TrialConfig(planner="s_mpc")),
            _MOTION_MODELS,
            reference(TrialConfig(planner="motion_models"), without=TrialConfig()),
            "## A walk\n\n`quadpips walk`: what a run has not, or has with another default.\n",
            reference(WalkTrialConfig(), without=TrialConfig()),
            "## A dataset\n\n`quadpips dataset`: recorded in `manifest.json`.\n",
            reference(DatasetConfig()),
            "## A training\n\n`quadpips train`.\n",
            reference(TrainingConfig()),
            "## A robot\n\n`robot.yaml` beside its URDF.\n",
            reference(RobotDescription()),
        ]
    )


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
