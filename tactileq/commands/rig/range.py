"""tactileq rig range: the speeds and forces that a hand uses freely, and the grid to record."""

from __future__ import annotations

import time
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tactileq.commands.recording.audio import (
    HandOptions,
    hand_from,
    rig_from,
)
from tactileq.modeling.errors import counted
from tactileq.options import AssumedForce, CountsPerMm, HandDevice, HandKind, OptionalRigPath, Out
from tactileq.printing import share_of
from tactileq.results import CommandRun, FileResults

if TYPE_CHECKING:
    from tactileq.modeling.arrays import Floats
    from tactileq.rig.devices.hand.settings import HandSettings
    from tactileq.rig.recording.capture.cutting import Readings
    from tactileq.rig.recording.capture.exploration import Exploration
    from tactileq.rig.recording.capture.grid import StrokeGrid

STEP_S = 0.1
LONGEST_S = 600.0
BARS, BAR_WIDTH = 16, 40
COMMAND = "rig range"


def rig_range(
    out: Out = Path("grid.toml"),
    rig: OptionalRigPath = None,
    seconds: Annotated[float, typer.Option(min=6, max=LONGEST_S, help="Duration, s.")] = 30.0,
    speeds: Annotated[int, typer.Option(min=1, max=50, help="Number of speeds of the grid.")] = 7,
    forces: Annotated[int, typer.Option(min=1, max=50, help="Number of forces of the grid.")] = 7,
    hand: HandKind = None,
    hand_device: HandDevice = None,
    counts_per_mm: CountsPerMm = None,
    force: AssumedForce = None,
) -> None:
    """Explore a surface freely, to find the grid to record: up to the 95th percentile.

    A mouse measures no force; the grid then has the assumed force only.

    Example: tactileq rig range --rig rig.toml --seconds 30 --out grid.toml
    """
    from tactileq.rig.recording.capture.exploration import explored, grid_for, grid_text

    ran = CommandRun(COMMAND)
    results = FileResults([out], ran.command)
    settings = hand_from(rig_from(rig, ran), HandOptions(hand, hand_device, counts_per_mm, force))
    found = explored(watched(settings, seconds))
    grid = grid_for(found, speeds=speeds, forces=forces)
    print(picture(found, grid))
    origin = ran.provenance({"hand": asdict(settings), "seconds": seconds, **found.to_dict()})
    results.write({out: grid_text(grid, found).encode()}, origin)
    for note_on in notes_on(found, grid):
        print(note_on)
    speeds_of, forces_of = counted(grid.shape[0], "speed"), counted(grid.shape[1], "force")
    print(f"grid of {speeds_of} x {forces_of} in {out}")


def watched(settings: HandSettings, seconds: float) -> Readings:
    """The readings of a hand over this time."""
    import numpy as np

    from tactileq.rig.devices.hand.opening import opened_hand, since_now

    with opened_hand(settings) as (live, reader):
        readings, rows = since_now(live), []
        began_s = time.monotonic()
        with share_of("Stroke the surface as if to find out what it is") as advance:
            while (passed_s := time.monotonic() - began_s) < seconds:
                time.sleep(STEP_S)
                rows.append(readings())
                advance(passed_s / seconds, "")
            advance(1.0, "")
        for fault in reader.faults():
            typer.echo(f"warning: {fault}", err=True)
    return np.concatenate(rows)


def picture(found: Exploration, grid: StrokeGrid) -> str:
    """Both distributions as bars of characters, with the grid's steps marked."""
    parts = [
        bars("speed, mm/s", found.speed_mm_s, grid.speeds_mm_s, of=found.speed_percentiles_mm_s)
    ]
    if grid.shape[1] > 1:
        parts.append(bars("force, N", found.force_n, grid.forces_n, of=found.force_percentiles_n))
    return "\n".join(parts)


def bars(title: str, values: Floats, steps: Floats, *, of: dict[str, float]) -> str:
    """A horizontal histogram; `<` marks a step of the grid."""
    import numpy as np

    top = max(float(np.percentile(values, 99)), float(steps[-1]) * 1.05)
    counts, edges = np.histogram(values, bins=BARS, range=(0.0, top))
    lines = [f"{title}: " + ", ".join(f"{name} {value:.3g}" for name, value in of.items())]
    for count, low, high in zip(counts, edges[:-1], edges[1:], strict=True):
        bar = "#" * round(BAR_WIDTH * count / max(counts.max(), 1))
        inside = [f"{step:g}" for step in steps if low <= step < high]
        mark = f" < {', '.join(inside)}" if inside else ""
        lines.append(f"{low:8.3g} |{bar:<{BAR_WIDTH}}{mark}".rstrip())
    return "\n".join(lines) + "\n"


def notes_on(found: Exploration, grid: StrokeGrid) -> list[str]:
    """What the grid itself does not show."""
    notes = []
    if found.force_assumed:
        notes.append(
            f"note: nothing measures the force of this hand, so the grid has the assumed one, "
            f"{grid.forces_n[0]:g} N; press as hard as that, or use a tablet that measures "
            "pressure."
        )
    if found.simulated:
        notes.append("note: the hand is simulated.")
    return notes
