"""The roster: numbers and slots are nobody else's, dropouts' slots pass on, codes tell nothing."""

from __future__ import annotations

import errno
import os
import re
import signal
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactileq.experiments.sessions.kept.roster import Roster
from tactileq.experiments.sessions.kept.writer import StoreError
from tactileq.modeling import InputError
from tactileq.modeling.files import places
from tactileq.modeling.files.reading import reason_of
from tests.experiments.sessions.store.enrolling import enrolled
from tests.refusals import refused


def test_everybody_gets_the_slot_of_the_own_number(tmp_path: Path) -> None:
    roster = Roster(tmp_path)
    people = [enrolled(roster, number, 4) for number in (2, None, None, 4)]
    assert [(p.subject, p.slot, p.known) for p in people] == [
        (2, 2, False),
        (1, 1, False),
        (3, 3, False),
        (4, 4, False),
    ]
    assert enrolled(roster, 3, 4) == enrolled(Roster(tmp_path), 3, 4)
    assert enrolled(roster, 3, 4).known
    assert enrolled(roster, 3, 4).code == people[2].code
    with refused(InputError, expected=["subject", 1, 4], got=5):
        enrolled(roster, None, 4)
    with refused(InputError, expected=["subject", 1], got=0):
        enrolled(roster, 0, 4)


def test_the_slot_of_a_dropout_passes_to_the_replacement(tmp_path: Path) -> None:
    roster = Roster(tmp_path)
    for number in range(1, 5):
        enrolled(roster, number, 4)
    roster.drop(3)
    roster.withdraw(2)
    first, second = enrolled(roster, 7, 4), enrolled(roster, None, 4)
    assert (first.subject, first.slot) == (7, 2)
    assert (second.subject, second.slot) == (5, 3)
    with refused(InputError, expected=["subject", 1, 4, "dropout"], got=8):
        enrolled(roster, 8, 4)
    with refused(InputError, got=["subject 3", "dropped"]):
        enrolled(roster, 3, 4)
    roster.drop(7)
    assert enrolled(roster, 8, 4).slot == 2


def test_a_subject_whose_own_slot_was_taken_gets_another(tmp_path: Path) -> None:
    roster = Roster(tmp_path)
    for number in (1, 2):
        enrolled(roster, number, 2)
    roster.drop(1)
    assert enrolled(roster, 3, 2).slot == 1
    assert enrolled(roster, 4, 4).slot == 4
    assert enrolled(roster, 5, 5).slot == 5
    with refused(InputError, expected=[2, "slots"], got=["subject 4", "slot 4"]):
        enrolled(roster, 4, 2)


@pytest.mark.usefixtures("unsynced")
@given(
    st.lists(
        st.tuples(st.sampled_from(["enroll", "drop", "withdraw"]), st.integers(1, 8)), max_size=40
    )
)
def test_no_slot_is_ever_held_by_two(
    tmp_path_factory: pytest.TempPathFactory, steps: list[tuple[str, int]]
) -> None:
    roster = Roster(tmp_path_factory.mktemp("data"))
    for what, subject in steps:
        try:
            if what == "enroll":
                enrolled(roster, subject, 5)
            else:
                getattr(roster, what)(subject)
        except InputError:
            pass
        held = [p["slot"] for p in roster.subjects().values() if not p["left"]]
        assert len(set(held)) == len(held)
        assert set(held) <= set(range(1, 6))


def test_codes_are_easy_to_say_and_nobody_elses(tmp_path: Path) -> None:
    roster = Roster(tmp_path)
    codes = [enrolled(roster, None, 200).code for _ in range(60)]
    assert len(set(codes)) == 60
    assert all(re.fullmatch(r"([KMNRST][AEIO]){2}-[1-9][0-9]", code) for code in codes)
    assert len({code[:4] for code in codes}) > 30
    assert enrolled(Roster(tmp_path / "b"), 7, 9, simulated=True).code == "SIM-007"


def test_a_withdrawal_takes_the_code_and_leaves_number_and_slot(tmp_path: Path) -> None:
    roster = Roster(tmp_path)
    code = enrolled(roster, 1, 3).code
    other = enrolled(roster, 2, 3).code
    roster.withdraw(1)
    assert code not in roster.path.read_text()
    assert other in roster.path.read_text()
    entry = roster.subjects()[1]
    assert (entry["slot"], entry["code"], entry["left"]) == (1, "", "withdrawn")
    with refused(InputError, got=["subject 1", "withdrew"]):
        enrolled(roster, 1, 3)
    for gone in (1, 9):
        with refused(InputError, expected="subject", got=[gone, roster.path]):
            roster.withdraw(gone)
        with refused(InputError, expected="subject", got=[gone, roster.path]):
            roster.drop(gone)


def test_people_and_simulations_are_never_one_subject(tmp_path: Path) -> None:
    roster = Roster(tmp_path)
    enrolled(roster, 1, 3)
    with refused(InputError, expected=["subject 1", "person", roster.path], got="simulated"):
        enrolled(roster, 1, 3, simulated=True)


def test_many_consoles_at_once_enroll_different_people(tmp_path: Path) -> None:
    with ThreadPoolExecutor(8) as pool:
        people = list(pool.map(lambda _: enrolled(Roster(tmp_path), None, 24), range(24)))
    assert sorted(p.subject for p in people) == list(range(1, 25))
    assert sorted(p.slot for p in people) == list(range(1, 25))
    assert len({p.code for p in people}) == 24


