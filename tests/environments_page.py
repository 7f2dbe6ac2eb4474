"""Writes docs/environments.md and its pictures: ``python -m tests.environments_page`` (``--text``: the page alone)."""

import inspect
import sys

import numpy as np
from PIL import Image

from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.terrain.library import load_terrain, terrain_difficulty, terrain_names, terrains
from quadpips_drake.terrain.standing_pose import standing_pose
from quadpips_drake.terrain.suites import suite_names, suite_terrains
from quadpips_drake.terrain.terrain import Terrain
from quadpips_drake.terrain.truth import GroundTruth
from quadpips_drake.values.steppability import Steppability
from quadpips_drake.visualization.meshes.plan_meshes import goal_mesh, start_mesh
from quadpips_drake.visualization.shapes import ColorMesh
from quadpips_drake.visualization.snapshot import SnapshotRenderer, look_at
from tests.source_tree import ROOT

PAGE = ROOT / "docs" / "environments.md"
PICTURES = ROOT / "docs" / "images" / "environments"
WIDTH, HEIGHT = 480, 270
"""Of a picture [pixels]."""
FINE = 2
"""It is rendered so many times larger."""
COLORS = 96
EDGE_RADIUS, EDGE_COLOR = 0.005, (0.35, 0.33, 0.30)
MAX_BYTES = 60_000
ROBOTS = ("anymal_c", "go2")

PAPER = "QuadPiPS (2026), section VIII"
RELEASED = f"{PAPER}, and its released world"
GAPS = "arXiv 2307.12292: widths of the gaps, heights of the steps and their order as published, all else chosen"
SOURCES = {
    "balance_beam": f"{RELEASED}; the slabs end here, 4 m before and behind the beam",
    "boulders": "our own; spherical obstacles as in arXiv 2501.00112, which tells neither counts nor sizes nor poses",
    "bumps": "our own",
    "down_ramp": "released with QuadPiPS, not in its benchmark; with a slope of 0.175 rad its `down_ramp_10`",
    "flat": "our own; `empty` of QuadPiPS is larger",
    "gap": "our own, for curves of success against the width of a trench",
    "gaps_and_steps": f"{GAPS}, scenario III; the second step leads down again, which is chosen, too",
    "gaps_staggered": f"{GAPS}, scenario II",
    "gaps_symmetric": f"{GAPS}, scenario I",
    "go2_double_platform": f"{PAPER}-E (a to f of its Figure 17): heights as published; lengths and widths chosen",
    "irregular_stones": "our own, for the experiment of arXiv 2501.00112, section 4.1: irregularly posed regions and "
    "spherical obstacles, of which neither counts nor sizes nor poses are told",
    "obstructed_balance_beam": f"{PAPER} shows it and tells that the barriers are angled and labelled passable; it was not "
    "released: beam as `balance_beam`, number, height and tilt of the barriers chosen",
    "offset_beam": "released with QuadPiPS, not in its benchmark",
    "open_stairs": "our own: `stairs` with a tread's thickness chosen",
    "parallel_beams": f"{PAPER}-C: width and distance; platforms as in the released world of the Go2, whose beams lie 1.3 m "
    "apart. ANYmal C looks around with its side cameras here (`--set 'stages.station.further_cameras=[]'`: not)",
    "pegboard": RELEASED,
    "ramp_10": f"{RELEASED}; the start lies 0.7 m nearer, the goal 0.1 m further up",
    "ramped_balance_beam": f"{RELEASED} (the parts as its state places them)",
    "ramped_stepping_stones": f"{RELEASED}; to which side the stones tilt is chosen",
    "rubble": RELEASED,
    "slope": "our own",
    "sparse_stones": f"{RELEASED}, centred on y = 0, with another start and goal",
    "stairs": f"{RELEASED} for the Go2; the start lies 1.3 m nearer, the goal 0.1 m before the published one",
    "stairs_10": f"{PAPER}: the version for ANYmal C, start and goal as for `stairs`",
    "stepping_stones": "our own",
    "winding_balance_beam": f"{PAPER} shows it and tells that the straight line leaves it; the world was not released: all "
    "lengths chosen",
    "winding_balance_beam_hard": "our own",
}
"""Where the geometry comes from; what is not here has the source of its family."""
_FAMILIES = {
    "go2_": "go2_double_platform",
    "open_": "open_stairs",
    "ramped_b": "ramped_balance_beam",
    "ramped_s": "ramped_stepping_stones",
}
_HEAD = """# Environments

The terrains of the library, written by `python -m tests.environments_page` from what the functions in
`quadpips_drake/terrain/environments/` say; a test compares. Each is a function of the seed and of one number, its
*difficulty*, for which the default is that of the source:

    quadpips terrain list                                        what there is
    quadpips terrain show balance_beam --difficulty 0.25         from above
    quadpips run --terrain balance_beam --difficulty 0.25 --seed 3
    quadpips terrain export rubble --seed 3 --difficulty 0.1     as a file, to be edited

In Python: `load_terrain("balance_beam", seed=3, difficulty=0.25)`. The seed decides what is random in a world (`boulders`,
`bumps`, `irregular_stones`, `pegboard`, `rubble`, `sparse_stones`; the same draws at any difficulty), and in any of them it
moves the start by up to 5 cm in x and y and 0.05 rad. Start is x, y [m] and yaw [rad], goal x, y [m]. Pictures show seed 0
with the robot at the start and a flag at the goal; dark is what no foot may use (a pit's floor), orange what may be stepped
over but not on.

A terrain of one's own: [terrain.md](terrain.md), [extending.md](extending.md). A function of another package gets a
difficulty by the decorator `quadpips_drake.takes_difficulty`.

## Suites

`quadpips_drake.suite_terrains(name, robot)`:

| suite | ANYmal C | Go2 |
|---|---|---|
"""


