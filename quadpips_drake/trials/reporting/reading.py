"""Reads what a trial has left: files from anywhere, in which anything may be wrong."""

import zipfile
from dataclasses import fields, replace
from pathlib import Path

import numpy as np

from quadpips_drake.errors import UserInputError
from quadpips_drake.files import read_json
from quadpips_drake.robots.robot_library import load_robot
from quadpips_drake.robots.robot_model import LINK_NAMES
from quadpips_drake.trials.reporting.trial_record import CONFIG, LOG, RESULT, TrialRecord
from quadpips_drake.trials.result import TrialResult
from quadpips_drake.trials.simulated_trial import MAX_SAMPLES
from quadpips_drake.trials.trial import TrialConfig
from quadpips_drake.trials.trial_log import MAX_NOTES
from quadpips_drake.trials.trial_options import resolve_config
from quadpips_drake.trials.walk_trial import WalkTrialConfig
from quadpips_drake.trials.world import world_of

MAX_LOG_BYTES = 2_000_000_000
"""Largest log when it is unpacked [bytes]."""
_SHAPES = {
    "time": (),
    **dict.fromkeys(("p_WB", "rpy_WB", "v_WB", "w_WB", "reference_p_WB", "reference_rpy_WB"), (3,)),
    **dict.fromkeys(("push", "velocity_command"), (3,)),
    **dict.fromkeys(("joint_positions", "joint_velocities", "joint_torques"), (12,)),
    **dict.fromkeys(("contact_forces", "foot_positions", "planned_forces", "asked_feet", "asked_footholds"), (4, 3)),
    **dict.fromkeys(("contacts", "asked_contacts", "foot_modes", "region_labels"), (4,)),
    **dict.fromkeys(("phase", "gait", "mpc_age", "mpc_failures", "wbc_failures", "unstable", "regions_stamp"), ()),
    "swing_times": (4, 2),
    "touching": (len(LINK_NAMES),),
    "touching_itself": (2,),
    "measured": (),
}
"""Arrays with one row for each sample, and the shape of a row."""
_NEEDED = ("time", "p_WB", "rpy_WB", "v_WB", "joint_torques", "contact_forces", "contacts", "foot_positions")
_OTHERS = {
    "foothold": {"leg": (), "position": (3,), "touchdown": (), "plan": ()},
    "note": {"time": (), "source": (), "text": ()},
    "appeared": {"time": (), "low": (3,), "high": (3,)},
}
"""Arrays with rows of their own, by the first part of their names; those of one kind have the same number."""


