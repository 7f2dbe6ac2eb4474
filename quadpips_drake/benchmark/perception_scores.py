"""Scores of perception against the exact terrain: how true its floor and its regions are, and how much they cover.

All areas are counted on a map of square cells that is fixed to the world. What each score means:

- *floor* is every pixel of the cap that belongs to a superpixel, or every cell of an elevation map that belongs to a plane:
  ground of which regions may be made. Where an edge runs within a cell of it, the nearer surface counts, because a cell
  cannot say where in it the edge is.
- *false-safe* is region area (after inset) over a void, or more than 2 cm or 10 degrees off the surface that is there.
- *in view* is what the camera has seen so far (the surface was within 2 cm of the depth that a noise-free image shows) and
  what lies within the egocan's floor cap now, whoever makes the regions.
- *steppable* is ground of a walkable label, at most 30 degrees steep, at least 12 cm wide where it is and in view, after an
  inset of 3 cm. *Coverage* is the share of it that lies in regions after the same inset of 3 cm; *foot coverage* is the
  share that lies in their insets, which keep the foot's radius and a margin from edges and are what planning uses.
"""

from dataclasses import dataclass, field

import cv2
import numpy as np
import shapely

from quadpips_drake.math.polygons import shrink
from quadpips_drake.terrain.terrain import Terrain
from quadpips_drake.terrain.truth import GroundTruth
from quadpips_drake.values.regions import RegionSet
from quadpips_drake.values.sensing import CameraIntrinsics

CELL = 0.01
"""Side of a cell of the map [m]."""
MAP_MARGIN = 2.0
"""The map reaches this far beyond start and goal [m]."""
MIN_WIDTH = 0.12
"""Least width of steppable ground [m]."""
STEPPABLE_INSET = 0.03
"""What is taken off along its edges [m]."""
MAX_OFF_SURFACE = 0.02
"""Distance from the true surface beyond which region area is false-safe [m]."""
MAX_OFF_NORMAL = np.deg2rad(10.0)
"""Angle to the true normal beyond which region area is false-safe [rad]."""
MAX_SLOPE = np.deg2rad(30.0)
"""Steeper ground is not steppable [rad]."""
FLOOR_RADIUS = 1.0
"""Horizontal distance from the camera within which the floor's height and normals are scored [m]."""

KEPT_MOMENTS = 4
"""Maps that are kept for pictures."""


@dataclass(frozen=True)
class Floor:
    """Ground of which regions may be made, within FLOOR_RADIUS of the camera, as perception has it."""

    points: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    """In the frame O that perception takes for the world [m], (n, 3)."""
    normals: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    """Upward unit normals in O, (n, 3)."""


@dataclass(frozen=True)
class PerceptionSample:
    """What perception says at one time, and what is true then; poses in the true world W."""

    stamp: float
    X_WC: np.ndarray
    """True pose of the camera, (4, 4)."""
    true_depth: np.ndarray
    """Its depth image without noise [m], (height, width)."""
    intrinsics: CameraIntrinsics
    X_WO: np.ndarray
    """Pose in W of the frame that perception takes for the world (4, 4); the identity unless the pose estimate drifts."""
    floor: Floor
    regions: RegionSet


