"""How a training went, as a picture: how much data the models need, and how the network learned."""

from pathlib import Path

from quadpips_drake.baselines.motion_models.models import MODEL_NAMES
from quadpips_drake.baselines.motion_models.scores import UNITS


def save_training_picture(curve: list[dict], epochs: list[dict], path: Path) -> None:
    """Draws error over number of steps, and the network's losses over epochs, as PNG; arguments as of TrainedModels."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 3.4), layout="constrained")
    FigureCanvasAgg(figure)
    left, right = figure.subplots(1, 2)
    steps = [point["steps"] for point in curve]
    for name in MODEL_NAMES:
        left.plot(steps, [point[name] for point in curve], ".-", label=f"{name.upper()} [{UNITS[name]}]")
    left.set(xlabel="steps that were fitted to", ylabel="RMSE along x on other walks", ylim=(0, None))
    for name in ("train", "val"):
        right.semilogy([entry["epoch"] for entry in epochs], [entry[name] for entry in epochs], label=name)
    right.set(xlabel="epoch of the small network", ylabel="mean squared error of scaled outputs")
    for axes in (left, right):
        axes.legend()
        axes.grid(alpha=0.3)
    figure.savefig(path, dpi=100)