def read_record(folder: Path) -> TrialRecord:
    """Reads what a trial has left in ``folder``; what is missing or damaged beside result.json and log.npz is a remark.

    Raises:
        UserInputError: there are no results, or these two make no sense.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise UserInputError(f"{folder}: no such directory; give one that 'quadpips run' or 'quadpips walk' has written")
    if not (folder / RESULT).exists():
        raise UserInputError(f"{folder}: there is no {RESULT}; give a directory that 'quadpips run' or 'walk' has written")
    result = read_result(folder / RESULT)
    remarks = []
    log: dict[str, np.ndarray] = {}
    if (folder / LOG).exists():
        log = read_log(folder / LOG)
    else:
        remarks.append(f"there is no {LOG}")
    config, robot, terrain = None, None, None
    try:
        config = resolve_config(TrialConfig if result.planner else WalkTrialConfig, folder / CONFIG, {}, [])
        robot, terrain = world_of(config, None, None)
    except UserInputError as error:
        remarks.append(f"without its configuration or terrain: {error}")
    if robot is None:
        try:
            robot = load_robot(result.robot)
        except UserInputError as error:
            remarks.append(f"without its robot: {error}")
    return TrialRecord(folder, result, log, robot, terrain, config, tuple(remarks))


def read_result(path: Path) -> TrialResult:
    """Reads a result.json. Raises UserInputError."""
    return _checked_result(read_json(path), path)


def _checked_result(document, path: Path) -> TrialResult:
    """The TrialResult of a JSON document; what it does not know is left out."""
    if not isinstance(document, dict):
        raise UserInputError(f"{path}: not a result of a trial: it is no mapping")
    example = TrialResult(False, "error", "", "")
    values = {}
    for entry in fields(TrialResult):
        value, kind = document.get(entry.name), type(getattr(example, entry.name))
        if kind is float and type(value) is int:
            value = float(value)
        if type(value) is kind:
            values[entry.name] = value
        elif value is not None or entry.name in ("success", "reason", "robot", "terrain"):
            raise UserInputError(f"{path}: not a result of a trial: '{entry.name}' is missing or of the wrong kind")
    try:
        return replace(example, **values)
    except ValueError as error:
        raise UserInputError(f"{path}: not a result of a trial: {error}") from None


def read_log(path: Path) -> dict[str, np.ndarray]:
    """Reads the arrays of a log.npz that reports know. Raises UserInputError for whatever is wrong with it."""
    if not path.is_file():  # a pipe would block
        raise UserInputError(f"{path}: not a regular file")
    try:
        with zipfile.ZipFile(path) as archive:
            size = sum(info.file_size for info in archive.infolist())
        if size > MAX_LOG_BYTES:
            raise UserInputError(f"{path}: larger than {MAX_LOG_BYTES / 1e9:g} GB when it is unpacked")
        with np.load(path, allow_pickle=False) as file:
            known = [*_SHAPES, *(f"{kind}_{name}" for kind, names in _OTHERS.items() for name in names)]
            log = {name: file[name] for name in known if name in file.files}
    except UserInputError:
        raise
    except Exception as error:  # zipfile, zlib and numpy raise many kinds for a damaged file
        raise UserInputError(f"{path}: not a log of a trial, or damaged ({str(error) or type(error).__name__})") from None
    problem = _problem_with(log)
    if problem:
        raise UserInputError(f"{path}: not a log of a trial: {problem}")
    return log


def _problem_with(log: dict[str, np.ndarray]) -> str:
    """What is wrong with the arrays of a log; empty if nothing is."""
    missing = [name for name in _NEEDED if name not in log]
    if missing:
        return f"'{missing[0]}' is missing"
    samples = log["time"].shape[0] if log["time"].ndim == 1 else -1
    if not 0 < samples <= MAX_SAMPLES + 1:
        return "'time' must be a list of times"
    rows = dict.fromkeys(_SHAPES, samples)
    shapes = dict(_SHAPES)
    for kind, names in _OTHERS.items():
        if not all(f"{kind}_{name}" in log for name in names):
            for name in names:
                log.pop(f"{kind}_{name}", None)
            continue
        count = len(np.atleast_1d(log[f"{kind}_{next(iter(names))}"]))
        rows |= {f"{kind}_{name}": count for name in names}
        shapes |= {f"{kind}_{name}": shape for name, shape in names.items()}
    for name, array in log.items():
        if array.shape != (rows[name], *shapes[name]):
            return f"'{name}' has the shape {array.shape}, not {(rows[name], *shapes[name])}"
        if array.dtype.kind not in ("U" if name in ("note_source", "note_text") else "biuf"):
            return f"'{name}' is of the kind {array.dtype}"
    if not np.isfinite(log["time"]).all() or (np.diff(log["time"]) <= 0.0).any():
        return "times must be finite and increase"
    if len(log.get("note_time", ())) > MAX_NOTES:
        return f"more than {MAX_NOTES} notes"
    legs = log.get("foothold_leg", np.zeros(0, int))
    links = log.get("touching_itself", np.zeros((0, 2), int))
    if ((legs < 0) | (legs > 3)).any() or ((links < -1) | (links >= len(LINK_NAMES))).any():
        return "a leg or link that no robot has"
    return ""