def test_behind_a_console_that_was_stopped_one_is_told_of_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(places, "WAIT_S", 0.2)
    stopped = os.fork()
    if not stopped:
        with Roster(tmp_path).enrolling(1, 3):
            os.kill(os.getpid(), signal.SIGSTOP)
        os._exit(0)
    os.waitpid(stopped, os.WUNTRACED)
    with refused(InputError, expected=tmp_path / "sourcedata", got=[stopped, "0.2 s"]):
        enrolled(Roster(tmp_path), 2, 3)
    os.kill(stopped, signal.SIGCONT)
    os.waitpid(stopped, 0)
    assert not enrolled(Roster(tmp_path), 2, 3).known
    assert sorted(Roster(tmp_path).subjects()) == [1, 2]


def test_a_half_written_line_enrolled_nobody(tmp_path: Path) -> None:
    roster = Roster(tmp_path)
    enrolled(roster, 1, 3)
    before = roster.path.read_bytes()
    enrolled(roster, 2, 3)
    line = roster.path.read_bytes()[len(before) :]
    for end in range(len(line)):
        roster.path.write_bytes(before + line[:end])
        assert set(roster.subjects()) == {1}
    assert not enrolled(roster, 2, 3).known
    assert set(roster.subjects()) == {1, 2}


def test_a_full_disk_enrolls_nobody(tmp_path: Path, file_size_limit: object) -> None:
    roster = Roster(tmp_path)
    enrolled(roster, 1, 3)
    before = roster.path.read_bytes()
    too_large = reason_of(OSError(errno.EFBIG, ""))
    facts = {"expected": roster.path, "got": too_large}
    with file_size_limit(len(before) + 20), refused(StoreError, **facts):
        enrolled(roster, 2, 3)
    assert roster.path.read_bytes() == before
    assert not enrolled(roster, 2, 3).known


ENROLLED = '{"utc": "", "event": "enrolled", "subject": %s, "slot": %s, "code": "TAKI-46", '
ENROLLED += '"simulated": false, "pilot": false}'


@pytest.mark.parametrize(
    "line",
    [
        '{"event": "enrolled"}',
        '{"event": "dropped", "subject": 9}',
        '{"event": "dropped", "subject": []}',
        '{"event": {}, "subject": 1}',
        "x",
        "[]",
        ENROLLED % ('"3"', 3),
        ENROLLED % (3, 2.5),
        ENROLLED % (3, 0),
        ENROLLED % (1, 3),
        ENROLLED % (1e400, 3),
    ],
)
def test_a_damaged_line_is_named_and_nobody_new_gets_what_may_stand_there(
    tmp_path: Path, line: str
) -> None:
    roster = Roster(tmp_path)
    first, last = enrolled(roster, 1, 4), enrolled(roster, 2, 4)
    one, other = roster.path.read_bytes().splitlines(keepends=True)
    roster.path.write_bytes(one + line.encode() + b"\n" + other)
    before = roster.path.read_bytes()
    assert roster.listed().damaged == f"line 2 of {roster.path}"
    for subject in (None, 3):
        with refused(InputError, expected="roster", got=["line 2", roster.path]):
            enrolled(roster, subject, 4)
    with refused(InputError, expected="subject", got=[3, "line 2", roster.path]):
        roster.withdraw(3)
    assert roster.path.read_bytes() == before
    # Who can be read goes on, drops out and withdraws; the damaged line stays for whose it is.
    assert [enrolled(roster, n, 4).code for n in (1, 2)] == [first.code, last.code]
    roster.drop(1)
    roster.withdraw(2)
    assert {n: p["left"] for n, p in roster.subjects().items()} == {1: "dropped", 2: "withdrawn"}
    assert line.encode() in roster.path.read_bytes()
    assert last.code.encode() not in roster.path.read_bytes()


def test_a_lost_line_of_who_left_gives_no_slot_to_two(tmp_path: Path) -> None:
    roster = Roster(tmp_path)
    enrolled(roster, 1, 2)
    roster.drop(1)
    assert enrolled(roster, 3, 2).slot == 1
    lines = roster.path.read_bytes().splitlines(keepends=True)
    roster.path.write_bytes(lines[0] + lines[2])
    with refused(InputError, expected=["slot 1", "subject 1"], got=["subject 3", roster.path]):
        enrolled(roster, 1, 2)
    assert enrolled(roster, 3, 2).slot == 1


def test_a_task_with_more_participants_gets_all_its_slots_after_a_dropout(tmp_path: Path) -> None:
    roster = Roster(tmp_path)
    for number in range(1, 21):
        enrolled(roster, number, 20)
    roster.drop(3)
    assert enrolled(roster, 21, 20).slot == 3
    slots = [enrolled(roster, number, 24).slot for number in (22, 23, 24, 25)]
    assert slots == [22, 23, 24, 21]
    with refused(InputError, expected=["subject", 1, 24], got=26):
        enrolled(roster, 26, 24)


def test_who_was_being_enrolled_when_something_failed_is_not(tmp_path: Path) -> None:
    roster = Roster(tmp_path)
    enrolled(roster, 1, 3)
    before = roster.path.read_bytes()
    with suppress(RuntimeError), roster.enrolling(2, 3):
        assert roster.subjects()[2]["slot"] == 2
        raise RuntimeError
    assert roster.path.read_bytes() == before
    assert enrolled(roster, None, 3).subject == 2
