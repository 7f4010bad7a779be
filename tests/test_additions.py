"""What an addition costs: a new command and a new task, each in a copy of the house."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
ROOMS = ("modeling", "stimuli", "rig", "experiments", "analysis", "tactileq")

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

from experiments.sessions.task import Task
from experiments.study.design import Trial, fisher_yates


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
TABLE = """    "pair": answer_columns(
        AnswerColumn(name="layout", description="Texture behind each button"),
        AnswerColumn(name="answer", description="Texture that was chosen"),
        AnswerColumn(name="correct", description="Whether it is right", limits=(0, 1)),
        RESPONSE_TIME,
        texture="Real surface",
        model="Model behind both virtual surfaces",
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
participants = 2
schedule = "interleaved"
repeats = 3
training_trials = 1
"""
MODELS = """
from modeling import Threshold, simplify
from stimuli.planted.textures import planted_texture
for name in ("canvas", "PVC"):
    model = planted_texture(name)
    model.save(f"models/{name}.json")
    simplify(model, Threshold.shipped("codec")).model.save(f"simplified/{name}.json")
"""
ANSWERS = """
from analysis.answers.loading import load_responses
found = load_responses("data")
pairs = found.answers["pair"]
assert not found.warnings, found.warnings
assert set(pairs["model"]) == {"full", "simplified"}
assert pairs.groupby(["participant_id", "texture", "model"]).size().tolist() == [3] * 8
assert len(found.training["pair"]) == 2
assert {len(layout.split("|")) for layout in pairs["layout"]} == {2}
"""


@pytest.fixture
def house(tmp_path: Path) -> Path:
    for room in ROOMS:
        kept_out = shutil.ignore_patterns("__pycache__")
        shutil.copytree(ROOT / room, tmp_path / "house" / room, ignore=kept_out)
    return tmp_path / "house"


def run(house: Path, *arguments: str, folder: Path | None = None) -> subprocess.CompletedProcess:
    return subprocess.run(
        [sys.executable, *arguments],
        cwd=folder or house,
        env={**os.environ, "PYTHONPATH": str(house), "COLUMNS": "100"},
        capture_output=True,
        text=True,
    )


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
    (house / "tactileq/commands/greet.py").write_text(COMMAND, encoding="utf-8")
    app = house / "tactileq/app.py"
    text = app.read_text(encoding="utf-8")
    last = '    "demo": "demo",\n'
    app.write_text(text.replace(last, last + '    "greet": "greet",\n'), encoding="utf-8")
    assert touched(house) == {"tactileq/app.py": 1, "tactileq/commands/greet.py": 15}
    assert "Greet somebody." in run(house, "-m", "tactileq", "--help").stdout
    assert "--seed" in run(house, "-m", "tactileq", "greet", "--help").stdout
    assert run(house, "-m", "tactileq", "greet", "you", "--seed", "4").stdout == "hello you, 4\n"
    refused = run(house, "-m", "tactileq", "greet", "4711")
    assert refused.returncode == 1
    assert refused.stderr == "error: expected a name of letters, got '4711'; spell it.\n"


def test_a_task_costs_its_file_and_the_columns_of_its_answers(house: Path, tmp_path: Path) -> None:
    """It can be planned, done at the console, simulated, stored and loaded."""
    (house / "experiments/tasks/pair.py").write_text(TASK, encoding="utf-8")
    tables = house / "modeling/files/answer_tables.py"
    tables.write_text(tables.read_text(encoding="utf-8").removesuffix("}\n") + TABLE)
    assert set(touched(house)) == {
        "experiments/tasks/pair.py",
        "modeling/files/answer_tables.py",
    }
    assert "|pair>" in run(house, "-m", "tactileq", "session", "--help").stdout
    work = tmp_path / "work"
    for folder in ("models", "simplified"):
        (work / folder).mkdir(parents=True)
    (work / "study.toml").write_text(STUDY)
    assert run(house, "-c", MODELS, folder=work).returncode == 0
    done = run(house, "-m", "tactileq", "simulate", "--study", "study.toml", folder=work)
    assert done.returncode == 0, done.stderr
    loaded = run(house, "-c", ANSWERS, folder=work)
    assert loaded.returncode == 0, loaded.stderr