class TruthMap:
    """The true terrain on the cells of the map; index (i, j) for x and y."""

    def __init__(self, terrain: Terrain):
        corners = np.array([terrain.start[:2], terrain.goal])
        self.origin = corners.min(axis=0) - MAP_MARGIN
        shape = np.ceil((np.ptp(corners, axis=0) + 2 * MAP_MARGIN) / CELL).astype(int)
        self.truth = GroundTruth(terrain)
        self.x, self.y = np.meshgrid(*(self.origin[k] + (np.arange(shape[k]) + 0.5) * CELL for k in range(2)), indexing="ij")
        self.height = self.truth.height(self.x, self.y)
        self.normal = self.truth.normal(self.x, self.y)
        self.steppable = np.zeros(self.x.shape, bool)
        for patch in self.truth.patches:
            if patch.is_walkable and patch.normal[2] >= np.cos(MAX_SLOPE):
                self._mark_steppable(patch)

    def _mark_steppable(self, patch):
        X_WP = patch.frame()
        wide = patch.in_plane(X_WP).buffer(-MIN_WIDTH / 2).buffer(MIN_WIDTH / 2)
        room = wide.buffer(-STEPPABLE_INSET)
        if room.is_empty:
            return
        x0, y0, x1, y1 = patch.polygon.bounds
        window = self.window(np.array([[x0, y0], [x1, y1]]))
        p_WQ = np.stack([self.x[window], self.y[window], patch.height(self.x[window], self.y[window])], axis=-1)
        p_PQ = (p_WQ - X_WP[:3, 3]) @ X_WP[:3, :2]
        shapely.prepare(room)
        self.steppable[window] |= shapely.contains_xy(room, p_PQ[..., 0], p_PQ[..., 1])

    def window(self, corners: np.ndarray) -> tuple[slice, slice]:
        """Returns the slices of the map that hold ``corners`` (n, 2) [m]."""
        low = np.floor((corners.min(axis=0) - self.origin) / CELL).astype(int)
        high = np.ceil((corners.max(axis=0) - self.origin) / CELL).astype(int)
        return tuple(slice(max(int(low[k]), 0), max(int(high[k]), 0)) for k in range(2))

    def cells_in(self, polygon: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Returns the indices of the cells whose centres lie in the convex ``polygon`` (n, 2), counter-clockwise [m]."""
        window = self.window(polygon)
        x, y = self.x[window], self.y[window]
        inside = np.ones(x.shape, bool)
        for p, q in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
            inside &= (q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0]) >= 0
        i, j = np.nonzero(inside)
        return i + window[0].start, j + window[1].start


class PerceptionScorer:
    """Scores samples one after the other; remembers what has been seen and the regions of the last sample."""

    def __init__(self, terrain: Terrain, reach: float):
        """``reach``: of the floor cap around the camera, in heights of the camera above the ground [1]."""
        self.map = TruthMap(terrain)
        self._reach = reach
        self._ground = np.isfinite(self.map.height)
        self.seen = np.zeros(self.map.x.shape, bool)
        self._previous: tuple | None = None
        self._keep_every = 1
        self.rows: list[dict] = []
        """One dict of figures for each sample."""
        self.moments: list[dict] = []
        """Maps (bool) of some samples, KEPT_MOMENTS at most: t, seen, target, covered, false_safe."""
        self._plane_errors: list[np.ndarray] = []
        self._normal_errors: list[np.ndarray] = []

    def add(self, sample: PerceptionSample) -> dict:
        """Scores ``sample`` and returns its figures."""
        in_cap = self._look(sample)
        target = self.map.steppable & self._in_view(in_cap)
        row = {"t": round(sample.stamp, 3), "regions": len(sample.regions.regions)}
        row |= self._score_floor(sample)
        covered, covered_by_feet, false_safe, figures = self._score_regions(sample)
        row |= figures
        row["target_m2"] = float(target.sum()) * CELL**2
        row["covered_m2"] = float((target & covered).sum()) * CELL**2
        row["foot_covered_m2"] = float((target & covered_by_feet).sum()) * CELL**2
        if self._previous is not None:
            shared = in_cap & self._previous[1]
            union = ((covered | self._previous[0]) & shared).sum()
            row["frame_iou"] = float((covered & self._previous[0] & shared).sum() / union) if union else None
        self._previous = (covered, in_cap & self.seen)
        self.rows.append(row)
        maps = {"seen": self.seen.copy(), "target": target, "covered": covered, "false_safe": false_safe}
        self._keep({"t": row["t"], **maps})
        return row

    def _keep(self, moment: dict) -> None:
        """Keeps moments that are spread evenly over the samples: the first, the newest and some between."""
        if len(self.rows) % self._keep_every == 1 or self._keep_every == 1:
            self.moments.append(moment)
        if len(self.moments) > KEPT_MOMENTS:
            self.moments = self.moments[::2]
            self._keep_every *= 2

    def _look(self, sample: PerceptionSample) -> np.ndarray:
        """Adds to ``seen`` what the camera sees now; returns the cells within the floor cap."""
        p_WC, k = sample.X_WC[:3, 3], sample.intrinsics
        dx, dy = self.map.x - p_WC[0], self.map.y - p_WC[1]
        down = p_WC[2] - self.map.height
        near = np.hypot(dx, dy) < sample.true_depth.shape[1]  # all; invalid heights drop out below
        p_CQ = np.stack([dx, dy, -down], axis=-1)[near & self._ground] @ sample.X_WC[:3, :3]
        z = np.where(p_CQ[:, 2] > 0.05, p_CQ[:, 2], np.nan)
        with np.errstate(invalid="ignore"):
            u, v = k.fx * p_CQ[:, 0] / z + k.cx, k.fy * p_CQ[:, 1] / z + k.cy
            inside = (u >= 0) & (v >= 0) & (u <= k.width - 1) & (v <= k.height - 1)
        measured = np.full(len(z), np.nan)
        measured[inside] = sample.true_depth[np.rint(v[inside]).astype(int), np.rint(u[inside]).astype(int)]
        with np.errstate(invalid="ignore"):
            self.seen[near & self._ground] |= np.abs(measured - z) < MAX_OFF_SURFACE
            return self._ground & (np.hypot(dx, dy) < self._reach * down)

    def _in_view(self, in_cap: np.ndarray) -> np.ndarray:
        """Returns the cells in view, at least MIN_WIDTH wide and after the inset; where there is no ground: True."""
        view = ((self.seen & in_cap) | ~self._ground).astype(np.uint8)
        view = cv2.morphologyEx(view, cv2.MORPH_OPEN, _disc(MIN_WIDTH / 2))
        return cv2.erode(view, _disc(STEPPABLE_INSET)).astype(bool)

    def _score_floor(self, sample: PerceptionSample) -> dict:
        """Height and normal errors of the floor within FLOOR_RADIUS."""
        if len(sample.floor.points) == 0:
            return {"height_rms_m": None, "normal_median_deg": None, "floor_pixels": 0, "ghost_share": None}
        R_WO, p_WO = sample.X_WO[:3, :3], sample.X_WO[:3, 3]
        p_WQ = sample.floor.points @ R_WO.T + p_WO
        shifts = CELL * np.array([[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1]])
        x, y = p_WQ[:, 0] + shifts[:, :1], p_WQ[:, 1] + shifts[:, 1:]
        errors = np.nan_to_num(np.abs(p_WQ[:, 2] - self.map.truth.height(x, y)), nan=np.inf)
        nearest, columns = errors.argmin(axis=0), np.arange(errors.shape[1])
        error = errors[nearest, columns]
        ghost = ~np.isfinite(error)
        true_normals = self.map.truth.normal(x[nearest, columns], y[nearest, columns])
        found = sample.floor.normals @ R_WO.T
        angle = np.degrees(np.arccos(np.clip(np.sum(found * true_normals, axis=1), -1, 1)))[~ghost]
        self._normal_errors.append(angle[::7].astype(np.float32))
        return {
            "height_rms_m": float(np.sqrt(np.mean(error[~ghost] ** 2))) if np.any(~ghost) else None,
            "normal_median_deg": float(np.median(angle)) if len(angle) else None,
            "floor_pixels": int((~ghost).sum()),
            "ghost_share": float(ghost.mean()),
        }

    def _score_regions(self, sample: PerceptionSample):
        """Returns the maps covered, covered by insets and false-safe, and the figures of the regions."""
        covered, by_feet, false_safe = (np.zeros(self.map.x.shape, bool) for _ in range(3))
        area = wrong = 0
        causes = {"void": 0, "off_surface": 0, "off_normal": 0, "not_walkable": 0}
        plane_errors = []
        for region in sample.regions.regions:
            X_WR = sample.X_WO @ region.X_WR
            room = shrink(np.ascontiguousarray(region.boundary), STEPPABLE_INSET)
            if len(room):
                covered[self.map.cells_in(_in_world(X_WR, room))] = True
            i, j = self.map.cells_in(_in_world(X_WR, region.inset))
            by_feet[i, j] = True
            off, bad = self._check_cells(X_WR, i, j, causes)
            false_safe[i[bad], j[bad]] = True
            area, wrong = area + len(i), wrong + int(bad.sum())
            if np.isfinite(off).any():
                plane_errors.append(np.sqrt(np.nanmean(off**2)))
        self._plane_errors.append(np.array(plane_errors))
        figures = {"region_m2": area * CELL**2, "false_safe_m2": wrong * CELL**2}
        figures |= {f"{name}_m2": count * CELL**2 for name, count in causes.items()}
        figures["plane_error_median_m"] = float(np.median(plane_errors)) if plane_errors else None
        return covered | by_feet, by_feet, false_safe, figures

    def _check_cells(self, X_WR, i, j, causes: dict):
        """Returns the distance of each cell of a region from the true surface [m] and whether it is false-safe."""
        n, p = X_WR[:3, 2], X_WR[:3, 3]
        plane = p[2] - (n[0] * (self.map.x[i, j] - p[0]) + n[1] * (self.map.y[i, j] - p[1])) / n[2]
        true_normal = self.map.normal[i, j]
        off = (plane - self.map.height[i, j]) * true_normal[:, 2]
        with np.errstate(invalid="ignore"):
            bad = {
                "void": np.isnan(off),
                "off_surface": np.abs(off) > MAX_OFF_SURFACE,
                "off_normal": true_normal @ n < np.cos(MAX_OFF_NORMAL),
            }
        for name, cells in bad.items():
            causes[name] += int(cells.sum())
        return off, bad["void"] | bad["off_surface"] | bad["off_normal"]

    def summary(self) -> dict:
        """Returns the figures over all samples: areas summed, heights pooled, medians over pixels and regions."""
        total = {name: sum(row[name] for row in self.rows) for name in self.rows[0] if name.endswith("_m2")}
        names = ("height_rms_m", "floor_pixels", "ghost_share")
        floor = [[row[name] for name in names] for row in self.rows if row["height_rms_m"] is not None]
        rms, pixels, ghosts = np.array(floor).reshape(-1, 3).T
        planes = np.concatenate(self._plane_errors or [np.empty(0)])
        normals = np.concatenate(self._normal_errors or [np.empty(0)])
        ious = [row["frame_iou"] for row in self.rows if row.get("frame_iou") is not None]
        return {
            "samples": len(self.rows),
            "false_safe_share": _ratio(total["false_safe_m2"], total["region_m2"]),
            "false_safe_causes": {
                name: _ratio(total[f"{name}_m2"], total["region_m2"]) for name in ("void", "off_surface", "off_normal")
            },
            "coverage": _ratio(total["covered_m2"], total["target_m2"]),
            "foot_coverage": _ratio(total["foot_covered_m2"], total["target_m2"]),
            "height_rms_m": float(np.sqrt(np.average(rms**2, weights=pixels))) if len(rms) else None,
            "ghost_share": float(np.average(ghosts, weights=pixels)) if len(rms) else None,
            "normal_median_deg": float(np.median(normals)) if len(normals) else None,
            "plane_error_median_m": float(np.median(planes)) if len(planes) else None,
            "plane_error_p95_m": float(np.percentile(planes, 95)) if len(planes) else None,
            "frame_iou": float(np.mean(ious)) if ious else None,
            "regions": float(np.mean([row["regions"] for row in self.rows])),
        }


def _in_world(X_WR: np.ndarray, polygon: np.ndarray) -> np.ndarray:
    """Projection on the world's xy plane, (n, 2)."""
    return polygon @ X_WR[:2, :2].T + X_WR[:2, 3]


def _disc(radius: float) -> np.ndarray:
    cells = round(radius / CELL)
    return cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * cells + 1, 2 * cells + 1))


def _ratio(part: float, whole: float) -> float | None:
    return float(part / whole) if whole > 0 else None
