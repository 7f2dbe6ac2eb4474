"""Constants are those of the simulator, and stand once."""

import ast

from pydrake.multibody.plant import MultibodyPlant

from quadpips_drake.math.constants import GRAVITY
from tests.source_tree import ROOT, files


def test_gravity_is_drakes():
    assert list(MultibodyPlant(1e-3).gravity_field().gravity_vector()) == [0.0, 0.0, -GRAVITY]


def test_gravity_stands_once():
    copies = [
        path.relative_to(ROOT).as_posix()
        for path in files("*.py")
        if path.relative_to(ROOT).parts[0] in ("quadpips_drake", "diagrams")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Constant) and isinstance(node.value, float) and 9.8 <= node.value <= 9.82
    ]
    assert copies == ["quadpips_drake/math/constants.py"]
