"""What a session keeps beside its answers: the hand's history, and what was presented."""

from __future__ import annotations

import io
from collections.abc import Iterator, Mapping, Sequence
from math import inf
from typing import Any

import numpy as np

from experiments.sessions.strokes import Outside, outside_grid
from modeling import InputError
from rig.interface import SURFACES, Acceleration, Fault, HandRows, PresentationRecord

_CLOCK = "seconds since the rig was opened"
_RUN = {
    "run": {
        "Description": "In which start of the session, from 1; a trial that was interrupted in one "
        "is presented again in a later one, which has its answer"
    },
}
HAND_COLUMNS: dict[str, dict[str, Any]] = {
    **_RUN,
    "trial": {"Description": "Number of the trial"},
    "presentation": {"Description": "Number of the presentation; 0 where nothing was presented"},
    "time_s": {"Description": f"Time of the reading, {_CLOCK}", "Units": "s"},
    "speed_mm_s": {
        "Description": "Tangential speed, its sign the direction; n/a where nothing measures it",
        "Units": "mm/s",
    },
    "force_n": {"Description": "Normal force; n/a where nothing measures it", "Units": "N"},
    "surface": {
        "Description": "What was presented",
        "Levels": {
            "none": "nothing",
            "real": "the mounted real surface",
            "virtual": "a virtual surface",
        },
    },
    "force_assumed": {
        "Description": "Whether the force was not measured but assumed",
        "Levels": {"1": "assumed", "0": "measured, or n/a"},
    },
}
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
PRESENTATION_COLUMNS: dict[str, dict[str, Any]] = {
    **_RUN,
    "trial": {"Description": "Number of the trial"},
    "presentation": {"Description": "Number of the presentation, since the rig was opened"},
    "surface": {"Description": "real or virtual"},
    "texture": {"Description": "Of the real surface, or of the model"},
    "model_sha256": {
        "Description": "Of the model, or of the file of a stimulus set; n/a of a real surface"
    },
    "start_s": {"Description": f"When its first sample was output, {_CLOCK}", "Units": "s"},
    "end_s": {"Description": f"When its last sample was output, {_CLOCK}", "Units": "s"},
    **{
        name: {"Description": f"Share of the time with a moving hand on the surface, {what}"}
        for name, what in _OUTSIDE.items()
    },
    **{name: {"Description": what} for name, what in _COUNTERS.items()},
    "played_s": {"Description": "Duration of the vibration that was played", "Units": "s"},
    "dose_g2_s": {"Description": "Its square over time, unweighted", "Units": "g²·s"},
    "rms_g": {"Description": "Its RMS", "Units": "g"},
    "peak_g": {"Description": "Its largest absolute value", "Units": "g"},
    "misses": {"Description": "Blocks that the sound card missed"},
    "stale_blocks": {"Description": "Blocks for which the hand was not read in time"},
    "faults": {"Description": "Faults until the next presentation, separated by |"},
}


def hand_lines(trial: int, rows: HandRows, *, run: int) -> Iterator[str]:
    """The rows of a trial's history in one start of the session, as lines of the table.

    Written directly, since there are up to thousands in a second.

    Raises
    ------
    InputError
        For an infinite number.
    """
    measured = {name: getattr(rows, name) for name in ("time_s", "speed_mm_s", "force_n")}
    for name, values in measured.items():
        if np.isinf(values).any():
            raise InputError(f"expected a finite {name} of the hand, got infinity; present again.")
    columns = zip(
        rows.presentation.tolist(),
        *(values.tolist() for values in measured.values()),
        rows.surface.tolist(),
        rows.force_assumed.tolist(),
        strict=True,
    )
    for presentation, time_s, speed_mm_s, force_n, surface, assumed in columns:
        yield (
            f"{run}\t{trial}\t{presentation}\t{_number(time_s, 6)}\t{_number(speed_mm_s, 4)}\t"
            f"{_number(force_n, 5)}\t{SURFACES[surface]}\t{int(assumed)}\n"
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
        told = [fault.told for fault in faults if record.start_s <= fault.time_s < until_s]
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
            "faults": " | ".join(told),
        }


def pen_file(piece: Acceleration) -> bytes:
    """A WAV file of 32-bit floats in g."""
    from scipy.io import wavfile  # late: takes longer to load than all of modeling

    buffer = io.BytesIO()
    wavfile.write(buffer, round(piece.rate_hz), piece.samples_g.astype(np.float32))
    return buffer.getvalue()
