"""Damage in what one participant's session stored costs that session, by name, and nothing else.

More mutations than in `make test-long`: TACTILEQ_MUTATIONS=1500 pytest --long -s THIS_FILE
"""

from __future__ import annotations

import os
import shutil
from collections import Counter
from functools import cache, partial
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tactileq.commands.results.analyze import read_answers
from tactileq.commands.study.status import study_status
from tactileq.experiments.sessions.kept.roster import Roster
from tactileq.experiments.sessions.store.withdrawing import files_of, withdraw
from tactileq.modeling import InputError
from tests.experiments.sessions.store.enrolling import enrolled
from tests.experiments.verification.small_studies import run_one, small_models, small_study
from tests.mutating import mutated

FEW = 10
MANY = int(os.environ.get("TACTILEQ_MUTATIONS", "300"))
DAMAGED = "sub-01"
SOURCE = f"sourcedata/{DAMAGED}/ses-01/{DAMAGED}_ses-01_task-absolute_"
ANSWERS = "sub-02/ses-01/beh/sub-02_ses-01_task-absolute_beh.tsv"
TEXTURES = ("canvas", "PVC")
STUDY = small_study(TEXTURES, participants=4)
KINDS = {
    "log": f"{SOURCE}log.jsonl",
    "manifest": f"{SOURCE}manifest.json",
    "hand": f"{SOURCE}hand.tsv",
    "presentations": f"{SOURCE}presentations.tsv",
    "roster": "sourcedata/roster.jsonl",
}


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three people; the one whose files are to be damaged has a complete session."""
    folder = tmp_path_factory.mktemp("good") / "data"
    for subject in (1, 2, 3):
        run_one(folder, STUDY, small_models(TEXTURES), subject=subject)
    return folder


def spoil(path: Path, seed: int) -> None:
    """Change a file at random; of a table half of the time one row only."""
    good = path.read_bytes()
    if path.suffix == ".tsv" and seed % 2:
        rows = good.split(b"\n")
        at = int(np.random.default_rng(seed).integers(1, len(rows) - 1))
        rows[at] = mutated(rows[at], seed)
        path.write_bytes(b"\n".join(rows))
    else:
        path.write_bytes(mutated(good, seed))


def answers_of(
    folder: Path, *people: str, exclude: tuple[str, ...] = (), unverified: str | None = None
) -> pd.DataFrame:
    """The ratings of some people, as `tactileq analyze` reads them."""
    found = read_answers({"": folder}, exclude, unverified=unverified).answers["absolute"]
    return found[found["participant_id"].isin(people)].reset_index(drop=True)


@cache
def good_answers(folder: Path) -> pd.DataFrame:
    """Those of the others before anything was damaged."""
    return answers_of(folder, "sub-02", "sub-03")


def complaint(error: Exception, what: str) -> str:
    if isinstance(error, InputError) and str(error).count("\n") == 0:
        return ""
    return f"{what}: {type(error).__name__}: {error}"


class Trial:
    """What happens after one mutation; `wrong` says what should not have."""

    def __init__(self, folder: Path, kind: str, *, good: Path) -> None:
        self.folder, self.kind, self.good = folder, kind, good
        self.wrong: list[str] = []

    def tries(self, what: str, work, *, must: bool = True):  # type: ignore[no-untyped-def]
        """What some work gives; None where it was refused, which it must not be if it must."""
        try:
            return work()
        except Exception as error:  # any but InputError is what this test is to find
            told = complaint(error, what)
            if must and not told:
                told = f"{what} was refused: {error}"
            self.wrong += [told] if told else []
            return None

    def run(self, capsys: pytest.CaptureFixture[str]) -> str:
        """All that others do meanwhile; how it came out in a word."""
        folder, roster = self.folder, self.kind == "roster"
        self.tries("status", lambda: study_status(data=folder))
        told = " ".join(capsys.readouterr().out.split())
        if roster:  # whose line was damaged is not known, so everybody's answers are in doubt
            others = self.tries("analysis for a reason", partial(self.others, unverified="lost"))
        else:
            others = self.tries("analysis of the others", self.others)
        if others is not None and not others.equals(good_answers(self.good)):
            self.wrong.append("other answers of the others")
        every = self.tries("analysis", lambda: answers_of(folder, DAMAGED), must=False)
        second = self.tries("a session", self.second_session, must=not roster)
        if second is not None and not list(folder.glob("sub-02/ses-01/beh/*relative_beh.tsv")):
            self.wrong.append("no tables of a session of another participant")
        self.enrol_somebody()
        before = files_of(folder, 3)
        withdrawn = self.tries("withdrawal", lambda: withdraw(folder, 3), must=not roster)
        if files_of(folder, 3) != (before if withdrawn is None else ()):
            self.wrong.append("a withdrawal that is neither refused nor done")
        if folder.joinpath(ANSWERS).read_bytes() != self.good.joinpath(ANSWERS).read_bytes():
            self.wrong.append("another table of another participant")
        if "damaged" in told:
            return "named" if every is not None else "named, and analysis asks for it"
        return "no difference" if every is not None else "analysis asks for it"

    def others(self, unverified: str | None = None) -> pd.DataFrame:
        left_out = (f"{DAMAGED}=damaged",)
        people = ("sub-02", "sub-03")
        return answers_of(self.folder, *people, exclude=left_out, unverified=unverified)

    def second_session(self) -> Path:
        return run_one(self.folder, STUDY, small_models(TEXTURES), task="relative", subject=2)[1]

    def enrol_somebody(self) -> None:
        """A number and a slot, unless the roster is damaged; never somebody else's."""
        person = self.tries("enrolment", lambda: enrolled(Roster(self.folder), None, 9), must=False)
        if person is not None and (person.subject <= 3 or person.slot <= 3):
            self.wrong.append(f"number {person.subject} and slot {person.slot} twice")


def test_damage_costs_what_is_damaged_and_nothing_else(
    study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    check_damaged(study, tmp_path, capsys, FEW)


@pytest.mark.long("mutations by the hundred")
@pytest.mark.timeout(max(600, 2 * MANY))
def test_damage_of_many_kinds(
    study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    check_damaged(study, tmp_path, capsys, MANY)


def check_damaged(
    study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], count: int
) -> None:
    """So many mutations of each kind in turn."""
    tally: Counter[tuple[str, str]] = Counter()
    wrong = []
    folder = tmp_path / "data"
    for seed in range(count):
        kind = list(KINDS)[seed % len(KINDS)]
        shutil.copytree(study, folder)
        spoil(folder / KINDS[kind], seed)
        trial = Trial(folder, kind, good=study)
        tally[kind, trial.run(capsys)] += 1
        wrong += [f"seed {seed} ({kind}): {told[:300]}" for told in trial.wrong]
        shutil.rmtree(folder)
    with capsys.disabled():
        if count > FEW:
            for (kind, outcome), count in sorted(tally.items()):
                print(f"{kind}: {outcome}: {count}")
            print(f"{len(wrong)} wrong of {count}")
    assert wrong == []
