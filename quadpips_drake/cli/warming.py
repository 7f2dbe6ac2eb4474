"""Compiling of the numerical kernels before a command needs them, with a bar that says what it does."""

import time

from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from quadpips_drake.cli import console

TITLE = "compiling numerical kernels, once for this machine"


def compile_kernels() -> bool:
    """Compiles what is not compiled yet, with a process for each core; returns whether all is there then.

    What cannot be compiled ahead gets a line, and is left to whoever needs it first. Where nothing is to be done it says
    nothing.
    """
    from quadpips_drake.trials.warming.warm_up import cold_groups, warm_up_in_parallel

    groups = cold_groups()
    if not groups:
        return True
    started = time.monotonic()
    columns = (TextColumn(TITLE), BarColumn(), TimeElapsedColumn(), TextColumn("{task.description}"))
    if not console.messages.is_terminal:
        console.messages.print(f"{TITLE}: {', '.join(groups)}")
    with Progress(*columns, console=console.messages, transient=True, disable=not console.messages.is_terminal) as bar:
        task = bar.add_task("", total=len(groups))
        failures = warm_up_in_parallel(
            lambda now, done, total: bar.update(task, completed=done, total=total, description=", ".join(now))
        )
    for group, error in failures.items():
        reason = " ".join(str(error).split()) or type(error).__name__
        console.messages.print(f"{group}: not compiled ahead ({reason}); it is compiled when it is needed", markup=False)
    if len(failures) < len(groups):
        console.messages.print(f"compiled in {time.monotonic() - started:.0f} s")
    return not failures
