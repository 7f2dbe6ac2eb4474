"""Training of the steppability network (QuadPiPS section V-B.7)."""

import dataclasses
import pickle
import zipfile
from collections.abc import Callable, Iterator
from dataclasses import field
from pathlib import Path

import numpy as np
import torch
from torch.nn import functional
from torch.optim.swa_utils import AveragedModel

from quadpips_drake.configuration.schema import MAX_SEED, configuration, ranged
from quadpips_drake.errors import UserInputError
from quadpips_drake.files import write_json
from quadpips_drake.learning.dataset import Frames, decode_depth
from quadpips_drake.learning.evaluation import evaluate_frames
from quadpips_drake.learning.metrics import summary
from quadpips_drake.learning.model_files import as_runnable, save_model
from quadpips_drake.learning.network import NetworkConfig, SteppabilityNetwork
from quadpips_drake.perception.steppability.features import make_features
from quadpips_drake.perception.steppability.model import SteppabilityModel

CHECKPOINT, HISTORY = "checkpoint.pt", "history.json"
CALIBRATION_FRAMES = 100
"""Training images from which the ranges of quantised activations are taken."""
_IGNORED = -1


@configuration
class TrainingConfig:
    """How the network is trained."""

    epochs: int = ranged(5, 1, 10_000)
    """Rounds over the training split."""
    batch: int = ranged(8, 1, 1024)
    """Images per step."""
    learning_rate: float = ranged(4e-3, 1e-9, 1.0)
    """Peak of the one-cycle schedule."""
    weight_decay: float = ranged(1e-4, 0.0, 1.0)
    """Of AdamW, per step and learning rate."""
    crop_width: int = ranged(192, 16, 4096)
    """Columns, cut out at random, that a training image keeps [pixels]; its full height stays."""
    class_weights: list[float] = ranged([1.0, 2.0, 1.3], 1e-6, 1e6)
    """Of steppable, passable, non-passable in the cross entropy."""
    dice_weight: float = ranged(1.0, 0.0, 1e6)
    """Weight of the soft Dice loss against the cross entropy's 1."""
    averaging: float = ranged(0.995, 0.0, 0.999999)
    """Decay per step of the moving average of the weights that is kept as the result."""
    seed: int = ranged(1, 0, MAX_SEED)
    """Of initial weights, order, crops and flips."""
    network: NetworkConfig = field(default_factory=NetworkConfig)


