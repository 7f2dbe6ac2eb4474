"""How far a bench is: a table that lives on a terminal, else a line for each trial that is over."""

from rich.console import Console, Group
from rich.live import Live
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.table import Table

from quadpips_drake.benchmark.bench.rows import told_in_one_line
from quadpips_drake.benchmark.bench.scores import tally

_SPEED_PERIOD = 3600.0
"""The remaining time goes by the trials of so long [s]: they take minutes, and not all the same."""


class BenchProgress:
    """Shows the trials that are over, the successes of each course and the remaining time; a context manager."""

    def __init__(self, console: Console, rows: list[dict], total: int, description: str = "trials"):
        """Args: where to show it; rows of trials that are over already; how many there are in all; what they are."""
        self._console, self._rows, self._total = console, list(rows), total
        columns = (TextColumn(description), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(), TextColumn("left:"))
        self._bar = Progress(*columns, TimeRemainingColumn(), console=console, speed_estimate_period=_SPEED_PERIOD)
        self._task = self._bar.add_task(description, total=total, completed=len(rows))
        self._live = Live(self._shown(), console=console, transient=True, auto_refresh=True, refresh_per_second=2)

    def __enter__(self) -> "BenchProgress":
        if self._console.is_terminal:
            self._live.start()
        return self

    def __exit__(self, *_):
        if self._console.is_terminal:
            self._live.stop()

    @property
    def done(self) -> int:
        """Trials that are over."""
        return len(self._rows)

    def note(self, row: dict) -> None:
        """Takes a trial that is over."""
        self._rows.append(row)
        self._bar.update(self._task, advance=1)
        if self._console.is_terminal:
            self._live.update(self._shown())
        if not row["success"] or not self._console.is_terminal:
            self.tell(f"[{self.done}/{self._total}] {told_in_one_line(row)}")

    def tell(self, text: str) -> None:
        """Prints a line, above the table where there is one."""
        self._console.print(text, markup=False)

    def _shown(self) -> Group:
        table = Table("robot", "terrain", "planner", "goals reached", box=None, padding=(0, 2))
        for (robot, terrain, planner), score in tally(self._rows, ("robot", "terrain", "planner")).items():
            table.add_row(robot, terrain, planner, f"{score.reached} of {score.trials}")
        return Group(table, self._bar)
