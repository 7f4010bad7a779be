"""Answers to trials that were repeated because the rig had failed."""

from __future__ import annotations

import pytest

from tactileq.analysis.answers.loading import load_responses
from tactileq.modeling import InputError
from tests.refusals import refused

COLUMNS = (
    *("trial", "phase", "texture", "model", "tray", "first_surface", "magnitude_similarity"),
    *("frequency_similarity", "toggles", "response_time_s", "valid", "repeats", "simulated"),
)
VALID, REPEATS = COLUMNS.index("valid"), COLUMNS.index("repeats")


def answers(rows):
    """The rows with two more columns: all valid, no repeats."""
    return [[*row[:-1], "1", "n/a", row[-1]] for row in rows]


def repeat(row, *, number, valid="1"):
    again = list(row)
    again[0], again[VALID], again[REPEATS] = str(number), valid, row[0]
    return again


@pytest.fixture
def write(write_task, write_order, absolute_rows):
    """Writes answers, and the order of the fifteen planned trials."""

    def written(rows):
        path = write_task("absolute", rows, columns=COLUMNS)
        write_order("absolute", absolute_rows)
        return path

    return written


@pytest.fixture
def failed(absolute_rows):
    """A training trial and two main ones failed; the second main one again in its repeat."""
    training, *main = answers(absolute_rows)
    for row in (training, main[2], main[6]):
        row[VALID] = "0"
    return [
        training,
        repeat(training, number=16),
        *main,
        repeat(main[2], number=17),
        repeat(main[6], number=18, valid="0"),
    ]


def test_repeats_replace_what_failed_and_what_failed_is_counted(study_folder, write, failed):
    write(failed)
    responses = load_responses(study_folder)
    (told,) = responses.warnings
    assert told == (
        "sub-01 absolute ses-01: 4 of 18 answers left out, since the rig failed in their trials "
        "(3 repeated)."
    )
    main = responses.answers["absolute"]
    assert len(main) == 13
    assert 17 in main["trial"].tolist()
    assert not {4, 8, 18} & set(main["trial"])
    assert responses.training["absolute"]["trial"].tolist() == [16]


def test_a_session_that_ended_before_its_repeats_is_noticed(study_folder, write, failed):
    write(failed[:-1])
    told = load_responses(study_folder).warnings
    assert "sub-01 absolute ses-01 answered 15 of 16 main trials (ended early)." in told


@pytest.mark.parametrize(
    ("change", "facts"),
    [
        (lambda rows: [*rows, repeat(rows[5], number=19)], ["repeats n/a", "answer 19"]),
        (lambda rows: rows[:1] + rows[2:], ["trial 16", "answer 16"]),
        (lambda rows: [*rows[:-2], rows[-1], rows[-2]], ["trial 17", "answer 17", 18]),
        (lambda rows: [*rows[:-2], repeat(rows[5], number=17)], ["repeats 4", "answer 17", 5]),
        (
            lambda rows: [*rows[:-1], [*rows[-1][:REPEATS], "n/a", "false"]],
            ["repeats 8", "answer 18", "n/a"],
        ),
        (
            lambda rows: [*rows[:-1], [*rows[-1][:REPEATS], "6", "false"]],
            ["repeats 8", "answer 18", 6],
        ),
        (lambda rows: [*rows[:5], repeat(rows[4], number=17)], ["repeats n/a", "answer 6", 4]),
        (lambda rows: [*rows, repeat(rows[5], number=20)], ["trial 19", "answer 19", 20]),
        (lambda rows: [*rows, repeat(rows[-1], number=19)], ["repeats n/a", "answer 19", 18]),
    ],
    ids=[
        *("again", "left out", "swapped", "of a valid trial", "unnamed", "of another"),
        *("before the others", "a gap", "of a repeat"),
    ],
)
def test_any_other_order_of_repeats_is_refused(study_folder, write, failed, change, facts):
    write(change(failed))
    with refused(InputError, names=[*facts, "sub-01_ses-01_task-absolute_beh.tsv"]):
        load_responses(study_folder)


def test_a_planned_trial_that_is_called_a_repeat_is_refused(study_folder, write, absolute_rows):
    rows = answers(absolute_rows)
    rows[4][REPEATS] = "2"
    write(rows)
    with refused(InputError, expected=["trial 16", "answer 5"], got=5):
        load_responses(study_folder)


RESUMED = (*COLUMNS, "run")


@pytest.fixture
def resumed(write_task, write_order, absolute_rows):
    """Writes a session that was resumed after a long break, with training once more.

    Six trials are planned, two of them for training; `change` spoils the rows.
    """

    def written(change=lambda rows: rows):
        planned = [absolute_rows[0], [*absolute_rows[1]], *absolute_rows[2:6]]
        planned[1][1] = "training"
        rows = [[*row, "1"] for row in answers(planned)]
        later = [[*row, "2"] for row in answers(planned)]
        again = [[*repeat(row[:-1], number=number), "2"] for number, row in enumerate(later[:2], 7)]
        path = write_task(
            "absolute", change([*rows[:1], *rows[2:4], *again, *later[4:]]), columns=RESUMED
        )
        write_order("absolute", planned)
        return path

    return written


def test_training_may_end_early_and_begin_again(study_folder, resumed):
    resumed()
    responses = load_responses(study_folder)
    assert responses.warnings == ()
    assert responses.training["absolute"]["trial"].tolist() == [1, 7, 8]
    assert responses.answers["absolute"]["trial"].tolist() == [3, 4, 5, 6]
    assert responses.answers["absolute"]["run"].tolist() == [1, 1, 2, 2]


@pytest.mark.parametrize(
    ("change", "facts"),
    [
        (lambda rows: [[*rows[0][:-1], "3"], *rows[1:]], ["run 3", "answer 2", 1]),
        (lambda rows: [["2", *rows[0][1:]], *rows[1:]], ["trial 1", "answer 1", 2]),
        (lambda rows: [*rows, ["2", *rows[0][1:-1], "2"]], ["repeats", "answer 8", "n/a"]),
        (lambda rows: [*rows[:3], ["9", *rows[3][1:]], *rows[4:]], ["trial 7", "answer 4", 9]),
    ],
    ids=["earlier run", "second first", "training at the end", "not the next free"],
)
def test_other_orders_of_a_resumed_session_are_refused(study_folder, resumed, change, facts):
    resumed(change)
    with refused(InputError, names=[*facts, "sub-01_ses-01_task-absolute_beh.tsv"]):
        load_responses(study_folder)
