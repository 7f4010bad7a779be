"""The hand at a regular rate, as BIDS stores what is measured all the time.

docs/method/protocols.md#bids
"""

from __future__ import annotations

import gzip
import io
from collections.abc import Sequence
from dataclasses import replace
from math import inf

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from tactileq.experiments.sessions.kept.log import Event
from tactileq.modeling.arrays import Floats
from tactileq.modeling.files.columns import Column
from tactileq.rig.shared.interface import SURFACES

RATE_HZ = 250.0
# Between readings further apart than this the hand's motion is unknown.
LONGEST_GAP_S = 0.02
# No table is longer than its readings warrant, whatever one of their times says: an hour of pauses,
# and fifty rows for each reading (readings come at 200 Hz and more while a hand is on a surface).
_LONGEST_PAUSE_S = 3600.0
_MOST_ROWS_PER_READING = 50

PHYSIO_COLUMNS = (
    Column(
        "speed_mm_s",
        unit="mm/s",
        description="Tangential speed, its sign the direction; linear between two readings; n/a "
        "where nothing measured it and between trials",
        limits=(-inf, inf),
    ),
    Column(
        "force_n",
        unit="N",
        description="Normal force; linear between two readings; n/a where nothing measured it and "
        "between trials",
        limits=(-inf, inf),
    ),
    Column(
        "surface",
        description="Surface presented at the last reading",
        levels={
            str(SURFACES.index("none")): "nothing",
            str(SURFACES.index("real")): "the mounted real surface",
            str(SURFACES.index("virtual")): "a virtual surface",
        },
    ),
    Column(
        "force_assumed",
        description="Whether the force of the last reading was not measured but assumed",
        levels={"1": "assumed", "0": "measured, or n/a"},
    ),
    Column("trial", description="Number of the trial", limits=(0, inf), whole=True),
    Column(
        "presentation",
        description="Number of the presentation since the rig was opened, as in the events; 0 "
        "where nothing was presented",
        limits=(0, inf),
        whole=True,
    ),
)
COMMANDED_COLUMNS = tuple(
    replace(
        column,
        description=f"{column.description}; commanded by a force device, not sensed; n/a on the "
        "real surface",
    )
    if column.name == "force_n"
    else column
    for column in PHYSIO_COLUMNS
)


def by_run(hand: pd.DataFrame) -> dict[int, pd.DataFrame]:
    """The readings of each start of a session, whose rig has a clock of its own, by its number."""
    runs = sorted(set(hand["run"].astype(int)))
    return {run: hand[hand["run"] == run] for run in runs}


def damaged_readings(hand: pd.DataFrame) -> str:
    """What is wrong with the times of one start's readings, by line; empty where nothing is.

    Parameters
    ----------
    hand : DataFrame
        time_s; its index the lines of the file.
    """
    time_s = hand["time_s"].sort_values(kind="stable")
    rows = (time_s.iloc[-1] - time_s.iloc[0]) * RATE_HZ
    if rows <= _LONGEST_PAUSE_S * RATE_HZ + _MOST_ROWS_PER_READING * len(time_s):
        return ""
    apart_s = np.diff(time_s.to_numpy(float))
    widest = int(np.argmax(apart_s))
    line = time_s.index[widest + 1]
    return f"line {line}, {apart_s[widest]:.3g} s after all readings before it, in"


def at_regular_times(hand: pd.DataFrame) -> pd.DataFrame:
    """Readings of one start of a session at 250 Hz, from the first one to the last.

    Parameters
    ----------
    hand : DataFrame
        trial, presentation, time_s, speed_mm_s, force_n, surface (a name), force_assumed; one row
        at least.

    Returns
    -------
    DataFrame
        One row every 4 ms, with `PHYSIO_COLUMNS`; NaN between trials, and between readings that are
        more than 20 ms apart.
    """
    hand = hand.sort_values("time_s", kind="stable")
    time_s = hand["time_s"].to_numpy(float)
    count = int(np.floor((time_s[-1] - time_s[0]) * RATE_HZ + 1e-6)) + 1
    grid_s = time_s[0] + np.arange(count) / RATE_HZ
    last = np.clip(np.searchsorted(time_s, grid_s + 1e-9, side="right") - 1, 0, None)
    following = np.minimum(last + 1, time_s.size - 1)
    between_s = time_s[following] - time_s[last]
    share = np.divide(
        grid_s - time_s[last], between_s, out=np.zeros(count), where=between_s > 0
    ).clip(0.0, 1.0)
    share[share < 1e-6] = 0.0
    trial = hand["trial"].to_numpy()
    known = (share == 0.0) | ((between_s <= LONGEST_GAP_S) & (trial[last] == trial[following]))
    linear = {
        name: _linear(hand[name].to_numpy(float), last, following, share)
        for name in ("speed_mm_s", "force_n")
    }
    codes = hand.assign(surface=hand["surface"].map(SURFACES.index))
    steps = {
        name: codes[name].to_numpy(float)[last]
        for name in ("surface", "force_assumed", "trial", "presentation")
    }
    # Without a decimal point, though there are gaps.
    found = pd.DataFrame({**linear, **steps})
    found.loc[~known] = np.nan
    return found.astype(dict.fromkeys(steps, "Int64"))


def _linear(
    values: Floats, last: NDArray[np.intp], following: NDArray[np.intp], share: Floats
) -> Floats:
    between = (1.0 - share) * values[last] + share * values[following]
    # At a reading itself the next one does not count: it may be NaN.
    at_reading = share == 0.0
    between[at_reading] = values[last[at_reading]]
    return between


def start_onset_s(
    hand: pd.DataFrame, events: Sequence[Event], onsets_s: Sequence[float], *, run: int
) -> float:
    """When the first reading of a start of the session was made, as an onset of an event.

    The clocks of log and rig are matched at the first presentation that has both.
    """
    first_s = float(hand["time_s"].min())
    of_run = [(e, onset) for e, onset in zip(events, onsets_s, strict=True) if e["run"] == run]
    for event, onset in of_run:
        if event["event"] == "presented" and isinstance(event.get("start_s"), int | float):
            return round(onset + first_s - float(event["start_s"]), 6)
    return round(of_run[0][1], 6)


def physio_bytes(regular: pd.DataFrame) -> bytes:
    """The compressed table, without header and without the time of compression."""
    text = io.StringIO()
    rounded = regular.round({"speed_mm_s": 4, "force_n": 5})
    rounded.to_csv(text, sep="\t", header=False, index=False, na_rep="n/a", lineterminator="\n")
    return gzip.compress(text.getvalue().encode(), mtime=0)
