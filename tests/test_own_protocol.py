"""docs/own-protocol.md shows the code that runs."""

from __future__ import annotations

import re
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest

from tactileq.analysis.answers.responses import Responses
from tactileq.analysis.labels import TASK_TITLES
from tactileq.analysis.report.report import write_report
from tactileq.analysis.statistics.rates import UNKNOWN_CHANCE
from tactileq.experiments.study.study import Study
from tactileq.modeling.files.answer_tables import ANSWER_TABLES, AnswerTable
from tests.analysis.conftest import choice_table

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs/own-protocol.md").read_text(encoding="utf-8")
SHOWN = ("experiments/tasks/oddity.py", "modeling/files/answer_tables.py")


def test_every_block_of_the_page_stands_in_the_code() -> None:
    code = "".join((ROOT / file).read_text(encoding="utf-8") for file in SHOWN)
    blocks = re.findall(r"```python\n(.*?)```", PAGE, flags=re.DOTALL)
    assert len(blocks) >= 6
    for block in blocks:
        assert block in code


def test_the_page_leaves_out_nothing_of_the_task_but_imports_docstrings_and_heads() -> None:
    code = (ROOT / "experiments/tasks/oddity.py").read_text(encoding="utf-8")
    _, _, body = code.partition("BUTTONS = 3\n")
    body = re.sub(r'"""(.*?)"""\n', "", body, flags=re.DOTALL)
    lines = [line for line in body.splitlines() if line.strip() and not line.startswith("# ---")]
    missing = [line for line in lines if line.strip() not in PAGE]
    assert all(line.startswith("def ") for line in missing), missing


def test_the_table_of_the_page_plans_the_task(tmp_path: Path) -> None:
    (table,) = re.findall(r"```toml\n(.*?)```", PAGE, flags=re.DOTALL)
    shipped = Study.load()
    path = tmp_path / "study.toml"
    text = (ROOT / "experiments/study/study.toml").read_text(encoding="utf-8")
    path.write_text(f"{text}\n{table}", encoding="utf-8")
    study = Study.load(path)
    assert study.plan_of("oddity").repeats == 6
    assert shipped.textures == study.textures


def test_the_last_step_tells_all_that_a_table_declares() -> None:
    _, _, step = PAGE.partition("## 7. In the report\n")
    declared = {field.name for field in fields(AnswerTable)} - {"columns"}
    rows = set(re.findall(r"^\| `(\w+)`", step, flags=re.MULTILINE))
    assert rows == declared | {"scale"}
    assert UNKNOWN_CHANCE in step


@pytest.mark.usefixtures("undrawn")
def test_the_last_step_names_the_tables_of_a_task(tmp_path: Path, monkeypatch) -> None:
    """Those of a task like the forced choice that is not the first of its kind."""
    again = replace(ANSWER_TABLES["relative"], title="choice once more")
    monkeypatch.setitem(ANSWER_TABLES, "again", again)
    monkeypatch.setitem(TASK_TITLES, "again", again.title)
    answers = {"again": choice_table(np.random.default_rng(1), people=8, repeats=1)}
    responses = Responses(answers, simulated_participants=True, simulated_rig=True)
    write_report(tmp_path / "report.html", responses=responses)
    written = {path.stem for path in (tmp_path / "tables").glob("*_again.tsv")}
    said = set(re.findall(r"`tables/(\w+)_TASK\.tsv`", PAGE))
    assert {f"{name}_again" for name in said} == {*written, "asked_again"}
