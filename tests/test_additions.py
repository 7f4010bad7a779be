"""What an addition costs: a new command and a new task, each in a copy of the house."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pandas as pd
import pytest

ROOT = Path(__file__).parents[1]
ROOMS = ("modeling", "stimuli", "rig", "experiments", "analysis", "benches", "tactileq")

COMMAND = '''"""tactileq greet: a dummy."""

from __future__ import annotations

from tactileq.options import Seed


def greet(name: str, seed: Seed = 0) -> None:
    """Greet somebody.

    Example: tactileq greet you
    """
    if not name.isalpha():
        raise ValueError(f"expected a name of letters, got {name!r}; spell it.")
    print(f"hello {name}, {seed}")
'''

# Which of two virtual surfaces is the real one?
TASK = '''"""A dummy task: two alternatives, forced choice."""

from __future__ import annotations

from dataclasses import dataclass

from tactileq.experiments.sessions.loop.task import Task
from tactileq.experiments.study.design import Trial, fisher_yates


@dataclass(frozen=True, kw_only=True)
class PairTrial(Trial):
    layout: tuple[str, ...]


def _trials(occasion, order):
    study, rng = occasion.study, occasion.rng
    drafts = []
    for texture, model in order:
        other = fisher_yates([t for t in study.textures if t != texture], rng)[0]
        pair = tuple(fisher_yates([texture, other], rng))
        drafts.append({"texture": texture, "model": model, "layout": pair})
    return drafts


def _ask(respondent, trial, surfaces):
    choice = respondent.choose(trial, surfaces)
    answer = trial.layout[choice.button]
    return {
        "layout": "|".join(trial.layout),
        "answer": answer,
        "correct": int(answer == trial.texture),
        "response_time_s": choice.response_time_s,
    }


TASK = Task(
    name="pair",
    description="Which of two?",
    trial=PairTrial,
    trials=_trials,
    virtual=lambda models, trial: [models.of(t, trial.model) for t in trial.layout],
    begin=lambda trial, surfaces: surfaces.present_real(),
    ask=_ask,
)
'''
TABLE = """    "pair": answer_table(
        AnswerColumn(name="layout", description="Texture behind each button"),
        AnswerColumn(name="answer", description="Texture that was chosen"),
        AnswerColumn(name="correct", description="Whether it is right", limits=(0, 1)),
        RESPONSE_TIME,
        title="pair comparison",
        texture="Real surface",
        model="Model behind both virtual surfaces",
        chance=1 / 2,
    ),
}
"""
STUDY = """
name = "Pairs"
seed = 3
textures = ["canvas", "PVC"]
[trays]
canvas = "A"
PVC = "B"
[absolute]
participants = 1
schedule = "interleaved"
[relative]
participants = 2
schedule = "by-day"
[pair]
participants = 4
schedule = "interleaved"
repeats = 3
training_trials = 1
[[plan.claims]]
name = "pairs are told alike"
task = "pair"
measure = "correct"
models = ["full", "simplified"]
bounds = [-0.2, 0.2]
test = "equivalence"
"""
MODELS = """
from tactileq.modeling import Threshold, simplify
from tactileq.stimuli.planted.textures import planted_texture
for name in ("canvas", "PVC"):
    model = planted_texture(name)
    model.save(f"models/{name}.json")
    fewer = simplify(model, Threshold.shipped("codec"), criterion="paper-fft").model
    fewer.save(f"simplified/{name}.json")
"""
ANSWERS = """
from tactileq.analysis.answers.loading import load_responses
found = load_responses("data")
pairs = found.answers["pair"]
assert not found.warnings, found.warnings
assert set(pairs["model"]) == {"full", "simplified"}
assert pairs.groupby(["participant_id", "texture", "model"]).size().tolist() == [3] * 16
assert len(found.training["pair"]) == 4
assert {len(layout.split("|")) for layout in pairs["layout"]} == {2}
"""
# A chapter of the report on whatever is timed.
CHAPTER = '''"""When people answered."""

from __future__ import annotations

import pandas as pd

from tactileq.analysis.chapters.chapter import Answered
from tactileq.analysis.page.page import Table
from tactileq.analysis.page.sections import Section
from tactileq.modeling.files.columns import Column


def sections(answered: Answered) -> list[Section]:
    counts = [(task, len(answers)) for task, answers in answered.finished.items()]
    columns = (Column("task"), Column("trials"))
    table = Table(
        "by_hour",
        "Trials",
        "Counted.",
        pd.DataFrame(counts, columns=["task", "trials"]),
        columns,
        answered.responses.simulated,
    )
    return [Section("hours", "Answers by hour", (table,))]
'''
# Pictures take most of the time of a report; other tests draw them.
ANALYZE = """
from tactileq.analysis.report import report
from tactileq.app import app
report.png_of = lambda figure, *, dpi: (b"", "")
report.svg_of = lambda figure: (b"", "")
for data in ("data", "without"):
    app(["analyze", data, "--out", f"of-{data}"], standalone_mode=False)
