"""What a session keeps beside its answers: the hand's history, and what was presented."""

from __future__ import annotations

import io
from collections.abc import Iterator, Mapping, Sequence
from itertools import repeat
from math import inf

import numpy as np

from tactileq.experiments.sessions.kept.strokes import Outside, outside_grid
from tactileq.modeling import InputError
from tactileq.modeling.files.columns import Column
from tactileq.rig.shared.interface import (
    SURFACES,
    Acceleration,
    Fault,
    HandRows,
    PresentationRecord,
)

_CLOCK = "seconds since the rig was opened"
_NUMBER = (-inf, inf)


def _counted(name: str, description: str) -> Column:
    """A whole number that every row has."""
    return Column(name, description=description, limits=(0, 999_999_999), whole=True, required=True)


_RUN = _counted(
    "run",
    "In which start of the session, from 1; a trial that was interrupted in one is presented again "
    "in a later one, which has its answer",
)
_TRIAL = _counted("trial", "Number of the trial")
HAND_COLUMNS = (
    _RUN,
    _TRIAL,
    _counted("presentation", "Number of the presentation; 0 where nothing was presented"),
    Column(
        "time_s",
        unit="s",
        description=f"Time of the reading, {_CLOCK}",
        limits=_NUMBER,
        required=True,
    ),
    Column(
        "speed_mm_s",
        unit="mm/s",
        description="Tangential speed, its sign the direction; n/a where nothing measures it",
        limits=_NUMBER,
    ),
    Column(
        "force_n",
        unit="N",
        description="Normal force; n/a where nothing measures it",
        limits=_NUMBER,
    ),
    Column(
        "surface",
        description="What was presented",
        levels={
            "none": "nothing",
            "real": "the mounted real surface",
            "virtual": "a virtual surface",
        },
        required=True,
    ),
    Column(
        "force_assumed",
        description="Whether the force was not measured but assumed",
        levels={"1": "assumed", "0": "measured, or n/a"},
        required=True,
    ),
)
# Further columns of a session on a force device.
WALL_COLUMNS = (
    *(
        Column(name, unit="mm", description=what, limits=_NUMBER, optional=True)
        for name, what in (
            ("x_mm", "Position along the first axis of the wall; n/a where nothing measures it"),
            ("y_mm", "Position along the second axis of the wall"),
            ("depth_mm", "How far below the height of the wall, whether it is shown or not"),
        )
    ),
    Column(
        "force_commanded",
        description="Whether the force is what a device was told to push with, not sensed",
        levels={"1": "commanded", "0": "not"},
        required=True,
        optional=True,
    ),
    Column(
        "beyond_edge",
        description="Whether the tool was below the height of a wall that was shown, but beside it",
        levels={"1": "beside it", "0": "not"},
        required=True,
        optional=True,
    ),
)
_OUTSIDE = {
    "outside_share": "outside the model's grid of speeds and forces",
    "too_slow_share": "slower than its slowest condition",
    "too_fast_share": "faster than its fastest condition",
    "too_light_share": "lighter than its lightest condition (n/a where the force is assumed)",
    "too_hard_share": "harder than its hardest condition (n/a where the force is assumed)",
}
_COUNTERS = {
    "lift_offs": "Samples with a speed or force that is not a number",
    "above_grid": "Samples while the hand was faster or harder than the highest condition",
    "below_grid": "Samples while the hand was slower or lighter than the lowest condition",
    "clamped": "Parameters that were clamped to the legal range",
    "limited_peak": "Samples affected by the peak limit",
    "limited_rms": "Samples affected by the RMS limit",
    "limited_duration": "Samples muted by the duration limit",
}
PRESENTATION_COLUMNS = (
    _RUN,
    _TRIAL,
    _counted("presentation", "Number of the presentation, since the rig was opened"),
    Column(
        "surface", description="real or virtual", levels=dict.fromkeys(SURFACES, ""), required=True
    ),
    Column("texture", description="Of the real surface, or of the model"),
    Column(
        "model_sha256",
        description="Of the model, or of the file of a stimulus set; n/a of a real surface",
    ),
    Column(
        "start_s",
        unit="s",
        description=f"When its first sample was output, {_CLOCK}",
        limits=_NUMBER,
        required=True,
    ),
    Column(
        "end_s",
        unit="s",
        description=f"When its last sample was output, {_CLOCK}",
        limits=_NUMBER,
        required=True,
    ),
    *(
        Column(
            name,
            description=f"Share of the time with a moving hand on the surface, {what}",
            limits=_NUMBER,
        )
        for name, what in _OUTSIDE.items()
    ),
    *(Column(name, description=what, limits=_NUMBER) for name, what in _COUNTERS.items()),
    *(
        Column(name, unit=unit, description=what, limits=_NUMBER)
        for name, unit, what in (
            ("played_s", "s", "Duration of the vibration that was played"),
            ("dose_g2_s", "g²·s", "Its square over time, unweighted"),
            ("rms_g", "g", "Its RMS"),
            ("peak_g", "g", "Its largest absolute value"),
            ("misses", "", "Blocks that the sound card, or the device that renders, missed"),
            ("stale_blocks", "", "Blocks for which the hand was not read in time"),
        )
    ),
    Column("faults", description="Faults until the next presentation, separated by |"),
)


