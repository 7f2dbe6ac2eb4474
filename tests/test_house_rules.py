"""Rules for the sources as a whole: which way imports run, how long things may be, what is documented."""

import ast
import re
from collections import Counter, defaultdict
from pathlib import Path

import pytest

from tests.source_tree import ROOT, files, module_name

STAGES = (
    "math",
    "values",
    "framework",
    "solvers",
    "robots",
    "terrain",
    "sensing",
    "estimation",
    "perception",
    "gaits",
    "planning",
    "trajectory",
    "control",
    "supervision",
    "learning",
    "faults",
    "visualization",
)
"""In the order in which data flows; a stage imports itself and earlier ones."""
ABOVE_THE_STAGES = {
    "baselines": {"baselines"},
    "diagrams": {"diagrams", "baselines"},
    "trials": {"trials", "diagrams", "baselines"},
    "cockpit": {"cockpit", "trials", "diagrams", "baselines"},
    "benchmark": {"benchmark", "trials", "diagrams", "baselines"},
    "cli": {"cli", "benchmark", "cockpit", "trials", "diagrams", "baselines"},
}
"""What each of them may import besides all stages."""
MODELS = "models"
PARTS = {*STAGES, *ABOVE_THE_STAGES, MODELS}
PACKAGE_FILES = [path for path in files("*.py") if path.relative_to(ROOT).parts[0] in ("quadpips_drake", "diagrams")]
MAX_FILE_BYTES = 15_000_000
MAX_FILE_LINES = 400
MAX_FUNCTION_LINES = 60
MAX_MODULES_IN_A_FOLDER = 16


def part_of(module: str) -> str:
    """'quadpips_drake.planning.torso' -> 'planning'; '' for a module at the top of the package, like errors."""
    name = module.split(".")[1] if "." in module else ""
    return name if name in PARTS else ""


