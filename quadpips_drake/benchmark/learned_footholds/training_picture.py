"""How a training of footholds went, as a picture."""

from pathlib import Path


def save_training_picture(epochs: list[dict], held_out: dict, path: Path) -> None:
    """Draws distances to the search's footholds over epochs, and those on other walks, as PNG; see TrainedFootholds."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 3.4), layout="constrained")
    FigureCanvasAgg(figure)
    left, right = figure.subplots(1, 2)
    for name in ("train", "val"):
        left.plot([entry["epoch"] for entry in epochs], [100 * entry[name] for entry in epochs], label=name)
    left.set(xlabel="epoch", ylabel="mean distance to the search's foothold [cm]", ylim=(0, None))
    left.legend()
    left.grid(alpha=0.3)
    kinds = ("mean", "median", "p90")
    for place, (name, figures) in enumerate(held_out.items()):
        shift = 0.25 * (place - 1)
        right.bar([k + shift for k in range(len(kinds))], [100 * figures[kind] for kind in kinds], 0.25, label=name)
    right.set(xticks=range(len(kinds)), xticklabels=kinds, ylabel="distance on walks held out [cm]")
    right.legend()
    right.grid(alpha=0.3, axis="y")
    figure.savefig(path, dpi=100)
