"""What the paper says of its benchmark: QuadPiPS (2026), section VIII, Figure 14 and its text; ANYmal C in simulation."""

ROBOT = "anymal_c"
"""The robot of all its trials."""
TRIALS = 10
"""Of each planner in each environment."""
GOALS_REACHED = {
    "quadpips": {
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
    },
    "s_mpc": {
        "ramp_10": (10,),
        "stairs_10": (10,),
        "rubble": (8,),
        "pegboard": (10,),
        "balance_beam": (9,),
        "ramped_balance_beam": (9,),
        "ramped_stepping_stones": (9,),
        "sparse_stones": (3,),
        "winding_balance_beam": (0,),
    },
    "em_mpc": {
        "ramp_10": (9,),
        "stairs_10": (10,),
        "rubble": (9,),
        "pegboard": (7,),
        "balance_beam": (10,),
        "ramped_balance_beam": (1,),
        "ramped_stepping_stones": (0,),
        "sparse_stones": (0,),
        "obstructed_balance_beam": (1,),
        "winding_balance_beam": (0,),
    },
}
"""Trials that reached the goal, by planner and terrain; two numbers where the text (first) and the figure differ. S-MPC on
the obstructed beam is in the figure alone, without a number."""
INFERRED = {
    "quadpips": {"ramp_10", "rubble", "balance_beam"},
    "s_mpc": {"ramp_10", "stairs_10", "pegboard", "winding_balance_beam"},
    "em_mpc": {"stairs_10", "balance_beam", "winding_balance_beam"},
}
"""Where no count is told: no failure is mentioned, or no success."""


def goals_reached(robot: str, planner: str, terrain: str, difficulty: float | None = None) -> tuple[int, ...]:
    """The paper's counts, of TRIALS; none where it has none, as of terrains of another ``difficulty`` than their own."""
    as_published = robot == ROBOT and difficulty is None
    return GOALS_REACHED.get(planner, {}).get(terrain, ()) if as_published else ()


def published(robot: str, planner: str, terrain: str, difficulty: float | None = None) -> str:
    """The paper's count, as in "9/10", in brackets where it is inferred; empty where it has none (``goals_reached``)."""
    counts = " or ".join(f"{count}/{TRIALS}" for count in goals_reached(robot, planner, terrain, difficulty))
    return f"({counts})" if counts and terrain in INFERRED[planner] else counts
