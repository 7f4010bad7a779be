"""Write what follows from declarations: the tables of keys in docs/, and the JSON Schemas.

    python tools/docs_tables.py    # or make docs-tables

In a page, what stands between `<!-- keys: NAME -->` and `<!-- end -->` is replaced. A test finds
all of it current (tests/test_docs_tables.py).
"""

from __future__ import annotations

import re
from pathlib import Path

from modeling.files.describing import key_tables, schema_text
from tactileq.commands.schema import declared

ROOT = Path(__file__).parents[1]
PAGES = ("docs/scene-file.md", "docs/recipe-file.md", "docs/rig-file.md", "docs/study-file.md")
SCHEMAS = {
    "modeling/scenes/shipped/scene.schema.json": "scene",
    "docs/recipe.schema.json": "recipe",
    "rig/setup/rig.schema.json": "rig",
    "experiments/study/study.schema.json": "study",
}
_MADE = {"keys": lambda name: key_tables(declared(name))}
_MARKED = re.compile(r"(<!-- (\w+): (\S+) -->\n)(.*?)(<!-- end -->)", re.DOTALL)


def page(text: str) -> str:
    """A page with its tables as they are declared now."""
    return _MARKED.sub(lambda m: f"{m[1]}\n{_MADE[m[2]](m[3])}\n\n{m[5]}", text)


def generated() -> dict[str, str]:
    """What every page and schema should hold, by its path."""
    pages = {path: page((ROOT / path).read_text(encoding="utf-8")) for path in PAGES}
    return pages | {path: schema_text(declared(name)) for path, name in SCHEMAS.items()}


if __name__ == "__main__":
    for path, text in generated().items():
        (ROOT / path).write_text(text, encoding="utf-8")
