"""Where a foothold search begins and what it may step on."""

from dataclasses import dataclass

import numpy as np

from quadpips_drake.planning.experience.edge_experience import EdgeExperience
from quadpips_drake.planning.footholds.foothold_config import FootholdConfig
from quadpips_drake.planning.footholds.foothold_labels import FootholdLabels, foothold_labels
from quadpips_drake.planning.region_table import RegionTable, make_region_table, may_carry_a_foot
from quadpips_drake.planning.start_stance import attach_feet
from quadpips_drake.values.images import LabelImage
from quadpips_drake.values.robot_state import RobotState


@dataclass(frozen=True)
class FootholdProblem:
    """A start stance and the regions to step on; what all attempts of one search share."""

    usable: list
    """PlanarRegions that may carry a foot, and the patches under feet without perceived ground."""
    feet: np.ndarray
    normals: np.ndarray
    regions: np.ndarray
    """Indices of the start regions in ``usable``, (4,)."""
    table: RegionTable
    """The ``usable`` regions as kernels take them."""
    labels: FootholdLabels
    """What footholds cost by their labels."""
    experience: EdgeExperience | None = None
    """What transitions cost by experience; None: nothing."""
    hanging: tuple = ()
    """Legs whose feet have no ground below them at the start."""


def pose_problem(
    state: RobotState,
    regions,
    robot,
    config: FootholdConfig,
    image: LabelImage | None = None,
    experience: EdgeExperience | None = None,
) -> FootholdProblem:
    """Attaches the feet, collects the regions that may carry one, and takes the mask of their labels."""
    usable = [region for region in regions.regions if may_carry_a_foot(region, config.max_slope, config.every_label)]
    attachments = attach_feet(state, usable, robot)
    usable += [attachment.region for attachment in attachments if not attachment.perceived]
    position = {id(region): k for k, region in enumerate(usable)}
    return FootholdProblem(
        usable=usable,
        feet=np.array([attachment.point for attachment in attachments]),
        normals=np.array([attachment.region.normal for attachment in attachments]),
        regions=np.array([position[id(attachment.region)] for attachment in attachments]),
        table=make_region_table(usable),
        labels=foothold_labels(config, usable, image),
        experience=experience,
        hanging=tuple(np.flatnonzero(~state.contacts).tolist()),
    )
