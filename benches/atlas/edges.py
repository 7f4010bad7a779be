"""Where a method ceases to hold: a few runs along the axis, then bisection between two."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from tactileq.benches.atlas.case import FAILS, HOLDS, Case, Verdict

CELLS = {False: 3, True: 5}
# From mild to severe as long as a method holds: an edge is no single lucky run.
SEARCHED = {False: 3, True: 17}
BISECTIONS = {False: 2, True: 4}


@dataclass(frozen=True)
class Cell:
    """One run: its place on the axis, and its result."""

    value: float
    figure: float
    verdict: Verdict


@dataclass(frozen=True, kw_only=True)
class Examined:
    """One column of a case.

    Parameters
    ----------
    cells : tuple of Cell
        Evenly along the axis, from mild to severe.
    at_default : Cell or None
        The run at the default.
    holds_to : float
        The most severe value up to which the method holds in all runs, from the mild end on; NaN
        where it does not even hold there. The severe end of the axis where it holds throughout.
    fails_from : float
        The value from which on it fails; NaN where it does not within the axis.
    returns : bool
        Whether it holds again in some run beyond `holds_to`, so that there are several edges.
    runs : int
        Number of runs of the case.
    """

    case: Case
    column: str
    cells: tuple[Cell, ...]
    at_default: Cell | None
    holds_to: float
    fails_from: float
    returns: bool
    runs: int

    @property
    def holds_throughout(self) -> bool:
        """Whether no edge lies within the axis."""
        return all(cell.verdict == HOLDS for cell in self.cells)


def examine(case: Case, column: str, *, full: bool) -> Examined:
    """Cells and edges of one column of a case.

    The runs go from mild to severe in steps of 1/16 of the axis (1/2 in the reduced atlas) until
    one no longer holds. The edge is located by bisection between that one and the one before it,
    to 1/256 of the axis (1/8); likewise for failure. An edge is the most severe value up to which
    all runs held, so it is too mild by that much at most. What comes and goes within a step is
    missed.
    """
    probe = _Probe(case, column, full=full)
    count = CELLS[full]
    shares = [i / (count - 1) for i in range(count)]
    cells = tuple(probe(share) for share in shares)

    def edge(is_past: Callable[[Verdict], bool]) -> tuple[float, float] | None:
        steps = SEARCHED[full] - 1
        past = next((i for i in range(steps + 1) if is_past(probe(i / steps).verdict)), None)
        if past is None:
            return None
        if past == 0:
            return float("nan"), 0.0
        low, high = (past - 1) / steps, past / steps
        for _ in range(BISECTIONS[full]):
            middle = (low + high) / 2
            if is_past(probe(middle).verdict):
                high = middle
            else:
                low = middle
        return low, high

    not_held, failed = edge(lambda v: v != HOLDS), edge(lambda v: v == FAILS)
    default = case.axis.default
    return Examined(
        case=case,
        column=column,
        cells=cells,
        at_default=None if default is None else probe.at_value(default),
        holds_to=case.axis.severe if not_held is None else case.axis.at(not_held[0]),
        fails_from=float("nan") if failed is None else case.axis.at(failed[1]),
        returns=not_held is not None and probe.holds_beyond(case.axis.at(not_held[1])),
        runs=probe.runs,
    )


class _Probe:
    """Runs of one column; none is repeated."""

    def __init__(self, case: Case, column: str, *, full: bool) -> None:
        self._case, self._column, self._full = case, case.columns[column], full
        self._done: dict[float, Cell] = {}

    @property
    def runs(self) -> int:
        return len(self._done)

    def __call__(self, share: float) -> Cell:
        return self.at_value(self._case.axis.at(share))

    def holds_beyond(self, value: float) -> bool:
        """Whether any run so far holds that is more severe than a value."""
        harder = 1 if self._case.axis.severe > self._case.axis.mild else -1
        return any(
            cell.verdict == HOLDS and (cell.value - value) * harder > 0
            for cell in self._done.values()
        )

    def at_value(self, value: float) -> Cell:
        if value not in self._done:
            figure = float(self._case.measure(value, self._column, full=self._full))
            self._done[value] = Cell(value, figure, self._case.verdict(figure))
        return self._done[value]


def columns_of(cases: Sequence[Case], *, full: bool) -> list[tuple[int, str]]:
    """Every column by its case's number and its name; in the reduced atlas one of each case."""
    return [
        (number, column)
        for number, case in enumerate(cases)
        for column in list(case.columns)[: None if full else 1]
    ]


def examine_column(cases: Sequence[Case], which: tuple[int, str], *, full: bool) -> Examined:
    """One of `columns_of`, in whatever process."""
    number, column = which
    return examine(cases[number], column, full=full)
