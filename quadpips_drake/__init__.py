"""A quadruped that sees rough ground with a depth camera, decides where to step and walks there, simulated in Drake.

The public interface; everything else may move. A run in a few lines:

    import quadpips_drake as qp

    config = qp.load_config(robot="anymal_c", terrain="stepping_stones", seed=3)
    result = qp.run_trial(config, "out/my_run")

Robots and worlds: ``load_robot``, ``RobotModel``, ``load_terrain``, ``Terrain``, ``Box``, ``Cylinder``, ``Sphere``,
``Mesh``, ``Steppability``, ``GroundTruth``; ``terrain_difficulty``, ``takes_difficulty``, ``suite_names``,
``suite_terrains``.

Trials: ``load_config``, ``TrialConfig``, ``Trial``, ``run_trial``, ``load_walk_config``, ``WalkTrialConfig``, ``WalkTrial``,
``run_walk``, ``TrialResult``, ``UserInputError``.

Diagrams: ``QuadpipsDiagram``, ``QuadpipsConfig``, ``WalkDiagram``, ``WalkConfig``, ``SimulationStation``,
``ObservedStation``, ``PerceptionModule``, ``PlanningModule``, ``TrackingModule``; ``DiagramBuilder`` (Drake's, which also
compares the types of ports); ``Stage``, ``StageConfig``, ``Inputs``, ``declare_input``, ``declare_output``, ``LeafSystem``,
``Diagram`` (Drake's, which can be freed) for systems of one's own.

Values on ports: ``RobotState``, ``FootContacts``, ``CameraIntrinsics``, ``AffordanceImage``, ``LabelImage``,
``EgocanImage``, ``SuperpixelImage``, ``PlanarRegion``, ``RegionSet``, ``PlanRequest``, ``TorsoPath``, ``Stance``,
``FootholdPlan``, ``PlanSketch``, ``SwingPlan``, ``ContactSchedule``, ``FootholdTarget``, ``WholeBodyReference``,
``MpcPolicy``, ``WholeBodyCommand``, ``SafetyStatus``, ``StageStatus``, ``PlannerStatus``, ``PlannerPhase``, ``Leg``.

Registries, to which entries of one's own are added (docs/extending.md): ``registries.planners``, ``.region_sources``,
``.state_estimators``, ``.robots``, ``.terrains``, ``.gaits``, ``.qp_solvers``; ``Entry``, ``Registry``; what factories get:
``PlannerSetup``, ``RegionSourceSetup``, ``EstimatorSetup``.
"""

import importlib

__version__ = "0.1.0"

_HOMES = {
    "robots.robot_library": ("load_robot",),
    "robots.robot_model": ("RobotModel",),
    "terrain.library": ("load_terrain", "terrain_difficulty"),
    "terrain.environments.difficulty": ("takes_difficulty",),
    "terrain.suites": ("suite_names", "suite_terrains"),
    "terrain.terrain": ("Terrain", "Box", "Cylinder", "Sphere", "Mesh"),
    "terrain.truth": ("GroundTruth",),
    "trials.loading": ("load_config", "load_walk_config"),
    "trials.trial": ("TrialConfig", "Trial", "run_trial"),
    "trials.walk_trial": ("WalkTrialConfig", "WalkTrial", "run_walk"),
    "trials.result": ("TrialResult",),
    "errors": ("UserInputError",),
    "diagrams.quadpips": ("QuadpipsDiagram", "QuadpipsConfig"),
    "diagrams.walk": ("WalkDiagram", "WalkConfig"),
    "diagrams.simulation_station": ("SimulationStation",),
    "diagrams.observed_station": ("ObservedStation",),
    "diagrams.perception_module": ("PerceptionModule",),
    "diagrams.planning_module": ("PlanningModule",),
    "diagrams.tracking_module": ("TrackingModule",),
    "framework.ports": ("DiagramBuilder", "declare_input", "declare_output"),
    "framework.stage": ("Stage", "Inputs"),
    "framework.systems": ("LeafSystem", "Diagram"),
    "framework.stage_config": ("StageConfig",),
    "framework.registry": ("Entry", "Registry"),
    "values.legs": ("Leg",),
    "values.steppability": ("Steppability",),
    "values.robot_state": ("RobotState",),
    "values.sensing": ("FootContacts", "CameraIntrinsics"),
    "values.images": ("AffordanceImage", "LabelImage", "EgocanImage", "SuperpixelImage"),
    "values.regions": ("PlanarRegion", "RegionSet"),
    "values.plans": ("PlanRequest", "TorsoPath", "Stance", "FootholdPlan", "PlanSketch"),
    "values.swing_plan": ("SwingPlan",),
    "values.contact_schedule": ("ContactSchedule",),
    "values.reference": ("FootholdTarget", "WholeBodyReference"),
    "values.mpc_policy": ("MpcPolicy",),
    "values.whole_body_command": ("WholeBodyCommand",),
    "values.status": ("SafetyStatus", "StageStatus", "PlannerStatus", "PlannerPhase"),
    "diagrams.planners": ("PlannerSetup",),
    "diagrams.region_sources": ("RegionSourceSetup",),
    "diagrams.state_estimators": ("EstimatorSetup",),
}
_MODULES = {"registries": "diagrams.registries"}
_HOME_OF = {name: module for module, names in _HOMES.items() for name in names}

__all__ = ["__version__", *sorted({**_HOME_OF, **_MODULES})]


def __getattr__(name: str):
    """Imports what is asked for when it is first asked for: Drake and numba take seconds, ``--help`` must not."""
    if name in _MODULES:
        value = importlib.import_module(f"{__name__}.{_MODULES[name]}")
    elif name in _HOME_OF:
        value = getattr(importlib.import_module(f"{__name__}.{_HOME_OF[name]}"), name)
    else:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__])
