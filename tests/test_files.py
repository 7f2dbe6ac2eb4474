"""Files that users give: whatever is in them, one line says what is wrong, soon and in little memory."""

import json
import os
import time
import tracemalloc

import pytest

from quadpips_drake.configuration.layers import read_layer
from quadpips_drake.errors import MAX_MESSAGE, UserInputError, shown
from quadpips_drake.files import MAX_DEPTH, read_json, read_text, write_json
from quadpips_drake.learning.dataset import read_manifest
from quadpips_drake.perception.steppability.model import load_model
from quadpips_drake.plain_yaml import parse_yaml, read_yaml
from quadpips_drake.terrain.library import load_terrain

ALIAS_BOMB = "a: &a [x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"{b}: &{b} [{', '.join([f'*{a}'] * 9)}]\n" for a, b in zip("abcdefgh", "bcdefghi", strict=True)
)
MERGE_BOMB = "a: &a {x: 1}\n" + "".join(
    f"{b}: &{b} {{<<: [{', '.join([f'*{a}'] * 9)}]}}\n" for a, b in zip("abcdefgh", "bcdefghi", strict=True)
)
HOSTILE_YAML = {
    "aliases that unfold": (ALIAS_BOMB, "line 1: not valid YAML: anchors and aliases"),
    "merge keys that unfold": (MERGE_BOMB, "line 1: not valid YAML: anchors and aliases"),
    "list that holds itself": ("a: &a [*a]", "anchors and aliases"),
    "bad tag of a truth value": ("a: !!bool abc", "tags (!)"),
    "bad tag of a time": ("a: !!timestamp x", "tags (!)"),
    "tag of an object": ("a: !!python/object/apply:os.system ['true']", "tags (!)"),
    "tag of a mapping": ("!!omap {a: 1}", "tags (!)"),
    "key that is a list": ("? [a, b]\n: c", "a key must be plain text"),
    "key that is a mapping": ("{? {a: 1} : c}", "a key must be plain text"),
    "key twice": ("a: 1\nb: {c: 1,\n  c: 2}", "line 3: not valid YAML: the key 'c' appears twice"),
    "deep list": ("[" * 1_000_000, f"nested more than {MAX_DEPTH} deep"),
    "deep block": ("- " * 1_000_000, f"nested more than {MAX_DEPTH} deep"),
    "deep mapping": ("{a: " * 1_000_000, f"nested more than {MAX_DEPTH} deep"),
    "5,000 digits": ("seed: " + "9" * 5000, "a number of too many digits"),
    "5,000 hexadecimal digits": ("seed: 0x" + "f" * 5000, "a number of too many digits"),
    "beyond 64 bits": ("seed: 100000000000000000000000", "a whole number beyond 64 bits"),
    "no digit": ("seed: 0b_", "not a number"),
    "control character": ("a: \x1b[31m", "control characters"),
    "two documents": ("a: 1\n---\nb: 2", "more than one document"),
    "very many values": ("[" + "1," * 400_000 + "]", "more than 300000 values"),
    "no end": ("a: [1", "not valid YAML"),
    "tabulator": ("a:\n\t- 1", "not valid YAML"),
}
HOSTILE_JSON = {
    "deep list": ("[" * 1_000_000, "nested more than"),
    "deep but closed": ("[" * 100 + "]" * 100, "nested more than"),
    "key twice": ('{"a": 1, "a": 2}', "the key 'a' appears twice"),
    "5,000 digits": ("[" + "9" * 5000 + "]", "a whole number beyond 64 bits"),
    "beyond 64 bits": ("[-9223372036854775809]", "a whole number beyond 64 bits"),
    "no end": ('{"a": 1,\n', "line 2: not valid JSON"),
    "empty": ("", "line 1: not valid JSON"),
    "very many values": ("[" + "1," * 400_000 + "1]", "more than 300000 values"),
}


def refusal(read, *arguments) -> str:
    """The message with which ``read`` refuses its arguments; it must be one line, and come soon."""
    started = time.process_time()
    with pytest.raises(UserInputError) as caught:
        read(*arguments)
    assert time.process_time() - started < 5.0
    message = str(caught.value)
    assert message.isprintable() and len(message) < 500
    return message