"""


@pytest.fixture
def house(tmp_path: Path) -> Path:
    for room in ROOMS:
        kept_out = shutil.ignore_patterns("__pycache__")
        shutil.copytree(ROOT / room, tmp_path / "house" / room, ignore=kept_out, symlinks=True)
    return tmp_path / "house"


def run(house: Path, *arguments: str, folder: Path | None = None) -> subprocess.CompletedProcess:
    return subprocess.run(
        [sys.executable, *arguments],
        cwd=folder or house,
        env={**os.environ, "PYTHONPATH": str(house), "COLUMNS": "100"},
        capture_output=True,
        text=True,
    )


def succeed(house: Path, *arguments: str, folder: Path) -> str:
    """What a program printed that had to succeed."""
    done = run(house, *arguments, folder=folder)
    assert done.returncode == 0, done.stderr
    return done.stdout


def touched(house: Path) -> dict[str, int]:
    """Files of the copy that differ from the house's own, and by how many lines they are longer."""
    found = {}
    for path in (p for room in ROOMS for p in (house / room).rglob("*.py")):
        own = ROOT / path.relative_to(house)
        before = own.read_text(encoding="utf-8") if own.exists() else ""
        if (text := path.read_text(encoding="utf-8")) != before:
            name = path.relative_to(house).as_posix()
            found[name] = len(text.splitlines()) - len(before.splitlines())
    return found


def test_a_command_costs_one_file_and_one_line(house: Path) -> None:
    (house / "tactileq/commands/benches/greet.py").write_text(COMMAND, encoding="utf-8")
    app = house / "tactileq/app.py"
    text = app.read_text(encoding="utf-8")
    last = '    "demo": "benches.demo",\n'
    added = last + '    "greet": "benches.greet",\n'
    app.write_text(text.replace(last, added), encoding="utf-8")
    assert touched(house) == {"tactileq/app.py": 1, "tactileq/commands/benches/greet.py": 15}
    assert "Greet somebody." in run(house, "-m", "tactileq", "--help").stdout
    assert "--seed" in run(house, "-m", "tactileq", "greet", "--help").stdout
    assert run(house, "-m", "tactileq", "greet", "you", "--seed", "4").stdout == "hello you, 4\n"
    refused = run(house, "-m", "tactileq", "greet", "4711")
    assert refused.returncode == 1
    assert refused.stderr == "error: expected a name of letters, got '4711'; spell it.\n"


@pytest.fixture
def work(tmp_path: Path) -> Path:
    """A folder with the study that plans the added task, and room for its models."""
    work = tmp_path / "work"
    for folder in ("models", "simplified"):
        (work / folder).mkdir(parents=True)
    (work / "study.toml").write_text(STUDY)
    return work


