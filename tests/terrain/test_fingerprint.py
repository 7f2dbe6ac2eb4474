"""The fingerprint of a terrain: what lies where, and nothing else."""

from dataclasses import replace

from quadpips_drake.terrain.library import load_terrain
from quadpips_drake.terrain.terrain import Box


def test_it_is_of_the_elements_alone():
    terrain = load_terrain("boulders", seed=1)
    assert terrain.fingerprint == load_terrain("boulders", seed=1).fingerprint
    assert replace(terrain, name="other", goal=(1.0, 0.0)).fingerprint == terrain.fingerprint
    renamed = tuple(replace(element, name="x") for element in terrain.elements)
    assert replace(terrain, elements=renamed).fingerprint == terrain.fingerprint


def test_every_change_of_an_element_changes_it():
    terrain = load_terrain("irregular_stones", seed=1)
    (first, *others) = terrain.elements
    assert isinstance(first, Box)
    variants = [replace(first, size=first.size + 1e-6), replace(first, label=2), replace(first, X_WE=others[0].X_WE)]
    prints = {replace(terrain, elements=(variant, *others)).fingerprint for variant in variants}
    prints |= {terrain.fingerprint, load_terrain("irregular_stones", seed=2).fingerprint}
    assert len(prints) == 5
