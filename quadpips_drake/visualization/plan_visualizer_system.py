"""PlanVisualizer: draws what the robot sees and plans into Meshcat, live and for recordings."""

from dataclasses import dataclass

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.geometry import Meshcat
from pydrake.systems.framework import EventStatus

from quadpips_drake.configuration.schema import configuration, ranged
from quadpips_drake.framework.ports import declare_input
from quadpips_drake.framework.systems import LeafSystem
from quadpips_drake.values.images import AffordanceImage
from quadpips_drake.values.immutable import ImmutableValue
from quadpips_drake.values.plans import PlanSketch
from quadpips_drake.values.reference import WholeBodyReference
from quadpips_drake.values.regions import RegionSet
from quadpips_drake.visualization.meshcat_layers import MeshcatLayers
from quadpips_drake.visualization.meshes.plan_meshes import (
    base_mesh,
    foothold_mesh,
    label_points,
    plan_mesh,
    region_mesh,
    swing_mesh,
)


@configuration
class PlanVisualizerConfig:
    """How often is drawn, and whether earlier drawings stay for a recording."""

    period: float = ranged(0.03125, 0.001, 1000.0)
    """Time between looks at the inputs [s]."""
    region_period: float = ranged(1.0, 0.001, 1000.0)
    """Least time between two drawings of regions while the plan stays the same [s]; each costs some 50 kB of recording."""
    label_period: float = ranged(1.0, 0.001, 1000.0)
    """Least time between two drawings of labels [s]; each costs up to 100 kB of recording."""
    label_stride: int = ranged(10, 1, 4096)
    """Every how many rows and columns of the image a label is drawn [pixels]."""
    keep_history: bool = True
    """Whether what is out of date is hidden (a recording can show it again) or deleted."""


@dataclass(frozen=True, eq=False)
class _Drawn(ImmutableValue):
    """What is on show: numbers of the drawings and what identifies their values."""

    regions: int = 0
    region_time: float = -np.inf
    region_stamp: float = -np.inf
    labels: int = 0
    label_time: float = -np.inf
    label_stamp: float = -np.inf
    reference: int = 0
    reference_key: tuple = ()
    plan: int = 0
    plan_key: tuple = ()


class PlanVisualizer(LeafSystem):
    """Draws labels, regions, planned footholds, swing curves and base reference into Meshcat.

    Meshcat records transforms and properties but no objects (drake issue 23206). Therefore every new plan and every new
    set of regions gets objects of its own under a numbered path, and only their visibility changes over time.

    .. pydrake_system::

        name: PlanVisualizer
        input_ports:
        - region_set (optional)
        - reference (optional)
        - plan (optional)
        - affordance_image (optional)
        output_ports: []

    - region_set (optional): RegionSet, frame W; drawn with each new reference and otherwise every ``region_period``. An
      empty one is not drawn.
    - reference (optional): WholeBodyReference, frame W; drawn when it changes. One without samples is not drawn.
    - plan (optional): PlanSketch, frame W; its footholds are drawn as discs when it changes. One without any is not drawn.
    - affordance_image (optional): AffordanceImage; its labelled points are drawn every ``label_period``: green where a foot
      can stand, yellow what it clears, red what it must avoid. Points without a label are not drawn.
    """

    def __init__(self, robot, meshcat: Meshcat, config: PlanVisualizerConfig | None = None):
        super().__init__()
        self.set_name("plan_visualizer")
        self._robot = robot
        self._config = config or PlanVisualizerConfig()
        self._layers = MeshcatLayers(meshcat, keep_history=self._config.keep_history)
        self._region_set = declare_input(self, "region_set", RegionSet)
        self._reference = declare_input(self, "reference", WholeBodyReference)
        self._plan = declare_input(self, "plan", PlanSketch)
        self._image = declare_input(self, "affordance_image", AffordanceImage)
        self._drawn = self.DeclareAbstractState(AbstractValue.Make(_Drawn()))
        self.DeclarePeriodicUnrestrictedUpdateEvent(self._config.period, 0.0, self._look)

    def _look(self, context, state):
        """Draws what has changed since the last look."""
        time = context.get_time()
        before = context.get_abstract_state(int(self._drawn)).get_value()
        after = dict(vars(before))
        if self._reference.HasValue(context):
            self._draw_reference(self._reference.Eval(context), time, before, after)
        if self._plan.HasValue(context):
            self._draw_plan(self._plan.Eval(context), time, before, after)
        # Regions and images are asked for only when they are to be drawn: that (HasValue too) may be what computes them.
        new_plan = after["reference"] != before.reference
        if (new_plan or self._is_due(before.region_time, "region_period", time)) and self._region_set.HasValue(context):
            self._draw_regions(self._region_set.Eval(context), time, before, after)
        if self._is_due(before.label_time, "label_period", time) and self._image.HasValue(context):
            self._draw_labels(self._image.Eval(context), time, before, after)
        state.get_mutable_abstract_state(int(self._drawn)).set_value(_Drawn(**after))
        return EventStatus.Succeeded()

    def _draw_reference(self, reference: WholeBodyReference, time: float, before: _Drawn, after: dict):
        key = reference.edition
        if len(reference.times) == 0 or key == before.reference_key:
            return
        number = before.reference + 1
        self._layers.replace("footholds", number, foothold_mesh(reference), time)
        self._layers.replace("swings", number, swing_mesh(reference, self._robot), time)
        self._layers.replace("base_reference", number, base_mesh(reference), time)
        after |= {"reference": number, "reference_key": key}

    def _draw_plan(self, plan: PlanSketch, time: float, before: _Drawn, after: dict):
        key = (plan.id, plan.stamp)
        if len(plan.points) == 0 or key == before.plan_key:
            return
        self._layers.replace("stances", before.plan + 1, plan_mesh(plan), time)
        after |= {"plan": before.plan + 1, "plan_key": key}

    def _is_due(self, last: float, period: str, time: float) -> bool:
        """Whether something that was drawn at the time ``last`` may be drawn again."""
        return time - last >= getattr(self._config, period) - 1e-9

    def _draw_regions(self, regions: RegionSet, time: float, before: _Drawn, after: dict):
        if regions.regions and regions.stamp != before.region_stamp:
            self._layers.replace("regions", before.regions + 1, region_mesh(regions), time, opacity=0.85)
            after |= {"regions": before.regions + 1, "region_time": time, "region_stamp": regions.stamp}

    def _draw_labels(self, image: AffordanceImage, time: float, before: _Drawn, after: dict):
        if image.stamp == before.label_stamp or not image.labels.any():
            return
        points = label_points(image, self._config.label_stride)
        self._layers.replace("labels", before.labels + 1, points, time)
        after |= {"labels": before.labels + 1, "label_time": time, "label_stamp": image.stamp}
