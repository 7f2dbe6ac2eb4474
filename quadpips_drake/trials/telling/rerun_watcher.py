"""Looks over the shoulder of a trial and writes what it sees into a file of Rerun, for ``--rerun``."""

from pathlib import Path

import numpy as np

from quadpips_drake.framework.ports import output_of
from quadpips_drake.trials.observation import read
from quadpips_drake.trials.simulated_trial import BREAKDOWNS
from quadpips_drake.values.images import AffordanceImage, SuperpixelImage
from quadpips_drake.values.legs import Leg
from quadpips_drake.visualization.colors import LEG_COLORS
from quadpips_drake.visualization.overlay.story import Story
from quadpips_drake.visualization.replaying import rerun_values as values
from quadpips_drake.visualization.replaying.rerun_stream import TIMELINE, import_rerun, open_stream

POSE_PERIOD = 0.03
"""Between two poses of the robot and two values of the plots [s]."""
IMAGE_PERIOD = 0.2
"""Between two images of the camera, of superpixels and of regions [s]: the rate of the labels."""


class RerunWatcher:
    """Writes one file; it reads output ports and nothing else, so that no result changes."""

    def __init__(self, path: Path, trial):
        """Begins the file with what stays: raises UserInputError where it cannot be written."""
        self._rerun = import_rerun()
        self._stream = open_stream(path, f"{trial.title()}, seed {trial.config.seed}")
        self._due = {"pose": 0.0, "image": 0.0}
        self._reference: tuple = ()
        self._elements = len(trial.terrain.elements)
        self.problem = ""
        """Why it stopped looking; empty unless something broke."""
        values.log_robot(self._stream, trial.robot)
        values.log_terrain(self._stream, trial.terrain)
        values.log_label_names(self._stream)
        names, colors = [leg.name for leg in Leg], [values.rgb(LEG_COLORS[leg]) for leg in Leg]
        self._name_series("normal_forces", names, colors)
        self._name_series("height", ["base", "reference"])
        self._name_series("attitude", ["roll", "pitch"])
        self._name_series("velocity", ["x", "y", "z"])
        self._name_series("torques", list(trial.robot.joint_names))

    def look(self, trial) -> None:
        """Takes one sample of a SimulatedTrial. Whatever goes wrong here ends the looking, not the trial."""
        if self.problem:
            return
        try:
            self._look(trial.diagram, trial.context, trial)
        except BREAKDOWNS as error:
            self.problem = f"at t = {trial.context.get_time():.2f} s: {error}"

    def finish(self, story: Story) -> None:
        """Adds what happened, in words, and closes the file."""
        for name in ("phase", "gait", "text", "event"):
            for time, value in story.tracks.get(name, []):
                if value:
                    self._stream.set_time(TIMELINE, duration=time)
                    level = "WARN" if name == "event" else "INFO"
                    self._stream.log("events", self._rerun.TextLog(f"{name}: {value}", level=level))
        if self.problem:
            self._stream.log("events", self._rerun.TextLog(f"nothing more was written, {self.problem}", level="ERROR"))
        if story.verdict:
            self._stream.set_time(TIMELINE, duration=story.end)
            self._stream.log("events", self._rerun.TextLog(story.verdict, level="INFO"))
        self._stream.flush()
        self._stream.disconnect()

    def _name_series(self, plot: str, names: list[str], colors=None) -> None:
        self._stream.log(f"plots/{plot}", self._rerun.SeriesLines(names=names, colors=colors), static=True)

    def _is_due(self, what: str, period: float, time: float) -> bool:
        if time < self._due[what] - 1e-9:
            return False
        self._due[what] = time + period
        return True

    def _look(self, diagram, context, trial) -> None:
        state, reference = read(diagram, "true_robot_state", context), read(diagram, "reference", context)
        self._stream.set_time(TIMELINE, duration=state.stamp)
        if self._is_due("pose", POSE_PERIOD, state.stamp):
            values.log_pose(self._stream, trial.robot, state)
            self._plot(state, trial, diagram, context)
        key = reference.edition
        # A walk's reference is another one at each moment.
        if len(reference.times) and key != self._reference and diagram.HasOutputPort("status"):
            self._reference = key
            values.log_reference(self._stream, reference, trial.robot)
        if self._is_due("image", IMAGE_PERIOD, state.stamp):
            self._log_sight(diagram, context)
        terrain = trial.present_terrain
        if len(terrain.elements) != self._elements:
            self._elements = len(terrain.elements)
            values.log_terrain(self._stream, terrain, "world/terrain_and_what_appeared", static=False)

    def _log_sight(self, diagram, context) -> None:
        """What perception makes of the ground, as far as there is one."""
        source = getattr(diagram, "regions", None)
        if source is None:
            return
        inside = source.GetMyContextFromRoot(context)
        if source.HasOutputPort("affordance_image"):
            image = output_of(source, "affordance_image", AffordanceImage).Eval(inside)
            if image.depth.size and image.labels.shape == image.depth.shape:
                values.log_image(self._stream, image)
        if source.HasOutputPort("superpixels"):
            superpixels = output_of(source, "superpixels", SuperpixelImage).Eval(inside)
            if superpixels.assignment.size:
                values.log_superpixels(self._stream, superpixels)
        values.log_regions(self._stream, read(diagram, "region_set", context))

    def _plot(self, state, trial, diagram, context) -> None:
        wanted = trial.log.last("reference_p_WB")
        numbers = {
            "height": [state.p_WB[2], np.nan if wanted is None else wanted[2]],
            "attitude": state.rpy_WB[:2],
            "velocity": state.v_WB,
            "normal_forces": state.contact_forces[:, 2],
            "torques": state.joint_torques,
        }
        if diagram.HasOutputPort("status"):
            distance = read(diagram, "status", context).distance_to_goal
            numbers["goal"] = [distance] if np.isfinite(distance) else []
        for plot, row in numbers.items():
            if len(row):
                self._stream.log(f"plots/{plot}", self._rerun.Scalars(np.asarray(row, float)))
