"""A file of Rerun (.rrd): what it needs, how it is opened, how its windows are laid out."""

from pathlib import Path

from quadpips_drake.errors import UserInputError

SUFFIX = ".rrd"
TIMELINE = "time"
"""Simulated time [s]."""


def import_rerun():
    """The package rerun; raises UserInputError where it is not installed."""
    try:
        import rerun
    except ImportError:
        raise UserInputError(
            "--rerun needs the package rerun-sdk, which is not installed: pip install -c constraints.txt -e '.[rerun]'"
        ) from None
    return rerun


def check_rerun_name(path: Path, results: Path | None = None) -> None:
    """Raises UserInputError unless ``path`` can be written; the directory ``results`` will be there by then."""
    if path.suffix.lower() != SUFFIX:
        raise UserInputError(f"--rerun {path}: its name must end in {SUFFIX}")
    if path.is_dir():
        raise UserInputError(f"--rerun {path}: this is a directory; give the name of a file")
    if not path.parent.is_dir() and (results is None or path.parent.resolve() != results.resolve()):
        raise UserInputError(f"--rerun {path}: there is no directory {path.parent}; make it first")
    import_rerun()


def open_stream(path: Path, recording_id: str):
    """A RecordingStream into the file ``path``, with the windows laid out; raises UserInputError."""
    rerun = import_rerun()
    stream = rerun.RecordingStream("quadpips", recording_id=recording_id)
    try:
        stream.save(str(path), default_blueprint=_layout(rerun.blueprint))
    except (OSError, RuntimeError) as error:
        raise UserInputError(f"cannot write '{path}': {str(error).splitlines()[0]}") from None
    return stream


def _layout(blueprint):
    """The scene large, beside it what the camera sees, below the plots."""
    images = blueprint.Vertical(
        blueprint.Spatial2DView(origin="world/camera/depth", name="depth"),
        blueprint.Spatial2DView(origin="world/camera/labels", name="labels"),
        blueprint.Spatial2DView(origin="superpixels", name="superpixels, seen from above"),
    )
    plots = blueprint.Horizontal(
        *(blueprint.TimeSeriesView(origin=f"plots/{name}", name=title) for name, title in PLOTS.items()),
        blueprint.TextLogView(origin="events", name="events"),
    )
    scene = blueprint.Horizontal(blueprint.Spatial3DView(origin="world", name="scene"), images, column_shares=[3, 1])
    return blueprint.Blueprint(blueprint.Vertical(scene, plots, row_shares=[3, 1]), collapse_panels=True)


PLOTS = {
    "height": "height of the base and of its reference [m]",
    "attitude": "roll, pitch [rad]",
    "velocity": "velocity of the base in W [m/s]",
    "normal_forces": "vertical forces on the feet [N]",
    "torques": "torques [N m]",
    "goal": "distance to the goal [m]",
}
"""{name below plots/: title}."""