@pytest.mark.long("a copy of the house that runs a study")
def test_a_task_costs_its_file_and_columns_and_a_chapter_its_folder_and_a_line(
    house: Path, work: Path
) -> None:
    """It can be planned, done at the console, simulated, stored, loaded and reported."""
    (house / "experiments/tasks/pair.py").write_text(TASK, encoding="utf-8")
    declared = house / "modeling/files/answer_tables.py"
    declared.write_text(declared.read_text(encoding="utf-8").removesuffix("}\n") + TABLE)
    assert set(touched(house)) == {
        "experiments/tasks/pair.py",
        "modeling/files/answer_tables.py",
    }
    add_a_chapter(house)
    assert touched(house)["analysis/report/report.py"] == 1
    assert "|pair>" in run(house, "-m", "tactileq", "session", "--help").stdout
    succeed(house, "-c", MODELS, folder=work)
    checked = succeed(house, "-m", "tactileq", "study", "check", "study.toml", folder=work)
    assert "pair: 4 participants, 1 session each, 1 training + 12 main trials" in checked
    assert "pairs are told alike: No equality unless full models are recognised" in checked
    succeed(house, "-m", "tactileq", "simulate", "--study", "study.toml", folder=work)
    succeed(house, "-c", ANSWERS, folder=work)
    # As it would be published, without what sessions wrote, and without the added task.
    left_out = shutil.ignore_patterns("sourcedata", "*_task-pair_*")
    shutil.copytree(work / "data", work / "without", ignore=left_out)
    succeed(house, "-c", ANALYZE, folder=work)
    reported, before = tables(work / "of-data"), tables(work / "of-without")
    page = (work / "of-data/report.html").read_text(encoding="utf-8")
    assert "<h2>Pair comparison: right answers</h2>" in page
    assert "<h2>Answers by hour</h2>" in page
    assert "Correct rates of the pair comparison, full and simplified models (SIMULATED)" in page
    assert_pairs_are_reported(reported, own_answers(work / "data"))
    assert_others_are_reported_as_before(reported, before)


def add_a_chapter(house: Path) -> None:
    """A folder, and a line in the list of chapters."""
    folder = house / "analysis/chapters/hours"
    folder.mkdir()
    (folder / "__init__.py").touch()
    (folder / "section.py").write_text(CHAPTER, encoding="utf-8")
    report = house / "analysis/report/report.py"
    text = report.read_text(encoding="utf-8")
    last = '    "reliability",\n'
    assert text.count(last) == 1
    report.write_text(text.replace(last, f'{last}    "hours",\n'), encoding="utf-8")


def assert_pairs_are_reported(reported: dict[str, pd.DataFrame], answers: pd.DataFrame) -> None:
    rates = reported["correct_rates_pair"].set_index(["model", "texture"])
    assert set(rates["simulated"]) == {"true"}
    cells = {model: own for model, own in answers.groupby("model")}
    assert cells.keys() == {"full", "simplified"}
    for model, own in cells.items():
        shares = {"all textures": own["correct"].mean()}  # every cell has three answers
        shares |= own.groupby("texture")["correct"].mean().to_dict()
        for texture, share in shares.items():
            assert float(rates.loc[(model, texture), "mean"]) == pytest.approx(share)
    claims = reported["claims"]
    claims = claims[claims["claim"] == "pairs are told alike"].set_index("texture")
    difference = cells["simplified"]["correct"].mean() - cells["full"]["correct"].mean()
    assert float(claims.loc["all textures", "mean_difference"]) == pytest.approx(difference)
    times = reported["speed_scores_pair"].groupby("model")["participant_id"].count()
    assert times.to_dict() == {"full": 4, "simplified": 4}


def assert_others_are_reported_as_before(
    reported: dict[str, pd.DataFrame], before: dict[str, pd.DataFrame]
) -> None:
    of_speed = ("scores", "cells", "quantiles", "right_and_wrong")
    assert reported.keys() - before.keys() == {
        *("correct_rates_pair", "speed_accuracy_pair", "time_ratio_pair"),
        *(f"speed_{name}_pair" for name in of_speed),
    }
    assert set(before["claims"]["claim"]) == {
        "rated similarity of vibration magnitude",
        "rated similarity of frequency pattern",
        "correct rate",
    }
    for name in before.keys() - {"provenance", "by_hour"}:
        table = reported[name]
        if "claim" in table:
            table = table[table["claim"] != "pairs are told alike"].reset_index(drop=True)
        pd.testing.assert_frame_equal(table, before[name], obj=name)


def tables(folder: Path) -> dict[str, pd.DataFrame]:
    """The tables beside a report, every cell as it stands there."""
    files = (folder / "tables").glob("*.tsv")
    return {path.stem: pd.read_csv(path, sep="\t", dtype=str) for path in files}


def own_answers(data: Path) -> pd.DataFrame:
    """The main trials of the added task as they were stored, of all participants."""
    files = sorted(data.glob("sub-*/ses-*/beh/*_task-pair_beh.tsv"))
    table = pd.concat([pd.read_csv(path, sep="\t") for path in files])
    return table[table["phase"] == "main"]
