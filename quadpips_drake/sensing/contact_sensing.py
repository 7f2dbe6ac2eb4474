"""What the robot touches, read from the plant's contact results."""

from dataclasses import dataclass

import numpy as np
from pydrake.geometry import GeometryId, QueryObject, Role, SceneGraphInspector
from pydrake.multibody.plant import ContactResults, MultibodyPlant

from quadpips_drake.robots.robot_model import LINK_NAMES, RobotModel
from quadpips_drake.values.legs import NUM_LEGS, Leg


@dataclass(frozen=True, eq=False)
class ContactGeometries:
    """Which collision geometries belong to the robot."""

    feet: dict[GeometryId, int]
    """Foot spheres -> Leg."""
    body: dict[GeometryId, str]
    """All others -> name of their link."""


def find_contact_geometries(robot: RobotModel, plant: MultibodyPlant, inspector: SceneGraphInspector) -> ContactGeometries:
    """Looks up the robot's collision geometries in a plant that holds it; ``inspector`` is that of its SceneGraph."""
    instance = plant.GetModelInstanceByName(robot.name)
    feet, others = {}, {}
    shanks = {f"{leg.name}_SHANK": int(leg) for leg in Leg}
    for link in LINK_NAMES:
        frame = plant.GetBodyFrameIdOrThrow(plant.GetBodyByName(link, instance).index())
        for geometry in inspector.GetGeometries(frame, Role.kProximity):  # ids from the plant itself would keep it alive
            if link in shanks and inspector.GetName(geometry).endswith(f"{link}_foot"):
                feet[geometry] = shanks[link]
            else:
                others[geometry] = link
    return ContactGeometries(feet, others)


def foot_contact_forces(results: ContactResults, geometries: ContactGeometries) -> np.ndarray:
    """Returns the force of everything else on each foot, in the world [N], (4, 3)."""
    forces, feet = np.zeros((NUM_LEGS, 3)), geometries.feet
    for i in range(results.num_point_pair_contacts()):
        info = results.point_pair_contact_info(i)
        pair = info.point_pair()
        leg_A, leg_B = feet.get(pair.id_A), feet.get(pair.id_B)
        if leg_A is None and leg_B is None:
            continue
        force = info.contact_force()  # acts on body B, so on A with the opposite sign
        if leg_B is not None:
            forces[leg_B] += force
        if leg_A is not None:
            forces[leg_A] -= force
    return forces


def touching_links(results: ContactResults, geometries: ContactGeometries) -> list[str]:
    """Returns the links that touch something which is not the robot, other than with a foot; each once."""
    links = []
    for i in range(results.num_point_pair_contacts()):
        pair = results.point_pair_contact_info(i).point_pair()
        for own, other in ((pair.id_A, pair.id_B), (pair.id_B, pair.id_A)):
            link = geometries.body.get(own)
            if link and link not in links and other not in geometries.body and other not in geometries.feet:
                links.append(link)
    return links


def links_that_touch(results: ContactResults, geometries: ContactGeometries, others: set[GeometryId]) -> list[str]:
    """Returns the links, feet as "<leg>_foot", that touch one of the ``others``; each once."""
    links = []
    for i in range(results.num_point_pair_contacts()):
        pair = results.point_pair_contact_info(i).point_pair()
        for own, other in ((pair.id_A, pair.id_B), (pair.id_B, pair.id_A)):
            link = f"{Leg(geometries.feet[own]).name}_foot" if own in geometries.feet else geometries.body.get(own)
            if other in others and link and link not in links:
                links.append(link)
    return links


def overlaps(query: QueryObject, geometries: ContactGeometries, others: set[GeometryId]) -> bool:
    """Whether any part of the robot, feet included, is inside one of the ``others`` where everything is now."""
    own = {*geometries.feet, *geometries.body}
    pairs = query.ComputePointPairPenetration()
    return any({pair.id_A, pair.id_B} & own and {pair.id_A, pair.id_B} & others for pair in pairs)


def links_touching_each_other(results: ContactResults, geometries: ContactGeometries) -> list[tuple[str, str]]:
    """Returns the pairs of the robot's own links that touch each other, feet included with their shanks; each once."""
    owner = geometries.body | {geometry: f"{Leg(leg).name}_SHANK" for geometry, leg in geometries.feet.items()}
    pairs = []
    for i in range(results.num_point_pair_contacts()):
        pair = results.point_pair_contact_info(i).point_pair()
        links = owner.get(pair.id_A), owner.get(pair.id_B)
        if None not in links and links not in pairs:
            pairs.append(links)
    return pairs


def deepest_overlap(query: QueryObject, geometries: ContactGeometries, foot_radius: float) -> tuple[str, str, float] | None:
    """Returns which link is deepest inside something that is not the robot: its name, the other shape's, the depth [m].

    None when there is none. Feet may press against edges beside them: they count from ``foot_radius`` [m] on.
    """
    deepest = None
    for pair in query.ComputePointPairPenetration():
        for own, other in ((pair.id_A, pair.id_B), (pair.id_B, pair.id_A)):
            link = geometries.body.get(own)
            if own in geometries.feet and pair.depth > foot_radius:
                link = f"{Leg(geometries.feet[own]).name} foot"
            is_own = other in geometries.body or other in geometries.feet
            if link and not is_own and (deepest is None or pair.depth > deepest[2]):
                deepest = (link, query.inspector().GetName(other), pair.depth)
    return deepest
