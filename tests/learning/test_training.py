"""Loss, scores, and short training runs."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from quadpips_drake.errors import UserInputError
from quadpips_drake.learning.dataset import join_frames, load_split
from quadpips_drake.learning.evaluation import REPORT, WORST_PICTURE, frame_errors, save_report, score
from quadpips_drake.learning.metrics import class_iou, class_recall, confusion_matrix, mean_iou
from quadpips_drake.learning.model_files import load_network
from quadpips_drake.learning.training import CHECKPOINT, Trainer, TrainingConfig, make_batch, segmentation_loss
from quadpips_drake.learning.training_curves import save_curves
from quadpips_drake.perception.steppability.features import CHANNELS
from quadpips_drake.perception.steppability.model import load_model
from tests.learning.small import TRAINING


@pytest.fixture(scope="module")
def frames(dataset_directory):
    return load_split(dataset_directory, "train"), load_split(dataset_directory, "val")


def weights_of(trainer):
    return torch.cat([p.detach().flatten() for p in trainer.network.parameters()])


def test_an_interrupted_training_ends_like_one_in_one_go(frames, tmp_path):
    whole = Trainer(*frames, tmp_path, TRAINING, device="cpu")
    losses = []
    whole.run(lambda step, loss: losses.append(loss))
    assert len(losses) == 2 * whole.steps_per_epoch and np.isfinite(losses).all()

    class StopError(Exception):
        pass

    def stop_in_second_epoch(step, loss):
        if step > whole.steps_per_epoch:
            raise StopError

    directory = tmp_path / "parts"
    directory.mkdir()
    with pytest.raises(StopError):
        Trainer(*frames, directory, TRAINING, device="cpu").run(stop_in_second_epoch)
    second = Trainer(*frames, directory, TRAINING, device="cpu")
    second.resume()
    assert len(second.history) == 1
    second.run()
    torch.testing.assert_close(weights_of(second), weights_of(whole), rtol=0, atol=0)
    assert second.history == whole.history
    assert load_model(directory).card["training"]["seed"] == TRAINING.seed


def test_steps_on_the_same_images_lower_the_loss(frames, tmp_path):
    config = TrainingConfig(epochs=20, batch=4, network=TRAINING.network)
    trainer = Trainer(*frames, tmp_path, config, device="cpu")
    batch = make_batch(frames[0], range(4), np.random.default_rng(0), 64)
    losses = [trainer._step(*batch) for _ in range(35)]
    assert np.mean(losses[-3:]) < 0.85 * losses[0]


def test_curves_are_drawn(tmp_path):
    scores = {"mean_iou": 0.5, "iou": {"steppable": 0.9, "passable": None, "non_passable": 0.4}}
    save_curves([], tmp_path / "curves.png")
    assert not (tmp_path / "curves.png").exists()
    save_curves([{"epoch": 1, "loss": 0.7, "val": scores}], tmp_path / "curves.png")
    assert (tmp_path / "curves.png").stat().st_size > 1000


def test_resume_refuses_what_does_not_fit(frames, tmp_path):
    trainer = Trainer(*frames, tmp_path, TRAINING, device="cpu")
    with pytest.raises(UserInputError, match="no checkpoint"):
        trainer.resume()
    trainer._save_checkpoint()
    other = TrainingConfig(epochs=3, batch=4, crop_width=48, network=TRAINING.network)
    with pytest.raises(UserInputError, match="other settings"):
        Trainer(*frames, tmp_path, other, device="cpu").resume()
    (tmp_path / CHECKPOINT).write_bytes(b"nonsense")
    with pytest.raises(UserInputError, match="damaged"):
        trainer.resume()


def test_a_training_can_begin_with_another_ones_weights(frames, tmp_path):
    first = Trainer(*frames, tmp_path, TRAINING, device="cpu")
    first.run()
    network, card = load_network(tmp_path)
    second = Trainer(*frames, tmp_path, replace(TRAINING, seed=7), device="cpu")
    assert not torch.equal(weights_of(second), weights_of(first))
    second.start_from(network, card)
    kept = torch.cat([p.detach().flatten() for p in network.parameters()])
    assert torch.equal(weights_of(second), kept)
    second.run()
    assert not torch.equal(weights_of(second), kept)
    assert "data seeds [3]" in load_model(tmp_path).card["training"]["init"]
    with pytest.raises(UserInputError, match="--init"):
        Trainer(*frames, tmp_path, TrainingConfig(), device="cpu").start_from(network, card)


def test_several_datasets_train_one_network(frames, tmp_path):
    other = replace(frames[0], seeds=(4,), depth=frames[0].depth[:2], scene=frames[0].scene[:2], kind=frames[0].kind[:2])
    other = replace(other, clean_depth=other.depth, labels=frames[0].labels[:2], down_C=frames[0].down_C[:2])
    both = join_frames([frames[0], other])
    assert len(both) == len(frames[0]) + 2 and both.seeds == (3, 4)
    np.testing.assert_array_equal(both.labels[-2:], other.labels)
    trainer = Trainer(both, frames[1], tmp_path, TRAINING, device="cpu")
    card = trainer._card({})
    assert card["data"] == {"seeds": [3, 4], "train_frames": len(both), "val_seeds": [3], "val_frames": len(frames[1])}
    with pytest.raises(UserInputError, match="each seed once"):
        join_frames([frames[0], frames[0]])
    with pytest.raises(UserInputError, match="cameras"):
        join_frames([frames[0], replace(other, scene_kinds=("floor",))])


def test_batches_are_crops_without_what_was_not_measured(train_frames):
    features, classes = make_batch(train_frames, [0, 1, 2], np.random.default_rng(0), 32)
    assert features.shape == (3, len(CHANNELS), 48, 32) and classes.shape == (3, 48, 32)
    np.testing.assert_array_equal(classes >= 0, features[:, 5] > 0)
    assert classes.max() <= 2


def test_the_loss_ignores_what_does_not_count_and_falls_with_certainty():
    classes = torch.tensor([[[0, 1, 2, -1]]])
    right = torch.zeros(1, 3, 1, 4)
    for k in range(3):
        right[0, k, 0, k] = 5.0
    other = right.clone()
    other[0, :, 0, 3] = torch.tensor([9.0, -9.0, 3.0])
    weights = [1.0, 1.0, 1.0]
    assert segmentation_loss(right, classes, weights, 0.5) == segmentation_loss(other, classes, weights, 0.5)
    assert segmentation_loss(right, classes, weights, 0.5) < segmentation_loss(0 * right, classes, weights, 0.5)
    assert segmentation_loss(right, torch.full_like(classes, -1), weights, 0.5) == 0.0


def test_scores():
    truth, predicted = np.array([1, 1, 2, 3, 0, 3]), np.array([1, 2, 2, 3, 3, 1])
    confusion = confusion_matrix(truth, predicted)
    np.testing.assert_array_equal(confusion, [[1, 1, 0], [0, 1, 0], [1, 0, 1]])
    np.testing.assert_allclose(class_iou(confusion), [1 / 3, 1 / 2, 1 / 2])
    np.testing.assert_allclose(class_recall(confusion), [1 / 2, 1, 1 / 2])
    assert mean_iou(confusion) == pytest.approx(4 / 9)
    only_floor = confusion_matrix(np.ones(4, int), np.ones(4, int))
    assert mean_iou(only_floor) == 1.0 and np.isnan(class_recall(only_floor)[2])


def test_the_report_of_an_evaluation(dataset_directory, frames, tmp_path):
    Trainer(*frames, tmp_path, TrainingConfig(epochs=1, batch=4, network=TRAINING.network), device="cpu").run()
    model, test = load_model(tmp_path), load_split(dataset_directory, "test")
    scores = score(model, test)
    assert np.array(scores["confusion"]).sum() == (test.depth > 0).sum()
    assert frame_errors(scores["per_frame"]).shape == (len(test),)
    save_report(scores, model, test, tmp_path)
    assert (tmp_path / REPORT).is_file() and (tmp_path / WORST_PICTURE).is_file()


def test_bad_settings_are_refused():
    with pytest.raises(UserInputError, match="epochs"):
        TrainingConfig(epochs=0)
    with pytest.raises(UserInputError, match="class_weights"):
        TrainingConfig(class_weights=[1.0])
