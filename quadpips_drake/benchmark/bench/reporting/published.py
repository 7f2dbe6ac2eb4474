"""What the paper says of its benchmark: QuadPiPS (2026), section VIII, Figure 14 and its text; ANYmal C in simulation."""

ROBOT = "anymal_c"
"""The robot of all its trials."""
TRIALS = 10
"""Of each environment."""
GOALS_REACHED = {
    "ramp_10": (10,),
    "stairs_10": (9,),
    "rubble": (10,),
    "pegboard": (8,),
    "balance_beam": (10,),
    "ramped_balance_beam": (8,),
    "ramped_stepping_stones": (9,),
    "sparse_stones": (8,),
    "obstructed_balance_beam": (9, 10),
    "winding_balance_beam": (9,),
}
"""Trials that reached the goal, by terrain; two numbers where the text (first) and the figure differ."""


def published(robot: str, terrain: str) -> str:
    """The paper's count for a robot on a terrain, as in "9/10"; empty where it has none."""
    counts = GOALS_REACHED.get(terrain, ()) if robot == ROBOT else ()
    return " or ".join(f"{count}/{TRIALS}" for count in counts)
