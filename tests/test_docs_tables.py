"""What is generated from declarations is current: tables in docs/ and JSON Schemas."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path
from types import ModuleType

import pytest

from tactileq.commands.study.schema import DECLARED, declared

ROOT = Path(__file__).parents[1]


def loaded() -> ModuleType:
    spec = importlib.util.spec_from_file_location("docs_tables", ROOT / "tools/docs_tables.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


TOOL = loaded()
PAGES, SCHEMAS = TOOL.PAGES, TOOL.SCHEMAS


@pytest.mark.parametrize("path", [*PAGES, *SCHEMAS])
def test_what_is_generated_is_current(path: str) -> None:
    there = (ROOT / path).read_text(encoding="utf-8")
    assert there == TOOL.generated()[path], f"{path} is not current; run make docs-tables"


def test_a_changed_table_is_renewed() -> None:
    text = (ROOT / "docs/scene-file.md").read_text(encoding="utf-8")
    assert TOOL.page(text.replace("0 to 20 Hz", "0 to 30 Hz")) == text


def test_every_kind_of_file_and_table_has_its_place_in_a_page() -> None:
    pages = "".join((ROOT / path).read_text(encoding="utf-8") for path in PAGES)
    assert set(re.findall(r"^<!-- keys: (\S+) -->$", pages, re.MULTILINE)) == set(DECLARED)
    assert set(re.findall(r"<!-- table: (\S+) -->", pages)) == set(TOOL.TABLES)


@pytest.mark.parametrize("path", SCHEMAS)
def test_shipped_files_name_the_schema_beside_them(path: str) -> None:
    schema = ROOT / path
    kind = declared(SCHEMAS[path])
    named = [
        file
        for file in schema.parent.glob("*.toml")
        if file.read_text(encoding="utf-8").startswith(f"#:schema ./{schema.name}\n")
    ]
    assert named, f"expected a TOML file that names {path}"
    for file in named:
        kind.load(file)
