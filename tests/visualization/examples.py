"""Small made-up values to draw."""

import numpy as np

from quadpips_drake.values.centroidal import CentroidalState
from quadpips_drake.values.contact_schedule import ContactSchedule
from quadpips_drake.values.images import AffordanceImage
from quadpips_drake.values.legs import Leg
from quadpips_drake.values.plans import FootholdPlan, PlanSketch, Stance
from quadpips_drake.values.reference import FootholdTarget, WholeBodyReference
from quadpips_drake.values.regions import PlanarRegion, RegionSet
from quadpips_drake.values.sensing import CameraIntrinsics

SQUARE = np.array([[-0.1, -0.1], [0.1, -0.1], [0.1, 0.1], [-0.1, 0.1]])
UP = np.array([0.0, 0.0, 1.0])


def regions(stamp: float, count: int = 4) -> RegionSet:
    def region(i):
        X_WR = np.eye(4)
        X_WR[:3, 3] = 0.25 * i, 0.0, 0.0
        return PlanarRegion(i, X_WR, SQUARE, 0.8 * SQUARE, i % 4)

    return RegionSet(stamp, tuple(region(i) for i in range(count)))


def reference(robot, number: int, begin: float, duration: float = 0.5) -> WholeBodyReference:
    """The base moves on by 0.2 m while LF and RH swing."""
    times = begin + np.linspace(0, duration, 26)
    states = np.zeros((26, 24))
    states[:, 6] = np.linspace(0, 0.2, 26)
    states[:, 8] = robot.nominal_base_height
    states[:, CentroidalState.JOINTS] = robot.nominal_joints
    swing = np.array([False, True, True, False])
    schedule = ContactSchedule(begin + np.array([0.05, 0.45]), np.array([[True] * 4, swing, [True] * 4]))
    feet = robot.nominal_footholds_B + np.array([0.2, 0, robot.nominal_base_height])
    targets = tuple(FootholdTarget(leg, begin + 0.05, begin + 0.45, feet[leg], UP) for leg in (Leg.LF, Leg.RH))
    return WholeBodyReference(begin, number, times, states, np.zeros((26, 24)), schedule, targets)


def plan_sketch(robot, number: int) -> PlanSketch:
    feet = robot.nominal_footholds_B * [1, 1, 0]
    region = regions(0.0, 1).regions[0]
    stances = tuple(
        Stance(
            feet + np.array([0.2 * i, 0, 0]), np.tile(UP, (4, 1)), (region,) * 4, np.array([0.2 * i, 0, 0.5]), np.zeros(3)
        )
        for i in range(2)
    )
    return FootholdPlan(0.0, number, stances, ((Leg.LF, Leg.RH),), waypoint=np.array([1.0, 0, 0.5, 0])).sketch()


def affordance_image(stamp: float) -> AffordanceImage:
    """What a camera 1 m above level ground sees that looks straight down: stripes of the three labels along x."""
    size, focal = 24, 24.0
    labels = np.repeat(np.repeat([0, 1, 2, 3], 6)[None], size, axis=0).astype(np.uint8)
    X_WC = np.array([[1.0, 0, 0, 0], [0, -1, 0, 0], [0, 0, -1, 1], [0, 0, 0, 1]])
    intrinsics = CameraIntrinsics(size, size, focal, focal, 0.5 * size, 0.5 * size)
    depth = np.ones((size, size), np.float32)
    normals = np.tile(np.float32([0, 0, -1]), (size, size, 1))
    return AffordanceImage(stamp, X_WC, intrinsics, depth, normals, labels)
