"""Micro-controllers by name: their clock, their memory, and the cost of an operation."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from importlib import resources
from math import inf
from pathlib import Path
from typing import Any

from tactileq.modeling.checks import check_rate
from tactileq.modeling.errors import InputError, shown
from tactileq.modeling.files.columns import ABOVE_0, Column
from tactileq.modeling.files.tables import read_table

CONTROLLER_COLUMNS = (
    Column("name", description="By which scenes name it", required=True),
    Column("core", description="Its processor, with a floating-point unit", required=True),
    Column(
        "clock_hz",
        unit="Hz",
        description="The highest clock of the data sheet",
        limits=(ABOVE_0, inf),
        required=True,
    ),
    Column(
        "memory_bytes",
        unit="B",
        description="RAM; constants may stay in its flash memory",
        limits=(1, inf),
        whole=True,
        required=True,
    ),
    Column(
        "cycles_per_operation",
        description="Cycles of a floating-point operation, all else included",
        limits=(ABOVE_0, inf),
        required=True,
    ),
    Column("source", description="The data sheet", required=True),
)


@dataclass(frozen=True)
class MicroController:
    """What a micro-controller has for rendering in single precision.

    Parameters
    ----------
    core : str
        Its processor, with a floating-point unit.
    clock_hz : float
        The highest clock of the data sheet.
    memory_bytes : int
        RAM; constants may stay in its flash memory.
    cycles_per_operation : float
        Of a floating-point operation that `RenderPlan.cost` counts, all else included: instructions
        of an exported header, each taken as one cycle
        (docs/method/rendering.md#instructions-per-operation).
    source : str
        The data sheet.
    """

    name: str
    core: str
    clock_hz: float
    memory_bytes: int
    cycles_per_operation: float
    source: str

    def operations_per_sample(self, rate_hz: float) -> float:
        """Number of operations that fit between two samples, with nothing else running.

        Raises
        ------
        InputError
            For what is no sampling rate.
        """
        check_rate(rate_hz)
        return self.clock_hz / (rate_hz * self.cycles_per_operation)

    @staticmethod
    def named(name: str) -> MicroController:
        """One of those that come along; InputError, with all their names, for another."""
        known = _shipped()
        if not (isinstance(name, str) and name in known):
            raise InputError(
                f"expected a micro-controller among {', '.join(known)}, got {shown(name)}; give "
                "one of them."
            )
        return known[name]


@cache
def _shipped() -> dict[str, MicroController]:
    folder = resources.files("tactileq.modeling.scenes") / "shipped"
    with resources.as_file(folder / "microcontrollers.tsv") as path:
        return load_microcontrollers(path)


def load_microcontrollers(path: Path) -> dict[str, MicroController]:
    """Micro-controllers by name, from a TSV with `CONTROLLER_COLUMNS`."""
    rows: list[dict[str, Any]] = [dict(row) for row in read_table(path, CONTROLLER_COLUMNS)]
    return {
        row["name"]: MicroController(**{c.name: row[c.name] for c in CONTROLLER_COLUMNS})
        for row in rows
    }