def hand_lines(trial: int, rows: HandRows, *, run: int, walls: bool = False) -> Iterator[str]:
    """The rows of a trial's history in one start of the session, as lines of the table.

    Written directly, since there are up to thousands in a second.

    Parameters
    ----------
    walls : bool
        Whether with WALL_COLUMNS.

    Raises
    ------
    InputError
        For an infinite number.
    """
    positions = ("x_mm", "y_mm", "depth_mm") if walls else ()
    measured = {
        name: getattr(rows, name) for name in ("time_s", "speed_mm_s", "force_n", *positions)
    }
    for name, values in measured.items():
        if np.isinf(values).any():
            raise InputError(f"expected a finite {name} of the hand, got infinity; present again.")
    columns = zip(
        rows.presentation.tolist(),
        *(measured[name].tolist() for name in ("time_s", "speed_mm_s", "force_n")),
        rows.surface.tolist(),
        rows.force_assumed.tolist(),
        _wall_cells(rows) if walls else repeat("", len(rows)),
        strict=True,
    )
    for presentation, time_s, speed_mm_s, force_n, surface, assumed, cells in columns:
        yield (
            f"{run}\t{trial}\t{presentation}\t{_number(time_s, 6)}\t{_number(speed_mm_s, 4)}\t"
            f"{_number(force_n, 5)}\t{SURFACES[surface]}\t{int(assumed)}{cells}\n"
        )


def _wall_cells(rows: HandRows) -> Iterator[str]:
    """The cells of WALL_COLUMNS, each after a tab."""
    positions = (rows.x_mm, rows.y_mm, rows.depth_mm)
    flags = (rows.force_commanded, rows.beyond_edge)
    for x_mm, y_mm, depth_mm, commanded, beyond in zip(
        *(values.tolist() for values in (*positions, *flags)), strict=True
    ):
        yield (
            f"\t{_number(x_mm, 4)}\t{_number(y_mm, 4)}\t{_number(depth_mm, 4)}\t{int(commanded)}"
            f"\t{int(beyond)}"
        )


def _number(value: float, digits: int) -> str:
    return "n/a" if value != value else f"{round(value, digits):.10g}"


def presentation_table(
    trial: int,
    records: Sequence[PresentationRecord],
    *,
    run: int,
    rows: HandRows,
    faults: Sequence[Fault],
) -> Iterator[Mapping[str, object]]:
    """The presentations of a trial in one start of the session, as the table holds them."""
    next_s = [*(record.start_s for record in records[1:]), inf]
    for record, until_s in zip(records, next_s, strict=False):
        outside = outside_grid(rows, [record]) or Outside()
        # A fault may be noticed when a presentation has ended.
        sentences = [fault.sentence for fault in faults if record.start_s <= fault.time_s < until_s]
        yield {
            "run": run,
            "trial": trial,
            "presentation": record.number,
            "surface": record.surface,
            "texture": record.texture,
            "model_sha256": record.model_sha256,
            "start_s": round(record.start_s, 6),
            "end_s": round(record.end_s, 6),
            **{f"{name}_share": share for name, share in vars(outside).items()},
            **vars(record.counters),
            "played_s": record.played_s,
            "dose_g2_s": record.dose_g2_s,
            "rms_g": record.rms_g,
            "peak_g": record.peak_g,
            "misses": record.misses,
            "stale_blocks": record.stale_blocks,
            "faults": " | ".join(sentences),
        }


def pen_file(piece: Acceleration) -> bytes:
    """A WAV file of 32-bit floats in g."""
    from scipy.io import wavfile  # late: takes longer to load than all of modeling

    buffer = io.BytesIO()
    wavfile.write(buffer, round(piece.rate_hz), piece.samples_g.astype(np.float32))
    return buffer.getvalue()
