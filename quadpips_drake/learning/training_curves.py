"""The course of a training as a picture."""

from pathlib import Path

from quadpips_drake.perception.steppability.exported_network import CLASSES

_COLORS = {"steppable": "#46aa50", "passable": "#d9b02c", "non_passable": "#d23c3c"}


def save_curves(history: list[dict], path: Path) -> None:
    """Draws loss and validation IoU per epoch (Trainer.history) as PNG; nothing while there is no epoch."""
    if not history:
        return
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 3.4), layout="constrained")
    FigureCanvasAgg(figure)
    loss, iou = figure.subplots(1, 2)
    epochs = [entry["epoch"] for entry in history]
    loss.plot(epochs, [entry["loss"] for entry in history], "k.-")
    loss.set(xlabel="epoch", ylabel="training loss", ylim=(0, None))
    for name in CLASSES:
        values = [entry["val"]["iou"][name] for entry in history]
        iou.plot(epochs, [float("nan") if v is None else v for v in values], ".-", color=_COLORS[name], label=name)
    iou.plot(epochs, [entry["val"]["mean_iou"] for entry in history], "k.-", label="mean")
    iou.set(xlabel="epoch", ylabel="IoU on the validation split", ylim=(0, 1))
    iou.legend(loc="lower right")
    for axes in (loss, iou):
        axes.grid(alpha=0.3)
    figure.savefig(path, dpi=100)
