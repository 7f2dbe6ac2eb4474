"""``quadpips evaluate ...``: scores against the truth; one command for each thing that is scored."""

import typer

from quadpips_drake.cli.evaluation import (
    evaluate_experience,
    evaluate_growth,
    evaluate_latency,
    evaluate_motion_models,
    evaluate_network,
    evaluate_perception,
    evaluate_tracking,
)

app = typer.Typer(
    no_args_is_help=True,
    help="Score perception and the steppability network against the truth, and study walking, planning and computing time.",
)
app.command("perception", epilog=evaluate_perception.EPILOG)(evaluate_perception.perception)
app.command("network", epilog=evaluate_network.EPILOG)(evaluate_network.network)
app.command("gaits", epilog=evaluate_tracking.EPILOG_GAITS)(evaluate_tracking.gaits)
app.command("robustness", epilog=evaluate_tracking.EPILOG_ROBUSTNESS)(evaluate_tracking.robustness)
app.command("latency", epilog=evaluate_latency.EPILOG_LATENCY)(evaluate_latency.latency)
app.command("latency-sweep", epilog=evaluate_latency.EPILOG_SWEEP)(evaluate_latency.latency_sweep)
app.command("growth", epilog=evaluate_growth.EPILOG)(evaluate_growth.growth)
app.command("experience", epilog=evaluate_experience.EPILOG)(evaluate_experience.experience)
app.command("motion-models", epilog=evaluate_motion_models.EPILOG)(evaluate_motion_models.motion_models)
