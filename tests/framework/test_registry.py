"""Entries by name: added in one call or brought by an installed package, broken ones included."""

from dataclasses import dataclass
from importlib import metadata

import pytest

from quadpips_drake.errors import UserInputError
from quadpips_drake.framework.registry import Entry, Registry

GROUP = "quadpips_drake.pets"
NOT_CALLABLE = 3


@dataclass
class CatConfig:
    """Settings of a cat."""

    lives: int = 9


def make_cat(lives=9):
    return f"a cat of {lives} lives"


ENTRY = Entry(make_cat, CatConfig, "purrs")


@pytest.fixture
def pets():
    return Registry("pet", GROUP)


@pytest.fixture
def installed(monkeypatch):
    """A list of (name, place) that installed packages seem to have in this group."""
    points = []

    def entry_points(*, group):
        assert group == GROUP
        return metadata.EntryPoints(metadata.EntryPoint(name, place, group) for name, place in points)

    monkeypatch.setattr(metadata, "entry_points", entry_points)
    return points


def test_an_entry_is_added_in_one_call(pets):
    added = pets.add("cat", make_cat, CatConfig, summary="purrs")
    assert pets.get("cat") is added
    assert added == Entry(make_cat, CatConfig, "purrs", section="cat", name="cat")
    assert added.factory(added.config().lives) == "a cat of 9 lives"
    assert pets.add("hydra-2_b", make_cat) == Entry(make_cat, None, "", section="hydra_2_b", name="hydra-2_b")
    assert pets.names() == ["cat", "hydra-2_b"] and "cat" in pets and "dog" not in pets


def test_a_second_entry_of_a_name_replaces_the_first(pets):
    pets.add("cat", make_cat)
    pets.add("cat", str)
    assert pets.get("cat").factory is str and pets.names() == ["cat"]
    pets.remove("cat")
    pets.remove("cat")
    assert pets.names() == []


def test_an_unknown_name_is_answered_with_the_known_ones(pets, installed):
    pets.add("cat", make_cat)
    installed.append(("ant", "tests.framework.test_registry:ENTRY"))
    with pytest.raises(UserInputError) as error:
        pets.get("dog")
    assert str(error.value) == "unknown pet 'dog'; known: ant, cat"


@pytest.mark.parametrize("name", ["", "a cat", "3d", "a,b", "cat=1", "../cat", None, 7])
def test_names_must_do_on_the_command_line(pets, name):
    with pytest.raises(UserInputError, match=r"a pet cannot be called .*; use a letter, then"):
        pets.add(name, make_cat)
    assert pets.names() == []


@pytest.mark.parametrize(("place", "config"), [("ENTRY", CatConfig), ("make_cat", None)])
def test_a_package_brings_an_entry_or_a_factory(pets, installed, place, config):
    installed.append(("tabby", f"tests.framework.test_registry:{place}"))
    assert pets.names() == ["tabby"] and "tabby" in pets
    entry = pets.get("tabby")
    assert (entry.name, entry.factory, entry.config) == ("tabby", make_cat, config)
    assert pets.get("tabby") is entry


def test_what_is_added_by_hand_counts_before_what_is_installed(pets, installed):
    installed.append(("cat", "no.such.module:ENTRY"))
    pets.add("cat", make_cat)
    assert pets.get("cat").factory is make_cat and pets.names() == ["cat"]


@pytest.mark.parametrize(
    ("place", "why"),
    [
        ("no.such.module:ENTRY", r"\(no\.such\.module:ENTRY\) cannot be loaded: No module named 'no'"),
        ("tests.framework.test_registry:MISSING", "cannot be loaded: .*MISSING"),
        ("tests.framework.test_registry:NOT_CALLABLE", "must be an Entry or a factory, is int"),
    ],
)
def test_broken_packages_are_named_and_do_no_harm_to_others(pets, installed, place, why):
    installed += [("broken", place), ("tabby", "tests.framework.test_registry:ENTRY")]
    assert pets.names() == ["broken", "tabby"], "a list needs no import"
    with pytest.raises(UserInputError, match=f"the pet 'broken' .*{why}"):
        pets.get("broken")
    assert pets.get("tabby").factory is make_cat


@pytest.mark.parametrize(
    ("raised", "reason"),
    [(ValueError("two\nlines"), "two lines"), (AssertionError(), "AssertionError"), (SystemExit("abort"), "abort")],
)
def test_whatever_goes_wrong_in_an_import_is_one_line(pets, installed, monkeypatch, raised, reason):
    def load(point):
        raise raised

    installed.append(("cat", "cats:ENTRY"))
    monkeypatch.setattr(metadata.EntryPoint, "load", load)
    with pytest.raises(UserInputError) as error:
        pets.get("cat")
    assert str(error.value) == f"the pet 'cat' (cats:ENTRY) cannot be loaded: {reason}"


def test_two_packages_with_one_name_are_told_apart_or_refused(pets, installed):
    here = "tests.framework.test_registry"
    installed += [("cat", f"{here}:ENTRY"), ("cat", f"{here}:ENTRY")]
    assert pets.get("cat").factory is make_cat, "an old installation of the same package does no harm"
    installed += [("dog", f"{here}:ENTRY"), ("dog", f"{here}:make_cat")]
    with pytest.raises(UserInputError, match=r"the pet 'dog' is brought by several packages \(.*:ENTRY and .*:make_cat\)"):
        pets.get("dog")


def test_the_installed_package_brings_entries_of_its_own():
    """Without the stand-in: what pyproject.toml says is found."""
    solvers = Registry("solver", "quadpips_drake.qp_solvers")
    assert "failing" in solvers and solvers.get("failing").summary
