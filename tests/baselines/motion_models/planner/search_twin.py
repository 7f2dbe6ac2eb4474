"""Algorithm 1 of Taouil et al. as it reads: the slow reference that the compiled search is held against."""

import heapq
import math
from dataclasses import dataclass

from quadpips_drake.baselines.motion_models.planner import search_kernels as kernels
from quadpips_drake.baselines.motion_models.state import INPUTS, OUTPUTS, PAIRS


@dataclass
class Node:
    """The robot at an exchange of the feet."""

    position: list
    velocity: list
    previous_velocity: list
    command: list
    feet: list
    """[[x, y], ...] from the base, in B."""
    heights: list
    depth: int = 0
    parent: "Node" = None
    action: int = kernels.NO_ACTION
    cost: float = 0.0
    distances: tuple = (0.0, 0.0)
    replaced: bool = False

    @staticmethod
    def of(row) -> "Node":
        """From a row of numbers as the kernels have it."""
        row = [float(number) for number in row]
        feet = [row[8 + 2 * leg : 10 + 2 * leg] for leg in range(4)]
        return Node(row[0:2], row[2:4], row[4:6], row[6:8], feet, row[16:20])

    def way(self) -> list["Node"]:
        """The nodes from the start to here."""
        return [*(self.parent.way() if self.parent else []), self]


def children(node: Node, swing: int, walk, ground, rules):
    """(number of the action, the node that it leads to, whether its footholds are allowed)."""
    for k, (forward, more) in enumerate(rules.actions.tolist()):
        px, py, nx, ny = rules.line.tolist()
        offset = (node.position[0] - px) * nx + (node.position[1] - py) * ny
        left = more + min(max(-rules.hold_gain * offset, -rules.hold_limit), rules.hold_limit)
        child = predicted(node, swing, [forward, left], walk)
        child.depth, child.parent, child.action = node.depth + 1, node, k
        child.distances = landed(child, swing, walk, ground, rules)
        least = rules.clearance[node.depth].tolist()
        is_allowed = all(d > 0.0 and d >= wanted for d, wanted in zip(child.distances, least, strict=True))
        child.cost = cost_of(child, forward, more, rules) + (node.cost if rules.accumulate else 0.0)
        yield k, child, is_allowed


def predicted(node: Node, swing: int, command: list, walk) -> Node:
    """Equations (2) to (5)."""
    taken_up, ramp = list(command), [0.0, 0.0]
    if walk.acceleration < math.inf:
        for k in range(2):
            limit = walk.acceleration * walk.step_duration
            change = min(max(command[k] - node.velocity[k], -limit), limit)
            taken_up[k] = node.velocity[k] + change
            ramp[k] = -change * abs(change) / (2.0 * walk.acceleration)
    turns = walk.turns[0 if node.depth == 0 else 1].tolist()
    feet = [number for foot in node.feet for number in foot]
    x = [*node.velocity, *node.previous_velocity, *taken_up, *node.command, *feet, 1.0, *turns]
    y = []
    for row in range(OUTPUTS):
        total = 0.0
        for column in range(INPUTS):
            total += float(walk.coefficients[swing, row, column]) * x[column]
        y.append(total)
    shift = [y[0] + ramp[0], y[1] + ramp[1]]
    cos, sin = walk.heading.tolist()
    moved = [cos * shift[0] - sin * shift[1], sin * shift[0] + cos * shift[1]]
    position = [node.position[k] + moved[k] for k in range(2)]
    feet = [[foot[k] - shift[k] for k in range(2)] for foot in node.feet]
    for number, leg in enumerate(PAIRS[swing]):
        feet[leg] = [feet[leg][k] + (y[2 + 2 * number + k] + ramp[k]) for k in range(2)]
    return Node(position, y[6:8], node.velocity, list(command), feet, list(node.heights))


def landed(child: Node, swing: int, walk, ground, rules) -> tuple:
    """Distances of the swing feet to unsafe cells; 0 where no foot may come down."""
    cos, sin = walk.heading.tolist()
    found = []
    for leg in PAIRS[swing]:
        x, y = child.feet[leg]
        i = math.floor((child.position[0] + (cos * x - sin * y) - float(ground.corner[0])) / ground.cell)
        j = math.floor((child.position[1] + (sin * x + cos * y) - float(ground.corner[1])) / ground.cell)
        distance = 0.0
        if 0 <= i < ground.height.shape[0] and 0 <= j < ground.height.shape[1] and ground.distance[i, j] > 0.0:
            height = float(ground.height[i, j])
            if abs(height - child.heights[leg]) <= rules.max_height_change:
                distance, child.heights[leg] = float(ground.distance[i, j]), height
        found.append(distance)
    return tuple(found)


def cost_of(child: Node, forward: float, more: float, rules) -> float:
    """d_goal + d_foot + preferred speed."""
    x, y = float(rules.goal[0]) - child.position[0], float(rules.goal[1]) - child.position[1]
    cost = math.sqrt(x * x + y * y)
    for distance in child.distances:
        if distance < rules.margin:
            cost += rules.clearance_weight * (rules.margin - distance)
    off = forward - rules.preferred_speed
    return cost + rules.speed_weight * (off * off + more * more)


def search(start, start_swing: int, walk, ground, rules):
    """How it ends, expansions and the nodes of the plan; without one, those of the way that led furthest."""
    root = Node.of(start)
    visited, made, queue, opened = set(), [root], [(0.0, 0)], {}

    def swing_of(node):
        return (start_swing + node.depth) % 2

    def place_of(node):
        i, j = (math.floor((node.position[k] - root.position[k]) / rules.resolution + 0.5) for k in range(2))
        return i, j, swing_of(node), node.depth

    def is_at_goal(node):
        x, y = float(rules.goal[0]) - node.position[0], float(rules.goal[1]) - node.position[1]
        return x * x + y * y <= rules.goal_tolerance * rules.goal_tolerance

    opened[place_of(root)] = root
    expansions, end = 0, kernels.EXHAUSTED
    while queue:
        _, number = heapq.heappop(queue)
        node = made[number]
        if node.replaced:
            continue
        if opened.get(place_of(node)) is node:
            del opened[place_of(node)]
        if node.depth == rules.horizon:
            return kernels.FOUND, expansions, node.way()
        if number > 0 and is_at_goal(node):
            return kernels.AT_GOAL, expansions, node.way()
        if (place_of(node), node.action) in visited:
            continue
        if expansions >= rules.max_expansions:
            end = kernels.LIMIT
            break
        visited.add((place_of(node), node.action))
        expansions += 1
        for action, child, is_allowed in children(node, swing_of(node), walk, ground, rules):
            if not is_allowed or (place_of(child), action) in visited:
                continue
            rival = opened.get(place_of(child))
            if rival is not None:
                if rival.cost <= child.cost:
                    continue
                rival.replaced = True
            opened[place_of(child)] = child
            heapq.heappush(queue, (child.cost, len(made)))
            made.append(child)
    furthest = root
    for node in made:
        if node.depth > furthest.depth or (node.depth == furthest.depth and node.cost < furthest.cost):
            furthest = node
    return end, expansions, furthest.way()
