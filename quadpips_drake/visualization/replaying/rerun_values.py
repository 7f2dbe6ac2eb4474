"""Values in, Rerun's archetypes out: robot, terrain, images, superpixels, regions, plans."""

import numpy as np
from pydrake.math import RotationMatrix

from quadpips_drake.robots.robot_model import LINK_NAMES
from quadpips_drake.sensing.robot_shapes import CYLINDER, load_robot_shapes
from quadpips_drake.terrain.element_colors import element_colors
from quadpips_drake.terrain.terrain import Terrain
from quadpips_drake.terrain.triangles import joined_triangles
from quadpips_drake.values.images import AffordanceImage, SuperpixelImage
from quadpips_drake.values.legs import JOINTS_PER_LEG, Leg
from quadpips_drake.values.reference import WholeBodyReference
from quadpips_drake.values.regions import RegionSet
from quadpips_drake.values.robot_state import RobotState
from quadpips_drake.values.steppability import Steppability
from quadpips_drake.visualization.colors import BASE_REFERENCE_COLOR, LEG_COLORS, REGION_COLORS
from quadpips_drake.visualization.meshes.plan_meshes import base_path, swing_paths
from quadpips_drake.visualization.replaying.rerun_stream import import_rerun

ROBOT = "world/robot"
_BODY = (0.45, 0.47, 0.50)
_STRIDE = 2
"""Every how many rows and columns of a camera's images are kept."""
_HULL = 0.004
"""Radius of the lines that outline regions [m]."""


def rgb(color) -> tuple[int, ...]:
    """A colour of [0, 1] in whole numbers to 255."""
    return tuple(round(255 * float(value)) for value in color[:3])


