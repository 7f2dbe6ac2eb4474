"""Experience on disk: what is written is what is read, and what is wrong is refused and never written over."""

import io
import json
import zipfile
from dataclasses import dataclass, replace

import numpy as np
import pytest

from quadpips_drake.errors import UserInputError
from quadpips_drake.planning.experience import experience_file
from quadpips_drake.planning.experience.experience_config import ExperienceConfig
from quadpips_drake.planning.experience.experience_file import configuration_hash, load_library, save_library
from quadpips_drake.planning.experience.learning import RECORD_FIELDS, learned
from quadpips_drake.values.swing_plan import ExperienceLibrary, SwingOutcome
from tests.planning.experience.transitions import tried

LIKE = ExperienceLibrary(scope="site", robot="anymal_c", configuration="abc", site="def")


def library(count=3) -> ExperienceLibrary:
    attempts = [tried(5.0 * k, by=(0.1 * k, 0.0, 0.0)) for k in range(count - 1)]
    return learned(LIKE, [*attempts, tried(outcome=SwingOutcome.FAILED)], ExperienceConfig())


def arrays_of(path) -> dict:
    with np.load(path) as archive:
        return {name: archive[name] for name in archive.files}


def write(path, arrays, header=None):
    """Writes an archive whose checksum is right, whatever is in it."""
    header = header or json.loads(arrays["header"].tobytes())
    header["checksum"] = experience_file._checksum(header, arrays)
    arrays = arrays | {"header": np.frombuffer(json.dumps(header).encode(), np.uint8)}
    np.savez(path, **arrays)


def test_what_is_written_is_read_again(tmp_path):
    path, content = tmp_path / "experience.npz", library()
    save_library(path, content)
    found = load_library(path, LIKE)
    assert found.trials == content.trials
    for name in RECORD_FIELDS:
        np.testing.assert_array_equal(getattr(found, name), getattr(content, name))
        assert getattr(found, name).dtype == getattr(content, name).dtype
    save_library(path, learned(found, [tried()], ExperienceConfig()))
    assert load_library(path, LIKE).trials == content.trials + 1
    assert [entry.name for entry in tmp_path.iterdir()] == ["experience.npz"]


def test_the_same_library_makes_the_same_file(tmp_path):
    for name in ("a", "b"):
        save_library(tmp_path / name, library())
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()


@pytest.mark.parametrize("key", ["scope", "robot", "configuration", "site"])
def test_what_was_made_for_something_else_is_refused(tmp_path, key):
    path = tmp_path / "experience.npz"
    save_library(path, library())
    with pytest.raises(UserInputError, match="made for another"):
        load_library(path, replace(LIKE, **{key: "go2"}))


def changed(arrays, name, value):
    return arrays | {name: value(arrays[name].copy())}


def first(value):
    def change(array):
        array[0] = value
        return array

    return change


SPOILED = {
    "not finite": lambda a: changed(a, "cost", first(np.nan)),
    "footholds that are more than": lambda a: changed(a, "before", first(1e9)),
    "holds a wrong status": lambda a: changed(a, "status", first(9)),
    "holds a wrong count": lambda a: changed(a, "count", first(0)),
    "holds a wrong cost": lambda a: changed(a, "cost", first(-1.0)),
    "holds a wrong last": lambda a: changed(a, "last", first(99)),
    "differ in length": lambda a: changed(a, "cost", lambda c: c[:-1]),
    "holds other arrays": lambda a: a | {"more": np.zeros(1)},
    "damaged": lambda a: changed(a, "cost", lambda c: c.astype(np.float32)),
    "or not a library": lambda a: changed(a, "legs", lambda c: np.array([{}] * len(c), dtype=object)),
}


@pytest.mark.parametrize("words", SPOILED)
def test_wrong_content_is_refused_and_stays(tmp_path, words):
    path = tmp_path / "experience.npz"
    save_library(path, library())
    write(path, SPOILED[words](arrays_of(path)))
    assert_refused(path, words)


def assert_refused(path, words):
    content = path.read_bytes()
    for action in (lambda: load_library(path, LIKE), lambda: save_library(path, library())):
        with pytest.raises(UserInputError, match=words) as caught:
            action()
        assert "\n" not in str(caught.value)
        assert path.read_bytes() == content


@pytest.mark.parametrize(
    ("change", "words"),
    [({"version": 2}, "of version 2"), ({"format": "other"}, "not a library"), ({"trials": "x"}, "no number")],
    ids=["version", "format", "trials"],
)
def test_a_wrong_header_is_refused(tmp_path, change, words):
    path = tmp_path / "experience.npz"
    save_library(path, library())
    arrays = arrays_of(path)
    write(path, arrays, json.loads(arrays["header"].tobytes()) | change)
    assert_refused(path, words)


def test_damage_is_found(tmp_path):
    path = tmp_path / "experience.npz"
    save_library(path, library())
    content = bytearray(path.read_bytes())
    for size in (0, 10, len(content) // 2, len(content) - 1):
        path.write_bytes(content[:size])
        assert_refused(path, "truncated or damaged")
    for at in range(0, len(content), 97):
        spoiled = bytearray(content)
        spoiled[at] ^= 0x10
        path.write_bytes(spoiled)
        try:
            found = load_library(path, LIKE)
        except UserInputError:
            continue
        # A byte of the archive that no content hangs on, a date for instance.
        np.testing.assert_array_equal(found.cost, library().cost)


def test_too_many_records_and_too_large_files_are_refused(tmp_path, monkeypatch):
    path = tmp_path / "experience.npz"
    save_library(path, library())
    monkeypatch.setattr(experience_file, "MAX_RECORDS", 2)
    assert_refused(path, "too large: 3 records")
    monkeypatch.setattr(experience_file, "MAX_BYTES", 100)
    assert_refused(path, "larger than")


def test_packed_archives_are_not_unpacked(tmp_path):
    path = tmp_path / "experience.npz"
    save_library(path, library())
    buffer = io.BytesIO()
    with zipfile.ZipFile(path) as old, zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as new:
        for name in old.namelist():
            new.writestr(name, old.read(name))
    path.write_bytes(buffer.getvalue())
    assert_refused(path, "it is packed")


def test_no_file_is_no_library(tmp_path):
    with pytest.raises(UserInputError, match="no such file"):
        load_library(tmp_path / "nothing.npz", LIKE)


def test_the_hash_is_of_what_costs_depend_on():
    @dataclass
    class Config:
        rate: float = 1.0
        latency: float = 0.0
        weight: float = 2.0

    assert configuration_hash(Config()) == configuration_hash(Config(rate=5.0, latency=0.1))
    assert configuration_hash(Config()) != configuration_hash(Config(weight=3.0))
    assert configuration_hash(Config(), scale=1.0) != configuration_hash(Config(), scale=2.0)
