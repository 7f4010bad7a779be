"""From answers to a table: the mean over people, bounds, and that a threshold is read from it."""

from __future__ import annotations

from pathlib import Path

import pytest

from tactileq.experiments.tasks.threshold_posterior import Answer, Estimate, answers_of, estimate
from tactileq.experiments.tasks.threshold_table import (
    THRESHOLD_TABLE_COLUMNS,
    mean_thresholds,
    read_answers,
    threshold_text,
)
from tactileq.modeling import InputError, Threshold
from tactileq.modeling.files.tables import read_table
from tests.experiments.tasks.planted_threshold import rows_of, write_answers
from tests.refusals import refused


def found(frequency_hz: float, level_db: float, **of: object) -> Estimate:
    values: dict[str, object] = {"sd_db": 1.5, "slope": 2.0, "lapse_rate": 0.02, "trials": 40}
    return Estimate(frequency_hz=frequency_hz, level_db=level_db, **(values | of))  # type: ignore[arg-type]


def answers(frequency_hz: float, threshold_db: float, *, highest_db: float = 14.0) -> list[Answer]:
    """Right above the threshold, half of them below."""
    levels_db = [threshold_db + step for step in (-12.0, -6.0, 6.0, 12.0) for _ in range(6)]
    return [
        Answer(
            frequency_hz=frequency_hz,
            level_db=level_db,
            correct=level_db > threshold_db or number % 2 == 0,
            highest_db=highest_db,
        )
        for number, level_db in enumerate(levels_db)
        if level_db <= highest_db
    ]


def session(*levels_db: float, **changes: object) -> list[dict[str, object]]:
    frequencies_hz = (20.0, 250.0, 1000.0)
    of = [a for f, db in zip(frequencies_hz, levels_db, strict=False) for a in answers(f, db)]
    return rows_of(of, **changes)


# --- Over people ----------------------------------------------------------------------------


def test_the_mean_and_its_interval_in_closed_form() -> None:
    people = {
        name: {20.0: found(20.0, level), 250.0: found(250.0, level - 10)}
        for name, level in (("sub-01", -30.0), ("sub-02", -34.0), ("sub-03", -26.0))
    }
    low, high = mean_thresholds(people)
    assert (low.frequency_hz, low.level_db, low.people, low.trials) == (20.0, -30.0, 3, 120)
    assert low.sd_db == pytest.approx(4.0)
    half_db = 4.302653 * 4.0 / 3**0.5  # Student's t with 2 degrees of freedom, 97.5 %
    assert low.interval_db == pytest.approx((-30 - half_db, -30 + half_db))
    assert high.level_db == pytest.approx(-40.0)


def test_of_one_person_the_interval_is_the_posteriors() -> None:
    (one, _) = mean_thresholds({"sub-01": {20.0: found(20.0, -30.0), 40.0: found(40.0, -31.0)}})
    assert one.interval_db == pytest.approx((-30 - 1.959964 * 1.5, -30 + 1.959964 * 1.5))


def test_where_somebody_feels_nothing_the_mean_is_a_bound() -> None:
    people = {
        "sub-01": {20.0: found(20.0, -30.0), 630.0: found(630.0, -10.0)},
        "sub-02": {20.0: found(20.0, -32.0), 630.0: found(630.0, 0.0, beyond="above")},
    }
    low, high = mean_thresholds(people)
    assert low.note == ""
    assert high.note == "1 of 2 above the highest amplitude: a lower bound"
    assert high.interval_db is None
    assert high.level_db == -5.0


def test_who_lapses_too_often_is_noted_beside_bounds() -> None:
    people = {
        "sub-01": {20.0: found(20.0, -30.0), 630.0: found(630.0, -10.0, more_lapses=True)},
        "sub-02": {20.0: found(20.0, -32.0), 630.0: found(630.0, 0.0, beyond="above")},
    }
    low, high = mean_thresholds(people)
    assert low.note == ""
    assert high.note.startswith("1 of 2 above the highest amplitude")
    assert "; 1 of 2 more lapses than assumed" in high.note
    alone = mean_thresholds({"sub-01": people["sub-01"]})
    assert [one.note[:12] for one in alone] == ["", "more lapses "]
    assert alone[1].interval_db is not None
    text = threshold_text(alone, people=1, simulated=True)
    assert "strong tones were missed more often" in text
    assert "only a bound" not in text


