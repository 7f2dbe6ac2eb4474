"""Making and reading a dataset."""

import errno
import json
import shutil

import numpy as np
import pytest

from quadpips_drake.errors import UserInputError
from quadpips_drake.learning import data_factory
from quadpips_drake.learning.data_factory import encode_depth, make_dataset, plan_shards
from quadpips_drake.learning.dataset import MANIFEST, decode_depth, load_split, read_manifest
from quadpips_drake.learning.dataset_config import DatasetConfig, split_of_scene
from tests.learning.small import DATASET, FRAMES


@pytest.fixture
def copy(dataset_directory, tmp_path):
    """A dataset that may be damaged."""
    shutil.copytree(dataset_directory, tmp_path / "copy")
    return tmp_path / "copy"


def test_splits_are_80_10_10_by_scene_and_share_no_scene(dataset_directory):
    scenes = [set(load_split(dataset_directory, split).scene) for split in ("train", "val", "test")]
    assert [len(s) for s in scenes] == [8, 1, 1]
    assert not scenes[0] & scenes[1] and not scenes[0] & scenes[2] and not scenes[1] & scenes[2]
    splits = [split_of_scene(scene) for scene in range(600)]
    assert [splits.count(split) for split in ("train", "val", "test")] == [480, 60, 60]


def test_frames_are_labelled_depth_images(train_frames):
    assert train_frames.depth.shape == train_frames.labels.shape == (8, 48, 64)
    clean = train_frames.clean_depth > 0
    np.testing.assert_array_equal(train_frames.labels > 0, clean)
    assert clean.mean() > 0.2
    depth = decode_depth(train_frames.clean_depth)
    assert np.nanmin(depth) >= 0.1 - 1e-3 and np.nanmax(depth) <= 3.0 + 1e-3
    np.testing.assert_allclose(np.linalg.norm(train_frames.down_C, axis=1), 1, atol=1e-5)
    assert (train_frames.down_C[:, 1] > 0.5).all()  # gravity points down in the image


def test_depth_survives_its_encoding():
    depth = np.array([[0.5, 2.99999, np.nan, np.inf, 0.0, -1.0]], np.float32)
    np.testing.assert_allclose(decode_depth(encode_depth(depth)), [[0.5, 3.0, np.nan, np.nan, np.nan, np.nan]], atol=1e-4)


def test_an_interrupted_dataset_is_completed_to_the_same_content(dataset_directory, copy):
    (copy / "train_0001.npz").unlink()
    (copy / ".train_0001.npz.17").write_bytes(b"half")
    progress = list(make_dataset(copy, FRAMES, 3, DATASET, workers=2, resume=True))
    assert progress == [(3, 4), (4, 4)]
    assert {path.name for path in copy.iterdir()} == {path.name for path in dataset_directory.iterdir()}
    with np.load(copy / "train_0001.npz") as made, np.load(dataset_directory / "train_0001.npz") as original:
        assert set(made.files) == set(original.files)
        for key in original.files:
            np.testing.assert_array_equal(made[key], original[key])


def test_a_shard_that_cannot_be_written_leaves_nothing_behind(tmp_path, monkeypatch):
    def full(file, **arrays):
        file.write(b"half")
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(data_factory, "render_scene", lambda *arguments: {"depth": np.zeros(1)})
    monkeypatch.setattr(data_factory, "_renderer", lambda config: None)
    monkeypatch.setattr(np, "savez_compressed", full)
    with pytest.raises(OSError, match="No space"):
        data_factory._make_shard(str(tmp_path), plan_shards(FRAMES, DATASET)[0], 3, DATASET)
    assert not list(tmp_path.iterdir())


def test_a_dataset_is_not_overwritten_nor_mixed_with_another(copy):
    with pytest.raises(UserInputError, match="--resume"):
        list(make_dataset(copy, FRAMES, 3, DATASET))
    with pytest.raises(UserInputError, match="other --frames, --seed"):
        list(make_dataset(copy, FRAMES, 4, DATASET, resume=True))
    (copy / MANIFEST).write_text("{")
    with pytest.raises(UserInputError, match="other --frames, --seed"):
        list(make_dataset(copy, FRAMES, 3, DATASET, resume=True))


def test_shards_of_unknown_origin_are_not_adopted(copy):
    (copy / MANIFEST).unlink()
    with pytest.raises(UserInputError, match="without a manifest"):
        list(make_dataset(copy, FRAMES, 3, DATASET, resume=True))


def test_too_few_frames_for_three_splits_are_refused():
    with pytest.raises(UserInputError, match="at least 50"):
        plan_shards(45, DatasetConfig())
    tasks = plan_shards(3000, DatasetConfig())
    assert sum(len(task.scenes) for task in tasks) == 600


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (lambda d: (d / MANIFEST).unlink(), "no manifest.json"),
        (lambda d: (d / MANIFEST).write_text("{]"), "not valid JSON"),
        (lambda d: (d / MANIFEST).write_text("[]"), "not a steppability dataset"),
        (lambda d: (d / MANIFEST).write_text('{"version": 1, "shards": []}'), "incomplete"),
        (lambda d: (d / "test_0000.npz").unlink(), "missing"),
        (lambda d: (d / "test_0000.npz").write_bytes(b"not a zip"), "damaged"),
        (lambda d: (d / "test_0000.npz").write_bytes((d / "test_0000.npz").read_bytes()[:500]), "damaged"),
        (lambda d: np.savez(d / "test_0000.npz", depth=np.zeros(3)), "damaged"),
    ],
)
def test_damaged_datasets_give_one_line(copy, damage, message):
    damage(copy)
    with pytest.raises(UserInputError, match=message) as error:
        load_split(copy, "test")
    assert "\n" not in str(error.value)


def test_a_shard_of_the_wrong_size_or_with_wrong_labels_is_damaged(copy):
    with np.load(copy / "test_0000.npz") as file:
        arrays = dict(file)
    for key, value in (("labels", arrays["labels"] + np.uint8(9)), ("depth", arrays["depth"][:, :-1])):
        np.savez(copy / "test_0000.npz", **(arrays | {key: value}))
        with pytest.raises(UserInputError, match="damaged"):
            load_split(copy, "test")


def test_the_manifest_says_how_to_make_it_again(dataset_directory):
    manifest = read_manifest(dataset_directory)
    assert manifest["seed"] == 3 and manifest["frames"] == FRAMES
    assert manifest["config"]["policy"] == {"swing_height_max": 0.15}
    json.dumps(manifest)