def imported_modules(path: Path) -> set[str]:
    """Modules of the package that a file imports, anywhere in it."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            found |= {f"{node.module}.{alias.name}" for alias in node.names}
    return {name for name in found if name.startswith("quadpips_drake.")}


def import_graph() -> dict[str, set[str]]:
    """Which modules of the package each of them imports by name, deferred imports included."""
    modules = {module_name(path): imported_modules(path) for path in PACKAGE_FILES}
    # ``from a.b import c`` imports the module a.b.c if there is one, else something that a.b holds.
    return {
        name: {module if module in modules else module.rpartition(".")[0] for module in imports} & modules.keys()
        for name, imports in modules.items()
    }


def circle_in(graph: dict[str, set[str]]) -> list[str]:
    """Modules that import each other in a circle, the first one again at the end; empty where there is no circle."""
    finished, way = set(), []

    def visit(name: str) -> list[str]:
        if name in way:
            return [*way[way.index(name) :], name]
        if name in finished:
            return []
        way.append(name)
        for imported in sorted(graph[name]):
            if circle := visit(imported):
                return circle
        finished.add(way.pop())
        return []

    return next((circle for name in sorted(graph) if (circle := visit(name))), [])


def allowed_parts(part: str) -> set[str]:
    """Parts of the package that the part may import; '' stands for the modules at the top."""
    if part in ("", MODELS):
        return {"", MODELS}
    if part in STAGES:
        return {"", MODELS, *STAGES[: STAGES.index(part) + 1]}
    return {"", MODELS, *STAGES, *ABOVE_THE_STAGES[part]}


@pytest.mark.parametrize("path", PACKAGE_FILES, ids=module_name)
def test_imports_run_downward(path):
    allowed = allowed_parts(part_of(module_name(path)))
    wrong = sorted(name for name in imported_modules(path) if part_of(name) not in allowed)
    assert not wrong, f"{module_name(path)} must not import {wrong}"


def test_imports_run_in_no_circle():
    assert circle_in({"a": {"b"}, "b": {"c"}, "c": {"b"}}) == ["b", "c", "b"]
    assert " -> ".join(circle_in(import_graph())) == ""


def test_folders_are_small():
    folders = Counter(path.parent.relative_to(ROOT).as_posix() for path in PACKAGE_FILES)
    large = {folder: number for folder, number in folders.items() if number > MAX_MODULES_IN_A_FOLDER}
    assert not large, f"more than {MAX_MODULES_IN_A_FOLDER} modules in {large}"


def test_the_architecture_lists_all_folders_in_their_order():
    page = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    listed = re.findall(r"^\| `(?:\.\./)?([a-z]+)` \|", page, re.MULTILINE)
    present = {
        path.relative_to(ROOT / "quadpips_drake").parts[0] for path in (ROOT / "quadpips_drake").rglob("*/__init__.py")
    }
    assert set(listed) == present | {"diagrams"}
    order = [*STAGES, *ABOVE_THE_STAGES]
    ranked = [folder for folder in listed if folder in order]
    assert ranked == sorted(ranked, key=order.index)


def test_every_public_class_has_a_name_of_its_own():
    places = defaultdict(list)
    for path in PACKAGE_FILES:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                places[node.name].append(module_name(path))
    twice = {name: modules for name, modules in places.items() if len(modules) > 1}
    assert not twice, f"two classes of one name: {twice}"


def test_no_file_is_too_large_for_the_repository():
    large = [str(path.relative_to(ROOT)) for path in files("*") if path.stat().st_size > MAX_FILE_BYTES]
    assert not large


def test_files_and_functions_are_short():
    long = []
    for path in files("*.py"):
        text = path.read_text(encoding="utf-8")
        name = path.relative_to(ROOT)
        if text.count("\n") > MAX_FILE_LINES:
            long.append(f"{name}: {text.count(chr(10))} lines")
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.FunctionDef) and (length := node.end_lineno - node.lineno + 1) > MAX_FUNCTION_LINES:
                long.append(f"{name}: {node.name} has {length} lines")
    assert not long, "\n".join(long)


def test_public_things_are_documented():
    silent = []
    for path in PACKAGE_FILES:
        tree = ast.parse(path.read_text(encoding="utf-8"))
        if tree.body and not ast.get_docstring(tree):
            silent.append(module_name(path))
        for node in tree.body:
            if isinstance(node, ast.FunctionDef | ast.ClassDef) and not node.name.startswith("_"):
                silent += [] if ast.get_docstring(node) else [f"{module_name(path)}.{node.name}"]
    assert not silent, f"no docstring: {silent}"


def test_numbers_in_configurations_say_their_unit():
    silent = []
    for path in PACKAGE_FILES:
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            if not (isinstance(node, ast.ClassDef) and node.name.endswith("Config")):
                continue
            for statement, following in zip(node.body, [*node.body[1:], None], strict=True):
                if isinstance(statement, ast.AnnAssign) and "float" in ast.unparse(statement.annotation):
                    documented = isinstance(following, ast.Expr) and isinstance(following.value, ast.Constant)
                    silent += [] if documented else [f"{node.name}.{statement.target.id}"]
    assert not silent, f"no line below that says meaning and unit: {silent}"


def test_links_in_the_documentation_lead_somewhere():
    broken = []
    for page in files("*.md"):
        for target in re.findall(r"\]\((?!https?:|#)([^)#]+)", page.read_text(encoding="utf-8")):
            broken += [] if (page.parent / target).exists() else [f"{page.relative_to(ROOT)}: {target}"]
    assert not broken


def test_files_and_folders_that_are_mentioned_exist():
    """A name counts as found if a path in the repository ends in it: trajectory/ocp/terms/, or just torso_search.py."""
    written_by_programs = r"(?:[\w/]+/)?summary\.md"
    paths = ["/" + path.relative_to(ROOT).as_posix() for path in files("*")]
    folders = {path[: path.index("/", at) + 1] for path in paths for at in range(1, len(path)) if "/" in path[at:]}
    lost = []
    for source in [*files("*.md"), *PACKAGE_FILES]:
        text = source.read_text(encoding="utf-8")
        named = re.findall(rf"(?<![\w./*-])(?!NAME|FILE|{written_by_programs})((?:[\w-]+/)*[\w-]+\.(?:py|md))\b(?!\()", text)
        lost += [f"{source.relative_to(ROOT)}: {name}" for name in named if not any(p.endswith(f"/{name}") for p in paths)]
        named = re.findall(r"`((?:[\w-]+/)+)`", text) if source.suffix == ".md" else []
        lost += [f"{source.relative_to(ROOT)}: {name}" for name in named if not any(f.endswith(f"/{name}") for f in folders)]
    assert not lost, "\n".join(lost)
