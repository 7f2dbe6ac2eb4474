"""Where the network says that a foot should come down, instead of where a heuristic wants it."""

from pathlib import Path

import numpy as np

from quadpips_drake.baselines.learned_footholds.model_file import load_network
from quadpips_drake.baselines.learned_footholds.swing_view import ground_at, swing_view


class FootholdAdvice:
    """Moves wishes for footholds as the network has learned it from the foothold search."""

    def __init__(self, robot, directory: Path | None, max_offset: float):
        """Args: a RobotModel; where its network lies, None: that of the package; by how much a wish is moved at most [m]."""
        self._network = load_network(robot.name, directory)
        self._nominal = np.array(robot.nominal_footholds_B[:, :2])
        self._most = max_offset

    def moved(self, wish: np.ndarray, leg: int, swinging: tuple, feet: np.ndarray, outlines) -> np.ndarray:
        """The ``wish`` for a foothold of ``leg``, a ground point in W [m], (3,), moved.

        Its height is that of the ground where it is moved to, if there is any. Where fewer than two feet stay down, the
        network has nothing to say.

        Args:
            wish: where the heuristic wants it.
            leg: whose foothold.
            swinging: the legs that swing at the same time, ``leg`` among them.
            feet: ground points of all feet before that in W [m], (4, 3).
            outlines: RegionTable of the boundaries of what may be stepped on.
        """
        view = swing_view(feet, swinging, leg, wish[:2], self._nominal, self._network.cell, outlines)
        if view is None:
            return wish
        offset = self._network.offsets(view.inputs[None])[0]
        offset = offset * min(1.0, self._most / max(np.sqrt(offset @ offset), 1e-9))
        xy = view.moved(offset)
        height = ground_at(outlines, xy[None])[0]
        return np.append(xy, height if np.isfinite(height) else wish[2])
