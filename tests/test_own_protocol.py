"""docs/own-protocol.md shows the code that runs."""

from __future__ import annotations

import re
from pathlib import Path

from experiments.study.study import Study

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
