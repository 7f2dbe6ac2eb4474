"""A run from Python: the robot crosses stones by its own camera.  python examples/run_in_ten_lines.py [SECONDS]"""

import sys

import quadpips_drake as qp

config = qp.load_config(robot="anymal_c", terrain="stepping_stones", seed=0)
config.duration = float(sys.argv[1]) if len(sys.argv) > 1 else 60.0
config.stages.planning.footholds.gait = "standing_trot"  # any value of config.yaml is an attribute
trial = qp.Trial(config)
verdict = trial.run(progress=lambda time: print(f"\r{time:5.1f} s", end="", flush=True))
print(f"\r{verdict.reason}: {verdict.detail}")
print(f"{len(trial.log)} samples, {trial.result().replans} plans after the first, now at {trial.log.arrays()['p_WB'][-1]}")
