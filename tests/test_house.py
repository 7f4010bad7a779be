"""The house's own rules, as far as no tool checks them."""

from __future__ import annotations

import ast
import pkgutil
import re
import subprocess
from importlib import import_module
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
ROOMS = ("modeling", "stimuli", "rig", "experiments", "analysis", "benches", "tactileq")


def test_every_command_has_an_example() -> None:
    from tactileq.app import app

    groups = [app, *(group.typer_instance for group in app.registered_groups)]
    commands = [command for group in groups for command in group.registered_commands]
    assert len(commands) >= 16
    for command in commands:
        assert command.callback is not None
        assert "Example: tactileq " in (command.callback.__doc__ or ""), command.callback


def test_the_lock_pins_hashes_and_names_no_address() -> None:
    text = (ROOT / "requirements.lock").read_text(encoding="utf-8")
    assert "://" not in text
    requirements = re.split(r"\n(?=[a-z0-9])", text.split("\n", 2)[2])
    pinned = [r for r in requirements if re.match(r"[a-z0-9._-]+==", r)]
    assert len(pinned) > 100
    for requirement in pinned:
        assert "--hash=sha256:" in requirement, requirement.splitlines()[0]


PAGES = sorted(
    path.relative_to(ROOT).as_posix()
    for path in (*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md"))
)


def anchors_of(page: Path) -> set[str]:
    """Anchors of a page's headings, by the rule of the sites that show it."""
    headings = re.findall(r"^#+ (.+)$", page.read_text(encoding="utf-8"), flags=re.MULTILINE)
    plain = (re.sub(r"[^\w\- ]", "", heading.lower()) for heading in headings)
    return {words.replace(" ", "-") for words in plain}


@pytest.mark.parametrize("name", PAGES)
def test_pages_have_no_gaps_and_point_at_what_exists(name: str) -> None:
    text = (ROOT / name).read_text(encoding="utf-8")
    assert not re.search(r"@[A-Z]+@", text)
    for target, anchor in re.findall(r"\]\(([^)#: ]*)#?([^): ]*)\)", text):
        page = (ROOT / name).parent / target if target else ROOT / name
        assert page.exists(), target
        assert not anchor or anchor in anchors_of(page), f"{target}#{anchor}"


def test_every_cited_page_and_anchor_of_the_method_exists() -> None:
    cited: set[str] = set()
    for path in (p for room in (*ROOMS, "tests", "docs") for p in (ROOT / room).rglob("*.*")):
        if path.suffix in (".py", ".h", ".c", ".toml"):
            text = path.read_text(encoding="utf-8")
            cited |= set(re.findall(r"docs/method[\w./#-]*\w", text))
            # Sections of a page that no longer exists.
            assert not re.search(r"\bMETHOD [0-9]", text), path
    assert len(cited) > 50
    for citation in cited:
        page, _, anchor = citation.partition("#")
        assert (ROOT / page).exists(), citation
        assert not anchor or anchor in anchors_of(ROOT / page), citation


HOUSE = "modeling|stimuli|rig|experiments|analysis|tactileq"


@pytest.mark.parametrize("name", [page for page in PAGES if page != "CHANGELOG.md"])
def test_files_and_names_that_pages_mention_exist(name: str) -> None:
    text = (ROOT / name).read_text(encoding="utf-8")
    for path in re.findall(rf"`((?:{HOUSE}|tests|docs|tools)/[\w./-]+\.\w+)`", text):
        assert "NAME" in path or (ROOT / path).exists(), path
    for dotted in re.findall(r"`(tactileq(?:\.\w+)+)`", text):
        found, parts = pkgutil.resolve_name(dotted.split(".")[0]), dotted.split(".")[1:]
        for depth, part in enumerate(parts, start=1):
            if not hasattr(found, part):
                import_module(".".join(dotted.split(".")[: depth + 1]))  # a module, or an error
            found = getattr(found, part)


def constants_of(module: ast.Module) -> dict[str, str]:
    """The public constants of a module, with the code of their values."""
    found = {}
    for node in module.body:
        targets = node.targets if isinstance(node, ast.Assign) else []
        if isinstance(node, ast.AnnAssign) and node.value is not None:
            targets = [node.target]
        for target in targets:
            if isinstance(target, ast.Tuple) and isinstance(node.value, ast.Tuple):
                pairs = list(zip(target.elts, node.value.elts, strict=True))
            else:
                pairs = [(each, node.value) for each in ast.walk(target)]
            found |= {
                name.id: ast.unparse(value)
                for name, value in pairs
                if isinstance(name, ast.Name) and name.id.isupper() and name.id[0] != "_"
            }
    return found


def test_a_public_class_and_an_imported_constant_stand_for_one_thing() -> None:
    """No two modules define a class of one name; a constant that two of them give others is one."""
    modules = {}
    for room in ROOMS:
        for path in (ROOT / room).rglob("*.py"):
            name = ".".join(path.relative_to(ROOT).with_suffix("").parts)
            modules[name if room == "tactileq" else f"tactileq.{name}"] = ast.parse(
                path.read_text("utf-8")
            )
    assert len(modules) > 400
    classes: dict[str, list[str]] = {}
    for name, module in modules.items():
        for node in module.body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                classes.setdefault(node.name, []).append(name)
    assert {name: homes for name, homes in classes.items() if len(homes) > 1} == {}
    constants = {name: constants_of(module) for name, module in modules.items()}
    given: dict[str, dict[str, str]] = {}
    for module in modules.values():
        for node in ast.walk(module):
            if isinstance(node, ast.ImportFrom) and node.module in constants:
                own = constants[node.module]
                for one in node.names:
                    if one.name in own:
                        given.setdefault(one.name, {})[node.module] = own[one.name]
    assert len(given) > 200
    assert {name: homes for name, homes in given.items() if len(set(homes.values())) > 1} == {}


def test_every_folder_has_its_sentence_and_no_other_has_one() -> None:
    page = (ROOT / "docs/where.md").read_text("utf-8")
    rows = re.findall(r"^\| `([a-z_/]+)` \| (.+) \|$", page, flags=re.MULTILINE)
    assert all(len(sentence.split()) > 2 for _, sentence in rows)
    listed = subprocess.run(
        ["git", "ls-files", "-co", "--exclude-standard", *ROOMS],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    folders = {Path(file).parent.as_posix() for file in listed.stdout.splitlines()}
    assert sorted(folder.rstrip("/") for folder, _ in rows) == sorted(folders)


def test_the_roads_lead_through_modules_that_exist() -> None:
    """Of each road every file, in its order, and the next one is not far from it."""
    text = (ROOT / "ARCHITECTURE.md").read_text("utf-8")
    roads = re.findall(
        r"^## The road of (.+?)\n(.+?)(?=^## )", text, flags=re.MULTILINE | re.DOTALL
    )
    assert [name for name, _ in roads] == ["a recording", "a hand's reading", "an answer"]
    for _, road in roads:
        files = re.findall(r"`([\w/]+\.(?:py|h))`", road)
        assert len(files) > 10
        assert [file for file in files if not (ROOT / file).is_file()] == []
    assert len(text.split()) < 1000  # two pages
