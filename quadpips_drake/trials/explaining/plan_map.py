"""A plan seen from above: what was known of the ground, the torso search, the way and the footholds."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle
from scipy.spatial import cKDTree

from quadpips_drake.trials.explaining.plan_stories import PlanStory
from quadpips_drake.values.legs import Leg
from quadpips_drake.values.plans import TorsoPath
from quadpips_drake.values.steppability import Steppability
from quadpips_drake.visualization.colors import GOAL_COLOR, LEG_COLORS, REGION_COLORS, WAYPOINT_COLOR
from quadpips_drake.visualization.terrain_picture import draw_terrain

_FAR = 3.5
"""What is further away than this from where the plan begins is not shown [m] ..."""
_GOAL_FAR = 2.0
"""... nor a goal further than this, unless no way was found."""
_LEAST = 1.6, 1.0
"""Half of the least size of the map along x and y [m]."""
_PATH_COLOR, _VIEW_COLOR = "black", "0.35"
_NODE_COLORS = {"reached": (0.15, 0.35, 0.75), "not reached": (0.80, 0.10, 0.10)}
_RESOLUTION = 0.02


def plan_map(story: PlanStory, robot) -> Figure:
    """Returns the picture of one plan.

    Args:
        story: what came of the request; the true terrain is drawn faintly below.
        robot: RobotModel, for the outline of its feet.
    """
    view = _view_of(story)
    width, height = view[1] - view[0], view[3] - view[2]
    figure = Figure(figsize=(11.0, float(np.clip(8.2 * height / width + 0.9, 3.4, 9.0))), layout="constrained")
    axes = figure.subplots()
    draw_terrain(axes, story.terrain, view=view, resolution=_RESOLUTION, ends=False)
    axes.add_patch(Rectangle((view[0], view[2]), width, height, color="white", alpha=0.72, linewidth=0, zorder=1))
    labels = _draw_regions(axes, story)
    _draw_nodes(axes, story)
    _draw_way(axes, story, view)
    _draw_stances(axes, story)
    _draw_robot(axes, story, robot)
    axes.set_title(f"plan {story.request.id}, asked for at t = {story.asked:.2f} s")
    figure.legend(handles=_legend(story, labels), loc="outside right center", fontsize=8, frameon=False)
    axes.grid(alpha=0.25)
    return figure


def _view_of(story: PlanStory) -> tuple[float, float, float, float]:
    """x_min, x_max, y_min, y_max [m]: the way with a margin, and as much more as makes it no strip."""
    points = [story.pose[None, :2], story.begin[None, :2]]
    if story.torso_path is not None:
        points += [story.torso_path.poses[:, :2], story.torso_path.nodes[:, :2]]
    if story.foothold_plan is not None:
        points += [stance.footholds[:, :2] for stance in story.foothold_plan.stances]
    points = np.concatenate(points)
    points = points[np.hypot(*(points - story.begin[:2]).T) < _FAR]
    found = story.torso_path is not None and story.torso_path.success
    if np.hypot(*(story.request.goal - story.begin[:2])) < (_GOAL_FAR if found else _FAR):
        points = np.vstack((points, story.request.goal))
    low, high = points.min(axis=0) - 0.5, points.max(axis=0) + 0.5
    middle, half = 0.5 * (low + high), np.maximum(0.5 * (high - low), _LEAST)
    (x_min, y_min), (x_max, y_max) = middle - half, middle + half
    return float(x_min), float(x_max), float(y_min), float(y_max)


def _draw_regions(axes: Axes, story: PlanStory) -> list[Steppability]:
    """Boundaries and insets in the colour of the label; returns the labels that occur."""
    regions = story.torso_path.regions.regions if story.torso_path is not None else ()
    for label in sorted({region.label for region in regions}):
        color, mine = REGION_COLORS[Steppability(label)], [region for region in regions if region.label == label]
        outlines = [(region.center + region.boundary @ region.X_WR[:3, :2].T)[:, :2] for region in mine]
        insets = [(region.center + region.inset @ region.X_WR[:3, :2].T)[:, :2] for region in mine]
        axes.add_collection(PolyCollection(outlines, facecolors="none", edgecolors=[color], linewidths=1.0, zorder=2))
        axes.add_collection(PolyCollection(insets, facecolors=[(*color, 0.30)], edgecolors="none", zorder=2))
    return [Steppability(label) for label in sorted({region.label for region in regions})]


def _draw_nodes(axes: Axes, story: PlanStory) -> None:
    if story.torso_path is None:
        return
    nodes, reached = story.torso_path.nodes, story.torso_path.reached
    for name, mine in (("reached", reached), ("not reached", ~reached)):
        axes.plot(*nodes[mine][:, :2].T, ".", color=_NODE_COLORS[name], markersize=3.0, alpha=0.75, zorder=3)
    _draw_gap(axes, story.torso_path)


def _draw_gap(axes: Axes, path: TorsoPath) -> None:
    """Of a search that failed: the shortest way from nodes that were reached to one that was not."""
    reached, others = path.nodes[path.reached], path.nodes[~path.reached]
    if path.success or len(reached) == 0 or len(others) == 0:
        return
    distances, nearest = cKDTree(reached[:, :2]).query(others[:, :2])
    k = int(np.argmin(distances))
    ends = np.array([reached[nearest[k], :2], others[k, :2]])
    axes.plot(*ends.T, color=_NODE_COLORS["not reached"], linewidth=1.6, zorder=7)
    text = f"{distances[k]:.2f} m between nodes"
    axes.annotate(
        text, ends.mean(axis=0), xytext=(0, 7), textcoords="offset points", ha="center", fontsize=8, zorder=7,
        color=_NODE_COLORS["not reached"],
    )  # fmt: skip


def _draw_way(axes: Axes, story: PlanStory, view) -> None:
    """The torso path, where it ends, the local waypoint and the goal (an arrow at the edge when it is out of sight)."""
    path, plan = story.torso_path, story.foothold_plan
    if path is not None and path.success:
        axes.plot(*path.poses[:, :2].T, color=_PATH_COLOR, linewidth=1.8, zorder=4)
        axes.plot(*path.poses[-1, :2], "s", color=_PATH_COLOR, markersize=7, fillstyle="none", markeredgewidth=1.6, zorder=7)
    if plan is not None and plan.waypoint is not None:
        axes.plot(*plan.waypoint[:2], "D", color=WAYPOINT_COLOR, markeredgecolor="black", markersize=7, zorder=7)
    if path is not None:
        axes.plot(*path.viewpoints[:, :2].T, "^", color=_VIEW_COLOR, markersize=5, fillstyle="none", zorder=6)
    goal = story.request.goal
    inside = np.clip(goal, [view[0] + 0.1, view[2] + 0.1], [view[1] - 0.1, view[3] - 0.1])
    axes.plot(*inside, "*", color=GOAL_COLOR, markersize=13, markeredgecolor="white", zorder=8)
    if np.hypot(*(goal - inside)) > 1e-6:
        far = f"goal, {np.hypot(*(goal - story.begin[:2])):.1f} m away"
        axes.annotate(far, inside, xytext=(-6, 10), textcoords="offset points", ha="right", fontsize=8, color=GOAL_COLOR)


def _draw_stances(axes: Axes, story: PlanStory) -> None:
    """The footholds of the plan: letters of the leg with the number of the swing, faint for swings that there is no motion
    for; rings where the feet are at first."""
    plan = story.foothold_plan
    if plan is None or not plan.success:
        return
    for leg in Leg:
        start = plan.stances[0].footholds[leg]
        axes.plot(*start[:2], "o", color=LEG_COLORS[leg], fillstyle="none", markersize=9, markeredgewidth=1.8, zorder=5)
    reports = None if story.swing_plan is None else story.swing_plan.reports
    used = len(plan.swing_legs) if reports is None else sum(report.used for report in reports)
    for number, legs in enumerate(plan.swing_legs):
        for leg in legs:
            a, b = plan.stances[number].footholds[leg], plan.stances[number + 1].footholds[leg]
            faint = 1.0 if number < used else 0.35
            axes.plot([a[0], b[0]], [a[1], b[1]], "-", color=LEG_COLORS[leg], linewidth=0.9, alpha=0.5 * faint, zorder=4)
            axes.text(
                b[0], b[1], f"{leg.name}{number + 1}", zorder=6,
                color="white", fontsize=6.5, ha="center", va="center", alpha=faint,
                bbox={"boxstyle": "round,pad=0.15", "facecolor": LEG_COLORS[leg], "edgecolor": "none", "alpha": faint},
            )  # fmt: skip


def _draw_robot(axes: Axes, story: PlanStory, robot) -> None:
    """The outline of the nominal feet at the pose of the request, and where the plan begins if that is elsewhere."""
    corners = robot.nominal_footholds_B[[Leg.LF, Leg.RF, Leg.RH, Leg.LH], :2]
    poses = [(story.pose, "-", 0.9)]
    if story.ahead:
        poses.append((story.begin, "--", 0.6))
    for (x, y, _, yaw), style, alpha in poses:
        c, s = np.cos(yaw), np.sin(yaw)
        outline = corners @ np.array([[c, s], [-s, c]]) + (x, y)
        axes.plot(*np.vstack((outline, outline[:1])).T, style, color="0.25", linewidth=1.4, alpha=alpha, zorder=5)
        axes.annotate(
            "", (x + 0.35 * c, y + 0.35 * s), (x, y), zorder=5, alpha=alpha,
            arrowprops={"arrowstyle": "-|>", "color": "0.25", "linewidth": 1.6, "alpha": alpha},
        )  # fmt: skip


def _legend(story: PlanStory, labels: list[Steppability]) -> list:
    """What the signs mean, of those that are there."""

    def sign(marker, color, label, **more):
        return Line2D([], [], marker=marker, color=color, label=label, linestyle="none", **more)

    handles = [Line2D([], [], color="0.25", label="robot (nominal feet) when asked")]
    if story.ahead:
        handles.append(Line2D([], [], color="0.25", linestyle="--", label="... where the plan begins"))
    for label in labels:
        color, name = REGION_COLORS[label], label.name.lower().replace("_", " ")
        handles.append(Patch(facecolor=(*color, 0.30), edgecolor=color, label=f"region seen, {name}:\ninset and boundary"))
    if story.torso_path is not None and len(story.torso_path.nodes):
        handles += [sign(".", color, f"torso node, {name}") for name, color in _NODE_COLORS.items()]
    if story.torso_path is not None and len(story.torso_path.viewpoints):
        handles.append(sign("^", _VIEW_COLOR, "viewpoint: it has looked from there", fillstyle="none"))
    if story.torso_path is not None and story.torso_path.success:
        handles.append(Line2D([], [], color=_PATH_COLOR, label="torso path"))
        handles.append(
            sign("s", _PATH_COLOR, f"its end, {'the goal' if story.torso_path.to_goal else 'a sub-goal'}", fillstyle="none")
        )
    if story.foothold_plan is not None and story.foothold_plan.success:
        handles.append(sign("D", WAYPOINT_COLOR, "waypoint of the footholds", markeredgecolor="black"))
        handles += [sign("o", LEG_COLORS[leg], f"{leg.name} (ring: at first; n: after swing n)") for leg in Leg]
        handles.append(sign(None, "black", "faint: swing without a motion"))
    return [*handles, sign("*", GOAL_COLOR, "goal", markersize=11), Patch(color="#e8e2cf", label="true terrain, faint")]
