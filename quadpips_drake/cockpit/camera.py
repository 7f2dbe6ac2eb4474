"""What the robot's camera sees, as pictures."""

import numpy as np

from quadpips_drake.cockpit.live_trial import LiveTrial
from quadpips_drake.cockpit.pictures import depth_png, label_png
from quadpips_drake.framework.ports import output_names

_IMAGE = "affordance_image"


class Camera:
    """Looks through the camera of a trial, whether the robot uses it or not."""

    def __init__(self, live: LiveTrial):
        self._trial = live.trial
        regions = getattr(live.trial.diagram, "regions", None)
        self._regions = regions if regions is not None and _IMAGE in output_names(regions) else None

    def look(self) -> dict[str, bytes]:
        """{"camera": PNG, "labels": PNG}, as far as there are such images; rendered now."""
        if self._regions is None:
            station = self._trial.diagram.station
            image = station.GetOutputPort("depth_image").Eval(station.GetMyContextFromRoot(self._trial.context))
            return {"camera": depth_png(np.array(image.data[:, :, 0]))}
        image = self._regions.GetOutputPort(_IMAGE).Eval(self._regions.GetMyContextFromRoot(self._trial.context))
        if not image.depth.size:
            return {}
        return {"camera": depth_png(image.depth), "labels": label_png(image.labels, image.depth)}