def make_page() -> str:
    """The text of the page."""
    lines = [f"| `{suite}` | {_members(suite, 'anymal_c')} | {_members(suite, 'go2')} |" for suite in suite_names()]
    for name in _in_order():
        lines += ["", *_entry(name)]
    return _HEAD + "\n".join(lines) + "\n"


def _in_order() -> list[str]:
    """All terrains: those of the paper, those of the hardware, the others."""
    first = [*dict.fromkeys(name for robot in ROBOTS for name in suite_terrains("paper", robot))]
    hardware = list(suite_terrains("go2_hardware", "go2"))
    others = [name for name in terrain_names() if name not in (*first, *hardware)]
    return [*first, *others, *hardware]


def _members(suite: str, robot: str) -> str:
    members = suite_terrains(suite, robot)
    return ", ".join(f"[{name}](#{name})" for name in members)


def _entry(name: str) -> list[str]:
    terrain, difficulty = load_terrain(name), terrain_difficulty(name)
    family = next((source for start, source in _FAMILIES.items() if name.startswith(start)), name)
    text = inspect.cleandoc(terrains.get(name).factory.__doc__).replace("``", "`").replace("\n\n", " ").replace("\n", " ")
    return [
        f"## {name}",
        "",
        f"![{name}](images/environments/{name}.png)",
        "",
        text,
        "",
        "| start | goal | elements | difficulty | source |",
        "|---|---|---|---|---|",
        f"| {_list(terrain.start)} | {_list(terrain.goal)} | {len(terrain.elements)} | {difficulty or '-'} "
        f"| {SOURCES.get(name) or SOURCES[family]} |",
    ]


def _list(values) -> str:
    return ", ".join(f"{value:.3f}".rstrip("0").rstrip(".") for value in values)


def make_picture(name: str) -> Image.Image:
    """The world with a robot at the start and a flag at the goal, seen from the right and from above."""
    terrain = load_terrain(name)
    robot = load_robot("go2" if name.startswith("go2_") else "anymal_c")
    overlays = start_mesh(terrain), goal_mesh(terrain), _edges(terrain)
    renderer = SnapshotRenderer(robot, terrain, overlays=overlays, width=FINE * WIDTH, height=FINE * HEIGHT, fov_y=0.6)
    p_WB, joints = standing_pose(robot, GroundTruth(terrain), *terrain.start)
    image = renderer.render(p_WB, (0, 0, terrain.start[2]), joints, look_at(*_view(terrain)))
    small = Image.fromarray(image).resize((WIDTH, HEIGHT), Image.Resampling.LANCZOS)
    return small.quantize(COLORS, dither=Image.Dither.NONE)


def _edges(terrain: Terrain) -> ColorMesh:
    """Thin dark lines around the flat pieces of the surface: without them a gentle slope is not seen."""
    mesh = ColorMesh()
    for patch in (patch for patch in GroundTruth(terrain).patches if patch.label != Steppability.NON_PASSABLE):
        for ring in (patch.polygon.exterior, *patch.polygon.interiors):
            xy = np.array(ring.coords)
            mesh.add_tube(np.column_stack((xy, patch.height(*xy.T))), EDGE_RADIUS, EDGE_COLOR)
    return mesh


def _view(terrain: Terrain) -> tuple[np.ndarray, np.ndarray]:
    """Where the camera is and what it looks at [m]: the middle of the way, from its right side."""
    start, goal = terrain.start[:2], terrain.goal
    truth = GroundTruth(terrain)
    heights = truth.nearest_walkable_height(*np.linspace(start, goal, 30).T)
    way = goal - start
    length = max(np.linalg.norm(way), 2.5)
    ahead = way / np.linalg.norm(way)
    target = np.array([*(0.5 * (start + goal)), 0.5 * (heights.min() + heights.max())])
    level = np.array([ahead[1], -ahead[0]]) - 0.35 * ahead
    distance = 1.02 * length + 1.7
    return target + distance * np.array([*(0.78 * level / np.linalg.norm(level)), 0.62]), target


def main(arguments: list[str]) -> None:
    """Writes the page, and unless told otherwise the pictures."""
    PAGE.write_text(make_page(), encoding="utf-8")
    if "--text" in arguments:
        return
    PICTURES.mkdir(parents=True, exist_ok=True)
    for name in terrain_names():
        make_picture(name).save(PICTURES / f"{name}.png", optimize=True)


if __name__ == "__main__":
    main(sys.argv[1:])
