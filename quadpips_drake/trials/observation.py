"""What an onlooker sees of a running diagram, whoever plans in it."""

from dataclasses import dataclass

import numpy as np

from quadpips_drake.sensing.contact_sensing import links_touching_each_other, touching_links
from quadpips_drake.values.mpc_policy import MpcPolicy
from quadpips_drake.values.reference import WholeBodyReference
from quadpips_drake.values.robot_state import RobotState
from quadpips_drake.values.status import SafetyStatus
from quadpips_drake.values.whole_body_command import WholeBodyCommand


@dataclass(frozen=True, eq=False)
class Observation:
    """The true state of the robot, and what it is about."""

    robot_state: RobotState
    """As it really is."""
    foot_positions: np.ndarray
    """Centres of the feet in W [m], (4, 3)."""
    body_touches: bool
    """Whether the torso touches anything."""
    touching: tuple
    """Names of all links that touch anything other than with a foot."""
    reference: WholeBodyReference
    """What is being tracked."""
    command: WholeBodyCommand
    """What whole-body control tells the drives."""
    fallbacks: dict
    """How often tracking had to fall back so far: {stage: count}."""
    instabilities: dict
    """How often what has made the robot unstable: {"unstable_<event>": count}."""
    mpc_policy: MpcPolicy
    """What the MPC asks for."""
    safety_status: SafetyStatus
    """What the safety monitor makes of it."""
    itself: tuple
    """Pairs of names of its own links that touch each other."""


def read(diagram, port: str, context):
    """The value at an output port of the whole ``diagram``."""
    return diagram.GetOutputPort(port).Eval(context)


def observe(diagram, context) -> Observation:
    """Returns what there is to see at the context's time.

    Args:
        diagram: a QuadpipsDiagram or a WalkDiagram.
        context: its context.
    """
    state = read(diagram, "true_robot_state", context)
    policy, wbc = read(diagram, "mpc_policy", context), read(diagram, "wbc_status", context)
    safety = read(diagram, "safety_status", context)
    instabilities = {f"unstable_{event}": count for event, count in safety.counts_by_event().items()}
    contacts, geometries = read(diagram, "contact_results", context), diagram.station.contact_geometries
    links = touching_links(contacts, geometries)
    return Observation(
        robot_state=state,
        foot_positions=diagram.robot.foot_positions_W(state),
        body_touches="base" in links,
        touching=tuple(links),
        reference=read(diagram, "reference", context),
        command=wbc,
        fallbacks={
            "mpc": policy.fallbacks,
            "wbc": wbc.fallbacks,
            **instabilities,
        },
        instabilities=instabilities,
        mpc_policy=policy,
        safety_status=safety,
        itself=tuple(links_touching_each_other(contacts, geometries)),
    )
