"""What pages show runs: fenced blocks as they stand; of other commands, each option exists."""

from __future__ import annotations

import re
import shlex
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
import scipy.stats

from tactileq.analysis.answers.table_map import parse_map
from tactileq.experiments.study.study import Study
from tactileq.modeling import Scene
from tactileq.stimuli.sets.recipe import Recipe
from tests.end_to_end.conftest import Run, commands

ROOT = Path(__file__).parents[2]
PAGES = {
    path.relative_to(ROOT).as_posix(): path.read_text(encoding="utf-8")
    for path in (*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md"))
    if path.name != "CHANGELOG.md"
}


def blocks_of(page: str, kind: str) -> list[str]:
    """Fenced blocks of a kind, in their order."""
    return re.findall(rf"^```{kind}\n(.*?)^```", PAGES[page], flags=re.DOTALL | re.MULTILINE)


def commands_of(text: str) -> Iterator[str]:
    """The tactileq commands in lines that are shown as code."""
    for line in re.findall(r"^    (.*)$", text.replace("\\\n", ""), flags=re.MULTILINE):
        for part in re.split(r"&&", line):
            if re.match(r"\s*tactileq [\w-]", part):
                yield part.strip()
    yield from re.findall(r"`(tactileq [a-z][^`]*)`", text)


def unknown_in(line: str) -> list[str]:
    """The word that names no command, or the options that the command does not have."""
    words = [word.partition("=")[0] for word in shlex.split(line, comments=True)[1:]]
    command = commands()
    while (inner := getattr(command, "commands", None)) and words and words[0][0] not in "-…":
        alternatives = words[0].split("|")
        if not set(alternatives) <= set(inner):
            return words[:1]
        command, words = inner[alternatives[0]], words[1:]
    there = {"--help"}.union(*((*of.opts, *of.secondary_opts) for of in command.params))
    return [word for word in words if word.startswith("--") and word not in there]


@pytest.mark.parametrize("page", sorted(PAGES))
def test_every_command_of_a_page_and_its_options_exist(page: str) -> None:
    shown = [*commands_of(PAGES[page]), *"".join(blocks_of(page, "sh")).splitlines()]
    assert [(line, unknown) for line in shown if (unknown := unknown_in(line))] == []


def test_what_is_misspelt_is_found() -> None:
    assert unknown_in("tactileq model recordings/* --out models  # all --of them") == []
    assert unknown_in("tactileq model recordings/* --output models") == ["--output"]
    assert unknown_in("tactileq modle recordings/* --out models") == ["modle"]
    assert unknown_in("tactileq study checks study.toml") == ["checks"]


def test_every_fenced_block_is_run_by_some_test() -> None:
    kinds = {page: re.findall(r"^```(\w+)$", text, re.MULTILINE) for page, text in PAGES.items()}
    own_protocol = kinds.pop("docs/own-protocol.md")  # tests/test_own_protocol.py
    assert set(own_protocol) == {"python", "toml"}
    assert {page: found for page, found in kinds.items() if found} == {
        "README.md": ["python"],
        "docs/models.md": ["python", "toml"],  # its recipe: tests/stimuli/sets/test_recipe.py
        "docs/your-data.md": ["python", "r"],
        "docs/other-tables.md": ["toml", *["csv", "sh"] * 3, *["text", "sh"] * 2],
        "docs/method/publishing.md": ["python"],  # test_publish_command.py
        "docs/micro-controller.md": ["sh", "c", "c"],  # C: tests/stimuli/exports
        **{f"docs/{kind}-file.md": ["toml"] for kind in ("study", "scene", "recipe")},
    }


def test_the_tables_of_five_programs_are_read(main: Run, tmp_path: Path) -> None:
    page = "docs/other-tables.md"
    tables = [*blocks_of(page, "csv"), *blocks_of(page, "text")]
    lines = "".join(blocks_of(page, "sh")).splitlines()
    assert len(tables) == len(lines) == 5
    for table, line in zip(tables, lines, strict=True):
        words = shlex.split(line)[1:]
        (tmp_path / words[2]).write_text(table, encoding="utf-8")
        done = main(*words, "--out", words[2].partition(".")[0])
        assert done.returncode == 0, done.stderr
        found = pd.read_csv(
            tmp_path / words[2].partition(".")[0] / "tables/by_condition.tsv", sep="\t"
        )
        assert found["mean"].tolist() == [1.0 if "r.txt" in words[2] else 0.5, 0.5]
    (tmp_path / "roles.toml").write_text(blocks_of(page, "toml")[0], encoding="utf-8")
    mapping = parse_map([str(tmp_path / "roles.toml")])
    assert (mapping.factors, mapping.right) == (("model", "session"), "1")
    assert mapping.where == {"display": ("Trial", "Catch")}


@pytest.mark.parametrize(
    ("kind", "load"), [("study", Study.load), ("scene", Scene.load), ("recipe", Recipe.load)]
)
def test_the_example_of_a_file_is_read(kind: str, load: Any, tmp_path: Path) -> None:
    (text,) = blocks_of(f"docs/{kind}-file.md", "toml")
    (tmp_path / "example.toml").write_text(text, encoding="utf-8")
    shutil.copy(ROOT / "modeling/scenes/shipped/slow_light_touch.toml", tmp_path / "light.toml")
    assert load(tmp_path / "example.toml")


def test_ten_lines_end_in_a_figure(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (code,) = blocks_of("README.md", "python")
    assert len([line for line in code.splitlines() if line.strip()]) <= 10
    exec(compile(code, "README.md", "exec"), {})
    assert (tmp_path / "polyester.png").read_bytes().startswith(b"\x89PNG")


def test_the_lines_on_rendering_run(capsys: pytest.CaptureFixture[str]) -> None:
    (code,) = blocks_of("docs/models.md", "python")
    names: dict[str, Any] = {}
    exec(compile(code, "docs/models.md", "exec"), names)
    assert names["vibration"].shape == (5000,)
    assert names["vibration"].std() > 0
    assert float(capsys.readouterr().out.splitlines()[-1]) > 10


@pytest.fixture
def answers(simulated: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> pd.DataFrame:
    """A folder with a study's data; mean ratings of leather, by other code."""
    shutil.copytree(simulated, tmp_path / "data")
    monkeypatch.chdir(tmp_path)
    rows = []
    for folder in sorted(Path("data").glob("sub-*")):
        for file in folder.glob("ses-*/beh/*absolute_beh.tsv"):
            header, *lines = [line.split("\t") for line in file.read_text().splitlines()]
            for cells in lines:
                row = dict(zip(header, cells, strict=True))
                if row["phase"] == "main" and row["texture"] == row["virtual_texture"] == "leather":
                    rows.append((folder.name, row["model"], float(row["magnitude_similarity"])))
    table = pd.DataFrame(rows, columns=["participant", "model", "rating"])
    return table.groupby(["participant", "model"])["rating"].mean().unstack()


def test_pandas_reads_the_answers(
    answers: pd.DataFrame, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (code,) = blocks_of("docs/your-data.md", "python")
    exec(compile(code, "docs/your-data.md", "exec"), {})
    told = capsys.readouterr().out
    expected = scipy.stats.ttest_rel(answers["simplified"], answers["full"])
    assert told.strip() == str(expected)
    wide = pd.read_csv(tmp_path / "wide.csv", index_col=0)
    assert wide["leather full"].to_list() == pytest.approx(answers["full"].to_list())
    assert {"MDF full", "PVC simplified"} < set(wide.columns)


@pytest.mark.skipif(shutil.which("Rscript") is None, reason="expected R (tools/system-packages)")
def test_r_reads_the_answers(answers: pd.DataFrame) -> None:
    (code,) = blocks_of("docs/your-data.md", "r")
    run = subprocess.run(["Rscript", "-e", code], capture_output=True, text=True, timeout=500)
    assert run.returncode == 0, run.stderr
    expected = scipy.stats.ttest_rel(answers["simplified"], answers["full"])
    found = re.search(r"t = (\S+), df = (\d+), p-value = (\S+)", run.stdout)
    assert found is not None, run.stdout
    t, df, p = map(float, found.groups())
    assert (t, df, p) == (
        pytest.approx(expected.statistic, rel=1e-3),
        len(answers) - 1,
        pytest.approx(expected.pvalue, rel=1e-2),
    )


def test_a_model_becomes_a_header(main: Run, tmp_path: Path) -> None:
    (text,) = blocks_of("docs/micro-controller.md", "sh")
    for line in text.splitlines():
        done = main(*shlex.split(line, comments=True)[1:])
        assert done.returncode == 0, done.stderr
    assert "texture_canvas_key" in (tmp_path / "canvas.h").read_text(encoding="utf-8")


def test_the_index_has_all_pages_and_the_readme_is_short() -> None:
    index = PAGES["docs/README.md"]
    linked = set(re.findall(r"\]\(([\w/-]+\.md)\)", index))
    there = {page.removeprefix("docs/") for page in PAGES if page.startswith("docs/")}
    methods = {page for page in there if page.startswith("method/")} - {"method/README.md"}
    assert there - methods - linked == {"README.md"}
    linked_methods = set(re.findall(r"\]\(([\w-]+\.md)\)", PAGES["docs/method/README.md"]))
    assert {page.removeprefix("method/") for page in methods} <= linked_methods
    assert len(PAGES["README.md"].splitlines()) < 90
