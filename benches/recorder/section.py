"""The chapter on simulated devices: the recorder's records, and hands on the cable device."""

from __future__ import annotations

import pandas as pd

from tactileq.analysis.page.page import Picture, Table
from tactileq.analysis.page.sections import Section
from tactileq.benches.recorder.figure import figure_recorder
from tactileq.benches.recorder.tables import (
    HELD_COLUMNS,
    MOVED_COLUMNS,
    NEAR_COLUMNS,
    held_table,
    moved_table,
)
from tactileq.modeling.errors import counted
from tactileq.modeling.files.columns import Columns


def recorder_section(records: pd.DataFrame, near: pd.DataFrame, hand: pd.DataFrame) -> Section:
    """What the devices did in a study on them.

    Parameters
    ----------
    records : DataFrame
        `tactileq.rig.machines.recorder.store.RECORDER_COLUMNS` of all textures.
    near : DataFrame
        From `tactileq.benches.recorder.tables.near_table`.
    hand : DataFrame
        From `tactileq.analysis.answers.hand.load_hand`.
    """
    held, moved = held_table(records), moved_table(hand)
    mean_db, worst_db = near["difference_db"].mean(), near["difference_db"].max()
    repeated = int(held["repeated"].sum())
    answer = (
        f"On simulated devices {counted(len(records), 'record')} were made "
        f"({repeated} of them more than once), with a mean force at most "
        f"{held['force_error'].max():.1f} % and a mean speed at most "
        f"{held['speed_error'].max():.1f} % off. Models of them are {mean_db:+.3f} dB farther from "
        "the planted truth, on average, than models of records at exactly the conditions, "
        f"{worst_db:+.3f} dB at worst. "
        f"{counted(len(moved), 'simulated hand')} moved on the wall for "
        f"{moved['contact_s'].sum():.0f} s."
    )
    return Section(
        "devices",
        "On simulated devices",
        (
            Picture(
                "recorder",
                "Errors of the recorder, and models of its records",
                "Left and middle: every record; grey: the tolerance of the recorder's own "
                "estimates, which friction of the contactor's motor puts off at low forces. Right: "
                "distance of the model's response to the true magnitude half-way between the "
                "recorded conditions, 20 to 1000 Hz.",
                figure_recorder(records, near),
                True,
            ),
            _table(
                "recorder_held",
                "What the recorder held",
                "Errors of means over a record, relative to what was asked for; those of the "
                "estimates, without a sensor of speed or force, relative to the mechanics.",
                held,
                HELD_COLUMNS,
            ),
            _table(
                "recorder_near",
                "Models beside those of the direct route",
                "RMS of the distances to the planted truth half-way between the recorded "
                "conditions. The vibration of either route is drawn from the planted spectra with "
                "the same noise; the recorder's at the speed and force that emerged.",
                near,
                NEAR_COLUMNS,
            ),
            _table(
                "device_moved",
                "Hands on the cable device",
                "Simulated hands that stroke the virtual wall of the simulated device in virtual "
                "time; the wall, the cables and the hand's own compliance decide the force.",
                moved,
                MOVED_COLUMNS,
            ),
        ),
        answer=answer,
    )


def _table(name: str, title: str, caption: str, table: pd.DataFrame, columns: Columns) -> Table:
    return Table(name, title, caption, table, columns, True)
