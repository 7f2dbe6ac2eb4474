"""A film of a trial, from the files that it has left; rendered off screen by Drake's own renderer (VTK over EGL)."""

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from pydrake.geometry import ClippingRange, ColorRenderCamera, MakeRenderEngineVtk, RenderCameraCore
from pydrake.math import RigidTransform
from pydrake.systems.sensors import CameraInfo

from quadpips_drake.configuration.schema import configuration, ranged
from quadpips_drake.errors import UserInputError
from quadpips_drake.interruption import check as check_interruption
from quadpips_drake.trials.telling.film_drawings import PUSH_LAYERS, RUN_LAYERS, WALK_LAYERS, FilmDrawings
from quadpips_drake.trials.telling.replay import Replay, TrialFiles
from quadpips_drake.trials.telling.replayed_sight import ReplayedSight
from quadpips_drake.visualization.film.encoding import check_film_name, save_film
from quadpips_drake.visualization.film.scene_meshes import SceneMeshes
from quadpips_drake.visualization.film.words import FilmWords
from quadpips_drake.visualization.snapshot import ChaseView, engine_parameters

_RENDERER = "film"
_FOV_Y = 0.75
"""Of the camera [rad]."""
_LAST_PICTURE = 1.5
"""For so long the last picture stays, with the verdict [s]."""
_STEADY = 0.8
"""The camera follows a mean over this time before and after, so that it does not shake with each step [s]."""
_MAX_GIF_PICTURES = 500
"""Longer GIFs have fewer pictures a second."""


