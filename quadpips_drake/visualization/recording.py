"""Recordings: one HTML file with everything in it, which opens offline in a browser and plays by itself."""

import logging
from html import escape
from pathlib import Path

from pydrake.geometry import Meshcat, MeshcatAnimation, MeshcatParams, MeshcatVisualizer, MeshcatVisualizerParams, SceneGraph
from pydrake.systems.framework import DiagramBuilder

from quadpips_drake.errors import UserInputError
from quadpips_drake.files import write_text
from quadpips_drake.visualization.meshcat_layers import ROOT
from quadpips_drake.visualization.overlay.legend import LEGEND
from quadpips_drake.visualization.overlay.page import with_overlay
from quadpips_drake.visualization.overlay.story import Story

FRAMES_PER_SECOND = 32.0


def make_quiet_meshcat(port: int | None = None, host: str = "localhost") -> Meshcat:
    """Returns a Meshcat that does not announce its address on the terminal.

    Args:
        port: to listen on; None: a free one.
        host: address to listen on; only this machine can reach the default, the whole network "*".

    Raises:
        UserInputError: nothing can listen there.
    """
    if not host:  # Meshcat would listen everywhere
        raise UserInputError("Meshcat needs an address to listen on, for example localhost; for all of them give '*'")
    logger = logging.getLogger("drake")
    level = logger.level
    logger.setLevel(logging.ERROR)
    try:
        return Meshcat(MeshcatParams(host=host, port=port, show_stats_plot=False))
    except RuntimeError as error:
        reason = str(error).splitlines()[0]
        raise UserInputError(f"Meshcat cannot listen on '{host}' ({reason}); give an address of this machine") from None
    finally:
        logger.setLevel(level)


def add_scene_visualizer(
    builder: DiagramBuilder, scene_graph: SceneGraph, meshcat: Meshcat, frames_per_second: float = FRAMES_PER_SECOND
) -> MeshcatVisualizer:
    """Adds what draws the illustration geometry of ``scene_graph``; returns it for ``start_recording``.

    A SceneGraph inside a subdiagram has its query port exported: then use MeshcatVisualizer.AddToBuilder with that port.
    """
    params = MeshcatVisualizerParams(publish_period=1.0 / frames_per_second)
    return MeshcatVisualizer.AddToBuilder(builder, scene_graph, meshcat, params)


def start_recording(meshcat: Meshcat, frames_per_second: float = FRAMES_PER_SECOND, *, live: bool = True):
    """Lets ``meshcat`` record transforms and properties from now on.

    Args:
        meshcat: where the diagram draws.
        frames_per_second: frames of simulated time; those of the visualiser.
        live: whether a browser is shown the drawing, too.
    """
    meshcat.DeleteRecording()
    meshcat.StartRecording(frames_per_second=frames_per_second, set_visualizations_while_recording=live)


def save_recording(meshcat: Meshcat, path: str | Path, story: Story | None = None, *, robot: str = "") -> int:
    """Ends the recording and writes it as one self-contained HTML file; returns its size [bytes].

    Args:
        meshcat: that records.
        path: of the file.
        story: what is written over it, over its time; default: legend and clock alone.
        robot: name of the robot that cameras follow.

    Raises:
        UserInputError: the file cannot be written.
    """
    meshcat.StopRecording()
    animation = meshcat.get_mutable_recording()
    animation.set_autoplay(True)
    animation.set_loop_mode(MeshcatAnimation.LoopMode.kLoopOnce)
    animation.set_clamp_when_finished(True)
    meshcat.PublishRecording()
    story = story or Story(title="quadpips")
    layers = [entry.layer for entry in LEGEND if meshcat.HasPath(f"{ROOT}/{entry.layer}")]
    base = f"/drake/visualizer/{robot}/base"
    html = meshcat.StaticHtml().replace("<title>Drake MeshCat</title>", f"<title>{escape(story.title)}</title>", 1)
    html = with_overlay(html, story, layers, base if robot and meshcat.HasPath(base) else "")
    try:
        write_text(path, html)
    except OSError as error:
        raise UserInputError(f"cannot write '{path}': {error.strerror or error}") from None
    return len(html)