def test_one_frequency_is_no_table() -> None:
    with refused(InputError, expected="frequencies", got=1):
        mean_thresholds({"sub-01": {20.0: found(20.0, -30.0)}})


# --- Text -----------------------------------------------------------------------------------


def test_the_table_is_a_threshold_with_source_and_caveat(tmp_path: Path) -> None:
    people = {
        "sub-01": {
            20.0: found(20.0, -20.0),
            250.0: found(250.0, -40.0),
            630.0: found(630.0, 14.0, beyond="above"),
        }
    }
    path = tmp_path / "mine.tsv"
    path.write_text(threshold_text(mean_thresholds(people), people=1, simulated=True))
    read = Threshold.load(path)
    assert read.name == "mine"
    assert read.frequency_hz.tolist() == [20.0, 250.0, 630.0]
    assert read.acceleration_g == pytest.approx([0.1, 0.01, 10**0.7], rel=1e-5)
    assert "1 person (simulated): two-interval forced choice" in read.source
    assert read.caveat.endswith("at 630 Hz only a bound (see note)")
    rows = read_table(path, THRESHOLD_TABLE_COLUMNS)
    assert [row["note"] and row["note"][:5] for row in rows] == [None, None, "above"]
    assert [row["low_g"] is None for row in rows] == [False, False, True]
    assert float(rows[0]["high_g"]) == pytest.approx(0.1 * 10 ** (1.959964 * 1.5 / 20), rel=1e-5)


def test_people_are_not_called_simulated() -> None:
    people = {"sub-01": {20.0: found(20.0, -20.0), 250.0: found(250.0, -40.0)}}
    text = threshold_text(mean_thresholds(people), people=1, simulated=False)
    assert "simulated" not in text


# --- Files ----------------------------------------------------------------------------------


def test_answers_are_read_from_the_files_of_one_or_all(tmp_path: Path) -> None:
    first = write_answers(tmp_path, 1, session(-30, -40, -10))
    second = write_answers(tmp_path, 2, session(-34, -44))
    both = read_answers(tmp_path)
    assert both.files == (first, second)
    assert both.simulated
    assert [list(own) for own in both.estimates.values()] == [[20.0, 250.0, 1000.0], [20.0, 250.0]]
    own = read_answers(tmp_path, subject=2).estimates
    assert list(own) == ["sub-02"]
    expected = estimate(answers_of(session(-34, -44)), 250.0)
    assert own["sub-02"][250.0] == expected
    assert expected.level_db == pytest.approx(-44.0, abs=4.0)


def test_pilots_and_training_are_no_data(tmp_path: Path) -> None:
    write_answers(tmp_path, 1, session(-30, -40, pilot="true"))
    write_answers(tmp_path, 2, session(-30, -40, phase="training"))
    for subject in (None, 1, 2, 3):
        with refused(InputError, expected=["threshold", tmp_path], got="tactileq session"):
            read_answers(tmp_path, subject=subject)


def test_people_and_simulated_ones_are_not_averaged(tmp_path: Path) -> None:
    write_answers(tmp_path, 1, session(-30, -40))
    write_answers(tmp_path, 2, session(-30, -40, simulated="false"))
    with refused(InputError, expected=["simulated", tmp_path], got="--subject"):
        read_answers(tmp_path)
    assert not read_answers(tmp_path, subject=2).simulated


def test_a_cut_file_is_refused(tmp_path: Path) -> None:
    path = write_answers(tmp_path, 1, session(-30, -40))
    path.write_bytes(path.read_bytes()[:-30])
    with pytest.raises(InputError, match="the table is damaged"):
        read_answers(tmp_path)