@configuration
class FilmConfig:
    """How a film looks. What is 0 depends on the kind of file."""

    width: int = ranged(0, 0, 3840)
    """Of the pictures [pixels]; default: 960 of an MP4, 640 of a GIF."""
    height: int = ranged(0, 0, 2160)
    """Of the pictures [pixels]; default: 9/16 of the width."""
    fps: float = ranged(0.0, 0.0, 120.0)
    """Pictures per second of the film [Hz]; default: 25 of an MP4, 10 of a GIF."""
    speed: float = ranged(1.0, 0.01, 100.0)
    """Simulated seconds in a second of the film [1]."""
    begin: float = ranged(0.0, 0.0, 1e6)
    """Where in the trial it begins [s]."""
    end: float = ranged(0.0, 0.0, 1e6)
    """Where it ends [s]; 0: with the trial."""
    inset: bool = True
    """Whether the robot's depth image is shown, with its labels."""

    def for_file(self, path: Path) -> "FilmConfig":
        """With the defaults of the kind of file."""
        is_gif = path.suffix.lower() == ".gif"
        width = (self.width or (640 if is_gif else 960)) // 2 * 2  # H.264 wants even numbers
        height = max((self.height or width * 9 // 16) // 2 * 2, 2)
        if min(width, height) < 120:
            raise UserInputError(f"a film must be at least 120 x 120 pixels, not {width} x {height}")
        fps = self.fps or (10.0 if is_gif else 25.0)
        return FilmConfig(width, height, fps, self.speed, self.begin, self.end, self.inset)


def make_film(
    directory: Path,
    path: Path,
    config: FilmConfig | None = None,
    progress: Callable[[float, float], None] = lambda time, end: None,
) -> int:
    """Makes a film, MP4 or GIF by the name of ``path``, of the trial in ``directory``; returns its size [bytes].

    Args:
        directory: with the files of a run or a walk.
        path: of the film.
        config: how it looks.
        progress: called with the time in the trial that is being rendered, and the last one [s].

    Raises:
        UserInputError: there is no trial, it cannot be rendered here, or the film cannot be written.
    """
    path = Path(path)
    files = TrialFiles(directory)
    check_film_name(path)
    config = (config or FilmConfig()).for_file(path)
    return save_film(path, _pictures(files, config, path.suffix.lower() == ".gif", progress), _rate(files, config, path))


def _rate(files: TrialFiles, config: FilmConfig, path: Path) -> float:
    """Pictures per second; fewer of a long GIF."""
    if path.suffix.lower() != ".gif":
        return config.fps
    begin, end = _span(files, config)
    return min(config.fps, max(1.0, _MAX_GIF_PICTURES * config.speed / (end - begin)))


def _span(files: TrialFiles, config: FilmConfig) -> tuple[float, float]:
    end = min(config.end or files.end, files.end)
    if config.begin >= end and not config.begin == end == 0.0:
        raise UserInputError(
            f"the film would begin at {config.begin:g} s, but the trial is over at {end:g} s; begin earlier"
        )
    return config.begin, max(end, config.begin + 1e-3)


def _pictures(files: TrialFiles, config: FilmConfig, is_gif: bool, progress) -> Iterator[np.ndarray]:
    """Yields the pictures of the film, uint8 (height, width, 3)."""
    rate = _rate(files, config, Path("film.gif" if is_gif else "film.mp4"))
    begin, end = _span(files, config)
    camera = FilmCamera(files, config)
    picture = None
    for time in np.append(np.arange(begin, end, config.speed / rate), end):
        check_interruption()
        progress(float(time), end)
        picture = camera.picture(float(time))
        yield picture
    for _ in range(round(_LAST_PICTURE * rate)):
        yield picture


class FilmCamera:
    """Renders one moment of a trial after the other, forward in time."""

    def __init__(self, files: TrialFiles, config: FilmConfig):
        """Args: the trial; how the film looks (with all sizes set)."""
        self._files = files
        self._replay = Replay(files)
        station = self._replay.station
        station.scene_graph.AddRenderer(_RENDERER, MakeRenderEngineVtk(engine_parameters()))
        meshes = SceneMeshes(station.scene_graph)
        self._context = station.CreateDefaultContext()
        station.bring_ground_near(self._context)
        self._drawings = FilmDrawings(self._replay, meshes)
        self._drawings.draw_ground(self._context)
        sees = config.inset and not files.is_walk and config_has_perception(files.config)
        self._sight = ReplayedSight(self._replay) if sees else None
        layers = WALK_LAYERS if files.is_walk else RUN_LAYERS if sees else RUN_LAYERS[1:]
        layers += PUSH_LAYERS if files.config.pushes else ()
        self._words = FilmWords(config.width, config.height, layers if not sees else ("labels", *layers))
        info = CameraInfo(config.width, config.height, _FOV_Y)
        self._camera = ColorRenderCamera(RenderCameraCore(_RENDERER, info, ClippingRange(0.05, 100.0), RigidTransform()))
        size = self._replay.robot.nominal_base_height / 0.5  # of the robot, against one as large as ANYmal
        self._view = ChaseView(distance=max(3.4 * size, 1.6), azimuth=1.0, elevation=0.42)

    def picture(self, time: float) -> np.ndarray:
        """The picture at ``time`` [s], uint8 (height, width, 3)."""
        station, context = self._replay.station, self._context
        state, inset, regions = self._replay.go_to(context, time), None, None
        if self._sight is not None:
            image, regions = self._sight.look(context, state)
            inset = self._sight.picture(image) if image.depth.size else None
        self._drawings.draw(context, time, regions)
        query = station.GetOutputPort("query_object").Eval(context)
        X_WC = self._view.X_WC(*self._aim(time))
        image = query.RenderColorImage(self._camera, station.scene_graph.world_frame_id(), X_WC)
        return self._words.write(np.array(image.data[:, :, :3]), self._files.story, time, inset)

    def _aim(self, time: float) -> tuple[np.ndarray, float]:
        """Position (3,) [m] and yaw [rad] that the camera follows: means around ``time``."""
        log = self._files.log
        around = slice(self._files.index(time - _STEADY), self._files.index(time + _STEADY) + 1)
        yaw = np.unwrap(log["rpy_WB"][around, 2]).mean()
        return log["p_WB"][around].mean(axis=0), float(yaw)


def config_has_perception(config) -> bool:
    """Whether the robot of a run looks at the ground by its camera."""
    return getattr(config.stages, "region_source", "") == "superpixels"