class Trainer:
    """One training run: network, optimiser, and where in the schedule it stands."""

    def __init__(self, train: Frames, val: Frames, out: Path, config: TrainingConfig, device: str | None = None):
        """``out``: directory for checkpoints and the model. ``device``: of torch; by default a GPU where there is one."""
        self._train, self._val, self._out, self._config = train, val, Path(out), config
        self.device = device or ("cuda" if torch.cuda.is_available() else "cpu")
        torch.manual_seed(config.seed)
        network = SteppabilityNetwork(config.network)
        self.network = network.to(self.device, memory_format=torch.channels_last)

        def move_average(average, current, count):
            # At the start the average forgets faster, or it would keep the random initial weights for long.
            decay = min(config.averaging, (1.0 + float(count)) / (10.0 + float(count)))
            return average + (1 - decay) * (current - average)

        self.average = AveragedModel(self.network, avg_fn=move_average, use_buffers=True)
        self._optimizer = torch.optim.AdamW(
            self.network.parameters(), lr=config.learning_rate, weight_decay=config.weight_decay
        )
        self.epochs = config.epochs
        self.steps_per_epoch = max(len(train) // config.batch, 1)
        # The schedule divides by the steps of its rise, less one: even the shortest training gets more than one.
        total = max(config.epochs * self.steps_per_epoch, 4)
        self._schedule = torch.optim.lr_scheduler.OneCycleLR(
            self._optimizer, config.learning_rate, total_steps=total, pct_start=max(0.2, 1.5 / total)
        )
        self._init: str | None = None
        self.history: list[dict] = []
        """One entry per epoch: training loss, scores on the validation split."""

    def start_from(self, network: SteppabilityNetwork, card: dict) -> None:
        """Begins with the weights of ``network``, made by these commands, instead of random ones; before ``run``.

        Raises:
            UserInputError: its network has another size.
        """
        if _plain(dataclasses.asdict(network.config)) != _plain(dataclasses.asdict(self._config.network)):
            raise UserInputError("--init: that model's network has another size than the one to train")
        self.network.load_state_dict(network.state_dict())
        self.average.module.load_state_dict(network.state_dict())
        data = card.get("data")
        self._init = f"a model trained on data seeds {data.get('seeds', 'unknown') if isinstance(data, dict) else 'unknown'}"

    def resume(self) -> None:
        """Goes on from the checkpoint in ``out``.

        Raises:
            UserInputError: there is none, it is damaged, or it belongs to other settings or data.
        """
        path = self._out / CHECKPOINT
        try:
            state = torch.load(path, weights_only=True, map_location=self.device)
            same = state["identity"] == self._identity()
            if same:
                self.network.load_state_dict(state["network"])
                self.average.load_state_dict(state["average"])
                self._optimizer.load_state_dict(state["optimizer"])
                self._schedule.load_state_dict(state["schedule"])
                self.history = list(state["history"])
        except FileNotFoundError:
            raise UserInputError(f"--resume: no {CHECKPOINT} in {self._out}; train without --resume first") from None
        except (OSError, ValueError, KeyError, TypeError, RuntimeError, EOFError) as error:
            raise UserInputError(f"--resume: {path} is damaged ({type(error).__name__}); train anew") from None
        except (pickle.UnpicklingError, zipfile.BadZipFile):
            raise UserInputError(f"--resume: {path} is damaged; train anew") from None
        if not same:
            raise UserInputError(f"--resume: {path} belongs to other settings or other data; train anew")

    def run(self, on_step: Callable[[int, float], None] = lambda step, loss: None) -> None:
        """Trains to the end of the schedule; after each epoch validates, writes a checkpoint, and the model if it is best.

        ``on_step``: called after each step with the number of steps done and the loss.
        """
        for epoch in range(len(self.history), self._config.epochs):
            loss = self._run_epoch(epoch, on_step)
            confusions = evaluate_frames(SteppabilityModel(as_runnable(self.average.module)), self._val)
            scores = summary(confusions.sum(axis=0))
            self.history.append({"epoch": epoch + 1, "loss": round(loss, 5), "val": scores})
            if scores["mean_iou"] >= max(entry["val"]["mean_iou"] for entry in self.history):
                save_model(self._out, self.average.module, self._card(scores), calibration_images(self._train))
            self._save_checkpoint()

    def _run_epoch(self, epoch: int, on_step) -> float:
        """Returns the mean loss."""
        rng = np.random.default_rng([self._config.seed, epoch])
        order = rng.permutation(len(self._train))
        self.network.train()
        total = 0.0
        for step in range(self.steps_per_epoch):
            chosen = order[step * self._config.batch : (step + 1) * self._config.batch]
            features, labels = make_batch(self._train, chosen, rng, self._config.crop_width)
            loss = self._step(features, labels)
            total += loss
            on_step(epoch * self.steps_per_epoch + step + 1, loss)
        return total / self.steps_per_epoch

    def _step(self, features: np.ndarray, labels: np.ndarray) -> float:
        x = torch.from_numpy(features).to(self.device, memory_format=torch.channels_last)
        y = torch.from_numpy(labels).to(self.device)
        with torch.autocast(self.device, dtype=torch.bfloat16, enabled=self._has_bfloat16()):
            logits = self.network(x)
        loss = segmentation_loss(logits.float(), y, self._config.class_weights, self._config.dice_weight)
        self._optimizer.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(self.network.parameters(), 5.0)
        self._optimizer.step()
        self._schedule.step()
        self.average.update_parameters(self.network)
        return float(loss.detach())

    def _has_bfloat16(self) -> bool:
        """Whether bfloat16 is computed by hardware; elsewhere it would be slower than float32."""
        if self.device != "cpu":
            return torch.cuda.is_bf16_supported()
        return bool(torch.cpu.get_capabilities().get("avx512_bf16"))

    def _identity(self) -> dict:
        """What a checkpoint must agree on, as plain values."""
        frames = {"frames": len(self._train), "data_seeds": self._train.seeds, "init": self._init}
        return _plain(dataclasses.asdict(self._config) | frames)

    def _card(self, scores: dict) -> dict:
        intrinsics = self._train.intrinsics
        return {
            "data": {
                "seeds": list(self._train.seeds),
                "train_frames": len(self._train),
                "val_seeds": list(self._val.seeds),
                "val_frames": len(self._val),
            },
            "image": {"width": intrinsics.width, "height": intrinsics.height},
            "training": _plain(dataclasses.asdict(self._config) | {"epochs_done": len(self.history), "init": self._init}),
            "val": scores,
        }

    def _save_checkpoint(self) -> None:
        state = {
            "identity": self._identity(),
            "network": self.network.state_dict(),
            "average": self.average.state_dict(),
            "optimizer": self._optimizer.state_dict(),
            "schedule": self._schedule.state_dict(),
            "history": self.history,
        }
        unfinished = self._out / f".{CHECKPOINT}.new"
        torch.save(state, unfinished)
        unfinished.replace(self._out / CHECKPOINT)
        write_json(self._out / HISTORY, {"epochs": self.history})


def calibration_images(frames: Frames) -> Iterator[np.ndarray]:
    """Yields the features of CALIBRATION_FRAMES of ``frames``, evenly spaced."""
    for index in np.unique(np.linspace(0, len(frames) - 1, CALIBRATION_FRAMES).round().astype(int)):
        yield make_features(decode_depth(frames.depth[index]), frames.down_C[index], frames.intrinsics)


def make_batch(frames: Frames, chosen, rng: np.random.Generator, crop_width: int) -> tuple[np.ndarray, np.ndarray]:
    """Returns features (n, channels, height, crop) and classes (n, height, crop), int64, of the frames ``chosen``.

    Cropped and mirrored at random. Pixels without truth or without measurement have class -1 and teach nothing.
    """
    width = frames.intrinsics.width
    crop = min(crop_width, width)
    features, classes = [], []
    for index in chosen:
        depth = decode_depth(frames.depth[index])
        image = make_features(depth, frames.down_C[index], frames.intrinsics)
        target = np.where(np.isfinite(depth), frames.labels[index].astype(np.int64) - 1, _IGNORED)
        left = rng.integers(0, width - crop + 1)
        image, target = image[:, :, left : left + crop], target[:, left : left + crop]
        if rng.random() < 0.5:
            image, target = image[:, :, ::-1].copy(), target[:, ::-1]
            image[3] *= -1  # normal_right
        features.append(image)
        classes.append(target)
    return np.ascontiguousarray(np.stack(features)), np.ascontiguousarray(np.stack(classes))


def segmentation_loss(logits: torch.Tensor, classes: torch.Tensor, weights: list[float], dice_weight: float) -> torch.Tensor:
    """Returns weighted cross entropy plus ``dice_weight`` times the soft Dice loss, over pixels whose class is not -1."""
    weight = torch.tensor(weights, device=logits.device)
    counted = classes != _IGNORED
    if not counted.any():
        return logits.sum() * 0.0
    log_probability = functional.log_softmax(logits, dim=1)
    entropy = functional.nll_loss(log_probability, classes, weight, ignore_index=_IGNORED)
    truth = classes[:, None] == torch.arange(logits.shape[1], device=logits.device)[None, :, None, None]
    probability = log_probability.exp() * counted[:, None]
    overlap = (probability * truth).sum((0, 2, 3))
    total = probability.sum((0, 2, 3)) + truth.sum((0, 2, 3))
    return entropy + dice_weight * (1 - (2 * overlap + 1.0) / (total + 1.0)).mean()


def _plain(value):
    """``value`` with tuples as lists, as JSON and a checkpoint hold it."""
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    return [_plain(item) for item in value] if isinstance(value, list | tuple) else value
