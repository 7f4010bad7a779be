"""Tables about the recorder's records, in closed form."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from tactileq.benches.recorder.figure import figure_recorder
from tactileq.benches.recorder.section import recorder_section
from tactileq.benches.recorder.tables import held_table, moved_table, near_table
from tactileq.stimuli.planted.textures import PlantedSurface, planted_texture

RECORDS = pd.DataFrame(
    {
        "texture": ["oak", "oak", "ash"],
        "speed_mm_s": [100.0, 200.0, 100.0],
        "force_n": [1.0, 2.0, 0.5],
        "mean_speed_mm_s": [100.0, 202.0, 100.0],
        "mean_force_n": [1.0, 2.0, 0.5],
        "attempts": [1, 3, 1],
        "true_speed_mm_s": [101.0, 200.0, 100.0],
        "true_force_n": [1.0, 1.96, 0.5],
    }
)
HAND = pd.DataFrame(
    {
        "task": ["absolute", "relative", "absolute"],
        "participant_id": ["sub-01", "sub-01", "sub-02"],
        "texture": ["oak", "oak", "ash"],
        "model": ["full", "full", "simplified"],
        "trials": [2, 1, 1],
        "speed_mm_s": [100.0, 200.0, 50.0],
        "force_n": [1.0, 2.0, 3.0],
        "contact_s": [1.0, 2.0, 0.5],
        "presentations": [2.0, 3.0, 1.0],
    }
)


def test_the_worst_errors_of_each_texture() -> None:
    table = held_table(RECORDS).set_index("texture")
    assert list(table.index) == ["ash", "oak"] or list(table.index) == ["oak", "ash"]
    oak = table.loc["oak"]
    assert (oak["records"], oak["repeated"]) == (2, 1)
    assert oak["speed_error"] == pytest.approx(1.0)
    assert oak["force_error"] == pytest.approx(2.0)
    assert oak["speed_estimate_error"] == pytest.approx(1.0)
    assert oak["force_estimate_error"] == pytest.approx(100 * (2.0 / 1.96 - 1))
    assert table.loc["ash"].drop(["records"]).sum() == 0


def test_hands_are_weighted_by_their_time_in_contact() -> None:
    table = moved_table(HAND).set_index("participant_id")
    first = table.loc["sub-01"]
    assert (first["trials"], first["presentations"], first["contact_s"]) == (3, 7, 4)
    assert first["speed_mm_s"] == pytest.approx(150.0)
    assert first["force_n"] == pytest.approx(1.5)


def test_a_model_that_is_twice_as_strong_is_six_decibels_farther() -> None:
    truth = planted_texture("canvas")
    louder = replace(truth, noise_gains=2 * truth.noise_gains, gains=2 * truth.gains)
    table = near_table({"canvas": (louder, truth)}, {"canvas": PlantedSurface("canvas")})
    row = table.iloc[0]
    assert row["direct_db"] < 0.3  # interpolated between the nodes, and warped at another rate
    assert row["recorder_db"] == pytest.approx(20 * np.log10(2), abs=0.3)
    assert row["difference_db"] == pytest.approx(row["recorder_db"] - row["direct_db"])


def test_the_chapter_shows_all_records_and_says_simulated() -> None:
    near = pd.DataFrame(
        {
            "texture": ["oak", "ash"],
            "recorder_db": [0.3, 0.2],
            "direct_db": [0.2, 0.2],
            "difference_db": [0.1, 0.0],
        }
    )
    section = recorder_section(RECORDS, near, HAND)
    assert all(item.simulated for item in section.items)
    assert "3 records" in section.answer
    assert "+0.050 dB" in section.answer
    assert "+0.100 dB" in section.answer
    figure = figure_recorder(RECORDS, near)
    force, speed, models = figure.axes
    assert force.lines[-1].get_ydata() == pytest.approx([0, -2, 0])
    assert speed.lines[-1].get_ydata() == pytest.approx([1, 0, 0])
    assert models.lines[-1].get_xdata() == pytest.approx([0.3, 0.2])