@pytest.mark.parametrize("name", HOSTILE_YAML)
def test_hostile_yaml_is_refused(name):
    text, said = HOSTILE_YAML[name]
    message = refusal(parse_yaml, text, "course.yaml")
    assert message.startswith("course.yaml: ") and said in message


@pytest.mark.parametrize("name", HOSTILE_JSON)
def test_hostile_json_is_refused(name, tmp_path):
    text, said = HOSTILE_JSON[name]
    (tmp_path / "data.json").write_text(text)
    assert said in refusal(read_json, tmp_path / "data.json")


def test_plain_yaml_is_read():
    text = "a: [1, 0x10, 1.5, 1e-3, .inf, true, no, null, ~, '1', \"x\\ty\", 2020-01-01, -9223372036854775808]\n1: {b: }\n"
    expected = [1, 16, 1.5, "1e-3", float("inf"), True, False, None, None, "1", "x\ty", "2020-01-01", -(2**63)]
    assert parse_yaml(text, "") == {"a": expected, "1": {"b": None}}
    assert parse_yaml("", "") is None
    assert parse_yaml("# nothing", "") is None
    assert parse_yaml("--- 7\n...\n", "") == 7
    assert parse_yaml("[" * MAX_DEPTH + "]" * MAX_DEPTH, "") is not None


def test_json_is_read_as_it_was_written(tmp_path):
    write_json(tmp_path / "a.json", {"x": [1, 2.5, float("nan")], "y": None})
    data = read_json(tmp_path / "a.json")
    assert json.dumps(data) == '{"x": [1, 2.5, NaN], "y": null}'


def test_what_is_no_text_file_is_refused(tmp_path):
    os.mkfifo(tmp_path / "pipe.yaml")
    (tmp_path / "folder.yaml").mkdir()
    (tmp_path / "loop.yaml").symlink_to(tmp_path / "loop.yaml")
    (tmp_path / "endless.yaml").symlink_to("/dev/zero")
    (tmp_path / "binary.yaml").write_bytes(bytes(range(1, 256)))
    (tmp_path / "nul.yaml").write_bytes(b"a: 1\0")
    with open(tmp_path / "large.yaml", "wb") as file:
        file.truncate(200_000_000)
    said = {
        "pipe.yaml": "not a regular file",
        "folder.yaml": "not a regular file",
        "endless.yaml": "not a regular file",
        "loop.yaml": "symbolic links",
        "binary.yaml": "not UTF-8 text",
        "nul.yaml": "NUL byte",
        "large.yaml": "larger than 5 MB",
        "absent.yaml": "no such file",
        "a" * 256: "name too long",
        "a\0b": "null byte",
    }
    tracemalloc.start()
    for name, why in said.items():
        for read in (read_text, read_yaml, read_json, read_layer):
            assert why in refusal(read, tmp_path / name)
    assert tracemalloc.get_traced_memory()[1] < 50e6
    tracemalloc.stop()


def test_every_reader_of_files_is_safe(tmp_path):
    """Scenario, terrain, manifest and model card: a pipe would block a careless one for ever."""
    for name in ("scenario.yaml", "course.yaml", "course.json", "manifest.json", "steppability.json"):
        os.mkfifo(tmp_path / name)
    assert "regular" in refusal(read_layer, tmp_path / "scenario.yaml")
    assert "regular" in refusal(load_terrain, str(tmp_path / "course.yaml"))
    assert "regular" in refusal(load_terrain, str(tmp_path / "course.json"))
    assert "regular" in refusal(read_manifest, tmp_path)
    assert "regular" in refusal(load_model, tmp_path)


def test_a_byte_order_mark_is_no_part_of_the_text(tmp_path):
    (tmp_path / "a.yaml").write_bytes(b"\xef\xbb\xbfa: 1")
    assert read_yaml(tmp_path / "a.yaml") == {"a": 1}


def test_messages_are_one_printable_line():
    assert str(UserInputError("a\x1b[31m\nb")) == r"a\x1b[31m\nb"
    assert len(str(UserInputError("x" * 100_000))) == MAX_MESSAGE
    assert shown(10**5000) == "a whole number beyond 64 bits"
    assert shown("x" * 100) == "'" + "x" * 57 + "...'"