def log_robot(stream, robot) -> None:
    """Its shapes, once; legs in their colours."""
    rerun, shapes = import_rerun(), load_robot_shapes(robot)
    for k, (kind, link) in enumerate(zip(shapes.kind, shapes.link, strict=True)):
        color = rgb(_BODY if link == 0 else LEG_COLORS[Leg((int(link) - 1) // JOINTS_PER_LEG)])
        half, rounding = shapes.half_size[k], float(shapes.rounding[k])
        quaternion = RotationMatrix(shapes.R_LG[k]).ToQuaternion()
        at = {
            "quaternions": [[*quaternion.xyz(), quaternion.w()]],
            "colors": [color],
            "fill_mode": "solid",
        }
        center = [shapes.p_LG[k]]
        if kind == CYLINDER:
            shape = rerun.Cylinders3D(lengths=[2 * half[2]], radii=[half[0]], centers=center, **at)
        elif rounding == 0.0:
            shape = rerun.Boxes3D(half_sizes=[half], centers=center, **at)
        elif half[2] == 0.0:
            shape = rerun.Ellipsoids3D(half_sizes=[[rounding] * 3], centers=center, **at)
        else:  # Rerun's capsules begin at their lower end, Drake's have their origin in the middle
            low = shapes.p_LG[k] - shapes.R_LG[k] @ np.array([0.0, 0.0, half[2]])
            shape = rerun.Capsules3D(lengths=[2 * half[2]], radii=[rounding], translations=[low], **at)
        stream.log(f"{ROBOT}/{LINK_NAMES[link]}/shape_{k}", shape, static=True)


def log_pose(stream, robot, state: RobotState) -> None:
    """Where base and links are."""
    rerun = import_rerun()
    stream.log(ROBOT, rerun.Transform3D(translation=state.p_WB, mat3x3=state.R_WB))
    rotations, positions = robot.link_poses_B(state.joint_positions)
    for name, R_BL, p_BL in zip(LINK_NAMES, rotations, positions, strict=True):
        stream.log(f"{ROBOT}/{name}", rerun.Transform3D(translation=p_BL, mat3x3=R_BL))


def log_terrain(stream, terrain: Terrain, name: str = "world/terrain", *, static: bool = True) -> None:
    """All elements as one mesh; each triangle has corners of its own, so that edges stay sharp."""
    rerun = import_rerun()
    vertices, colors = [], []
    for element, color in zip(terrain.elements, element_colors(terrain), strict=True):
        points, triangles = joined_triangles([element])
        vertices.append(points[triangles].reshape(-1, 3))
        colors.append(np.tile(rgb(color), (3 * len(triangles), 1)))
    corners = np.concatenate(vertices)
    normals = np.cross(corners[1::3] - corners[::3], corners[2::3] - corners[::3])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    mesh = rerun.Mesh3D(
        vertex_positions=corners,
        triangle_indices=np.arange(len(corners)).reshape(-1, 3),
        vertex_normals=np.repeat(normals, 3, axis=0),
        vertex_colors=np.concatenate(colors).astype(np.uint8),
    )
    stream.log(name, mesh, static=static)


def log_label_names(stream) -> None:
    """What the numbers in images of labels mean, once."""
    rerun = import_rerun()
    names = [(int(label), label.name.lower(), rgb(REGION_COLORS[label])) for label in Steppability]
    stream.log("world/camera", rerun.AnnotationContext(names), static=True)


def log_image(stream, image: AffordanceImage) -> None:
    """Depth and labels of the camera, at its pose."""
    rerun, k = import_rerun(), image.intrinsics
    depth, labels = image.depth[::_STRIDE, ::_STRIDE], image.labels[::_STRIDE, ::_STRIDE]
    millimetres = np.round(1000.0 * np.nan_to_num(depth, nan=0.0, posinf=0.0)).clip(0, 65535).astype(np.uint16)
    stream.log("world/camera", rerun.Transform3D(translation=image.X_WC[:3, 3], mat3x3=image.X_WC[:3, :3]))
    pinhole = rerun.Pinhole(
        focal_length=(k.fx / _STRIDE, k.fy / _STRIDE),
        principal_point=(k.cx / _STRIDE, k.cy / _STRIDE),
        width=depth.shape[1],
        height=depth.shape[0],
        image_plane_distance=0.3,
    )
    stream.log("world/camera", pinhole)
    stream.log("world/camera/depth", rerun.DepthImage(millimetres, meter=1000.0))
    stream.log("world/camera/labels", rerun.SegmentationImage(np.ascontiguousarray(labels)))


def log_superpixels(stream, superpixels: SuperpixelImage) -> None:
    """The clusters as an image from above, by number, and their centres in the scene, by label."""
    rerun, X_WE = import_rerun(), superpixels.X_WE
    numbers = np.where(superpixels.assignment >= 0, superpixels.assignment % 65535 + 1, 0).astype(np.uint16)
    stream.log("superpixels", rerun.SegmentationImage(np.flipud(numbers)))
    centers = superpixels.centers @ X_WE[:3, :3].T + X_WE[:3, 3]
    colors = [rgb(REGION_COLORS[Steppability(int(label))]) for label in superpixels.labels]
    stream.log("world/superpixels", rerun.Points3D(centers, colors=colors, radii=0.012))


def log_regions(stream, regions: RegionSet) -> None:
    """Boundaries (thin) and insets (thick) of all regions, by label."""
    rerun, strips, colors, radii = import_rerun(), [], [], []
    for region in regions.regions:
        for polygon, radius in ((region.boundary, 0.5 * _HULL), (region.inset, _HULL)):
            if len(polygon) > 2:
                corners = np.column_stack((np.concatenate((polygon, polygon[:1])), np.zeros(len(polygon) + 1)))
                strips.append(corners @ region.X_WR[:3, :3].T + region.X_WR[:3, 3])
                colors.append(rgb(REGION_COLORS[Steppability(region.label)]))
                radii.append(radius)
    stream.log("world/regions", rerun.LineStrips3D(strips, colors=colors, radii=radii))


def log_reference(stream, reference: WholeBodyReference, robot) -> None:
    """Footholds, the ways of the swinging feet and that of the base."""
    rerun = import_rerun()
    feet = reference.footholds
    colors = [rgb(LEG_COLORS[Leg(foothold.leg)]) for foothold in feet]
    names = [f"{Leg(foothold.leg).name} {foothold.touchdown_time:.2f} s" for foothold in feet]
    points = np.array([foothold.position for foothold in feet]).reshape(-1, 3)
    stream.log("world/plan/footholds", rerun.Points3D(points, colors=colors, labels=names, radii=0.03, show_labels=False))
    ways = swing_paths(reference, robot)
    swing_colors = [rgb(LEG_COLORS[leg]) for leg, _ in ways]
    stream.log("world/plan/swings", rerun.LineStrips3D([way for _, way in ways], colors=swing_colors, radii=0.007))
    stream.log(
        "world/plan/base", rerun.LineStrips3D([base_path(reference)], colors=[rgb(BASE_REFERENCE_COLOR)], radii=0.007)
    )
