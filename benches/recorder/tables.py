"""Tables of a study on simulated devices: records, how near models are, what hands did."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd

from tactileq.analysis.columns import TEXTURE
from tactileq.analysis.textures.between import Truth, halfway, truth_summary
from tactileq.modeling import TextureModel
from tactileq.modeling.files.columns import Column
from tactileq.modeling.files.tables import read_table
from tactileq.rig.machines.recorder.store import RECORDER_COLUMNS, TABLE_NAME

HIGHEST_HZ, STEP_HZ = 1000.0, 5.0  # over which responses are compared
LOWEST_HZ = 20.0
HELD_COLUMNS = (
    TEXTURE,
    Column("records", format=".0f"),
    Column("repeated", "recorded more than once", format=".0f"),
    Column("speed_error", "largest error of the mean speed", "%", format=".2f"),
    Column("force_error", "largest error of the mean force", "%", format=".2f"),
    Column("speed_estimate_error", "largest error of the speed's estimate", "%", format=".2f"),
    Column("force_estimate_error", "largest error of the force's estimate", "%", format=".2f"),
)
NEAR_COLUMNS = (
    TEXTURE,
    Column("recorder_db", "from the recorder", "dB", format=".3f"),
    Column("direct_db", "in silico, directly", "dB", format=".3f"),
    Column("difference_db", "difference", "dB", format="+.3f"),
)
MOVED_COLUMNS = (
    Column("participant_id", "participant", is_name=True),
    Column("trials", format=".0f"),
    Column("presentations", "virtual surfaces presented", format=".0f"),
    Column("contact_s", "in contact with them", "s", format=".0f"),
    Column("speed_mm_s", "mean speed in contact", "mm/s", format=".0f"),
    Column("force_n", "mean force", "N", format=".2f"),
)


def records_of(folder: str | Path) -> pd.DataFrame:
    """The recorder's table in a folder of recordings, a row for each record."""
    return pd.DataFrame(read_table(Path(folder) / TABLE_NAME, RECORDER_COLUMNS))


def held_table(records: pd.DataFrame) -> pd.DataFrame:
    """Per texture the worst errors, in % of what was asked for.

    Of a simulated recorder the errors of mean speed and force are those of the mechanics, and those
    of the estimates are relative to them.

    Parameters
    ----------
    records : DataFrame
        `RECORDER_COLUMNS`, of a simulated recorder.

    Returns
    -------
    DataFrame
        `HELD_COLUMNS`.
    """
    true_speed, true_force = records["true_speed_mm_s"], records["true_force_n"]
    errors = pd.DataFrame(
        {
            "texture": records["texture"],
            "speed_error": _percent(true_speed, records["speed_mm_s"]),
            "force_error": _percent(true_force, records["force_n"]),
            "speed_estimate_error": _percent(records["mean_speed_mm_s"], true_speed),
            "force_estimate_error": _percent(records["mean_force_n"], true_force),
        }
    )
    worst = errors.groupby("texture", sort=False).max()
    groups = records.groupby("texture", sort=False)["attempts"]
    worst["records"], worst["repeated"] = groups.size(), groups.agg(lambda n: int((n > 1).sum()))
    return worst.reset_index()[[column.name for column in HELD_COLUMNS]]


def _percent(value: pd.Series, reference: pd.Series) -> pd.Series:
    return 100 * (value / reference - 1).abs()


def near_table(
    models: Mapping[str, tuple[TextureModel, TextureModel]], truths: Mapping[str, Truth]
) -> pd.DataFrame:
    """RMS distance of responses to the truth half-way between the recorded conditions.

    Parameters
    ----------
    models : mapping of texture to (TextureModel, TextureModel)
        Of the recorder's records, and of records in silico at exactly the conditions.
    truths : mapping of texture to Truth

    Returns
    -------
    DataFrame
        `NEAR_COLUMNS`.
    """
    rows = []
    frequencies = np.arange(LOWEST_HZ, HIGHEST_HZ, STEP_HZ)
    for texture, pair in models.items():
        places = halfway(pair[0].speeds_mm_s.tolist(), pair[0].forces_n.tolist())
        ours, direct = (
            truth_summary(one.peq, truths[texture], places, frequency_hz=frequencies)[0]
            for one in pair
        )
        rows.append((texture, ours, direct, ours - direct))
    return pd.DataFrame(rows, columns=[column.name for column in NEAR_COLUMNS])


def moved_table(hand: pd.DataFrame) -> pd.DataFrame:
    """What each participant's hand did on virtual surfaces.

    Parameters
    ----------
    hand : DataFrame
        From `tactileq.analysis.answers.hand.load_hand`.

    Returns
    -------
    DataFrame
        `MOVED_COLUMNS`; means are weighted by the time in contact.
    """
    rows = []
    for participant, own in hand.groupby("participant_id", sort=True):
        contact_s = own["contact_s"] * own["trials"]
        rows.append(
            (
                participant,
                own["trials"].sum(),
                (own["presentations"] * own["trials"]).sum(),
                contact_s.sum(),
                np.average(own["speed_mm_s"], weights=contact_s),
                np.average(own["force_n"], weights=contact_s),
            )
        )
    return pd.DataFrame(rows, columns=[column.name for column in MOVED_COLUMNS])
