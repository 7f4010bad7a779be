"""Rooms and floors: who imports whom, no circle, contracts that bite, faces that load late."""

from __future__ import annotations

import ast
import re
import shutil
import subprocess
import sys
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

from tactileq import experiments
from tactileq import modeling
from tests.refusals import refused

ROOT = Path(__file__).parents[1]
ROOMS = ("modeling", "stimuli", "rig", "experiments", "analysis", "benches", "tactileq")


def name_of(path: Path) -> str:
    name = ".".join(path.relative_to(ROOT).with_suffix("").parts)
    return name.removesuffix(".__init__")


MODULES = {name_of(path): path for room in ROOMS for path in (ROOT / room).rglob("*.py")}
# A name asked of a face comes from the module that it lives in.
HOMES = {
    f"{face.__name__}.{name}": f"{face.__name__}.{module}"
    for face in (modeling, experiments)
    for module, names in face.HOMES.items()
    for name in names.split() or [module]
}


def imported_by(path: Path) -> set[str]:
    """Modules of the house that one imports, late and for types alone included."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            for full in (f"{node.module}.{alias.name}" for alias in node.names):
                found.add(HOMES.get(full, full if full in MODULES else node.module))
    return found & set(MODULES)


def test_no_module_imports_itself_by_way_of_others() -> None:
    graph = {name: imported_by(path) - {name} for name, path in MODULES.items()}
    # The two faces name what lives below them; nothing below imports a face of its own room.
    inner = {name: imports for name, imports in graph.items() if name not in ROOMS}
    order = list(TopologicalSorter(inner).static_order())  # CycleError names a circle
    assert len(order) > 150
    for name, imports in inner.items():
        assert name.split(".")[0] not in imports, name


def test_a_circle_would_be_seen(tmp_path: Path) -> None:
    late = tmp_path / "late.py"
    late.write_text(
        "from typing import TYPE_CHECKING\n"
        "if TYPE_CHECKING:\n    from tactileq.modeling import TextureModel\n"
        "def f():\n    from tactileq.analysis import labels\n    import tactileq.rig.twin\n"
    )
    assert imported_by(late) == {
        "tactileq.modeling.models.texture_model",
        "tactileq.analysis.labels",
        "tactileq.rig.twin",
    }


PLANTED = {
    "modeling/models/grid.py": ("from tactileq.stimuli.planted import textures", "Data flows one way"),
    "stimuli/sets/levels.py": ("import tactileq.rig.twin", "Data flows one way"),
    "analysis/labels.py": ("import tactileq.experiments.study.study", "Data flows one way"),
    "rig/interface.py": ("import tactileq.app", "Data flows one way"),
    "modeling/equalizer/bands.py": ("import tactileq.modeling.models.grid", "Floors of modeling"),
    "modeling/fitting/field.py": ("import tactileq.modeling.regression.driving", "Floors of modeling"),
    "stimuli/planted/textures.py": ("import tactileq.stimuli.sets.recipe", "Floors of stimuli"),
    "rig/importing/files.py": ("import tactileq.rig.twin", "Floors of rig"),
    "experiments/study/study.py": ("import tactileq.experiments.sessions.store", "Floors of experiments"),
    "analysis/statistics/holm.py": ("import tactileq.analysis.figures.answers", "Floors of analysis"),
    "analysis/spectra/findings.py": ("import tactileq.benches.rendering.bench", "Data flows one way"),
    "benches/rendering/clicks.py": ("import tactileq.benches.atlas.tables", "Floors of the benches"),
    "analysis/chapters/hand/speed.py": (
        "import tactileq.analysis.chapters.speed.section",
        "A chapter of the report imports no other",
    ),
    "tactileq/printing.py": ("import tactileq.commands.demo", "Floors of the command line"),
    "modeling/perception/clock.py": ("import time", "modeling is pure numerics"),
    "modeling/hand.py": ("import random", "modeling is pure numerics"),
    "rig/twin.py": ("import tests.conftest", "Nobody imports tests"),
    "modeling/newcomer.py": ("", "Floors of modeling"),  # every module has its floor
}


@pytest.fixture(scope="module")
def house(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of all rooms, to plant imports in."""
    copy = tmp_path_factory.mktemp("house")
    for room in ROOMS:
        kept_out = shutil.ignore_patterns("__pycache__", "*.so", "*.tsv")
        shutil.copytree(ROOT / room, copy / room, ignore=kept_out)
    shutil.copy(ROOT / "pyproject.toml", copy)
    return copy


def broken_contracts(house: Path) -> dict[str, str]:
    """The contracts that a house breaks, each with the imports that do."""
    run = subprocess.run(
        [Path(sys.executable).with_name("lint-imports"), "--no-cache"],
        cwd=house,
        capture_output=True,
        text=True,
    )
    assert "Contracts:" in run.stdout, run.stdout + run.stderr
    broken = re.findall(r"^(.+) BROKEN", run.stdout, flags=re.MULTILINE)
    assert (run.returncode == 0) == (not broken)
    # Each broken contract has a part of its own below: its name, underlined, and the imports.
    parts = re.split(r"^(.+)\n-+$", run.stdout, flags=re.MULTILINE)
    told = dict(zip(parts[1::2], parts[2::2], strict=True))
    return {name: told[name] for name in broken}


def test_all_contracts_are_kept(house: Path) -> None:
    assert broken_contracts(house) == {}


@pytest.fixture(scope="module")
def planted(house: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """The contracts that all planted imports together break; each is planted in a function."""
    house = shutil.copytree(house, tmp_path_factory.mktemp("planted") / "house")
    for file, (line, _) in PLANTED.items():
        path = house / file
        before = path.read_text(encoding="utf-8") if path.exists() else '"""New."""\n'
        late = f"\n\ndef late() -> None:\n    {line or 'pass'}\n"
        path.write_text(before + late, encoding="utf-8")
    return broken_contracts(house)


@pytest.mark.parametrize("file", PLANTED)
def test_a_planted_import_breaks_its_contract(planted: dict[str, str], file: str) -> None:
    line, contract = PLANTED[file]
    importer = file.removesuffix(".py").replace("/", ".")
    (told,) = (told for name, told in planted.items() if name.startswith(contract))
    arrow = f" -> {line.split()[1].split('.')[0]}" if line else ""
    assert re.search(rf"\b{importer}{arrow}\b", told), told


def loaded_after(statements: str) -> list[str]:
    """All modules that a fresh process holds once it has run the statements."""
    program = f"import sys\n{statements}\nprint(*sys.modules)"
    run = subprocess.run(
        [sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=True
    )
    return run.stdout.splitlines()[-1].split()


def test_errors_load_neither_numerics_nor_the_rest_of_modeling() -> None:
    loaded = loaded_after("import tactileq.modeling.errors")
    assert "numpy" not in loaded
    assert {name for name in loaded if name.startswith("modeling")} == {
        "modeling",
        "tactileq.modeling.errors",
        "tactileq.modeling.face",
    }


HEAVY = {"scipy", "pandas", "matplotlib", "statsmodels", "psychopy"}


def test_help_loads_no_numerics() -> None:
    loaded = loaded_after(
        "from tactileq.app import app\ntry: app(['--help'])\nexcept SystemExit: pass"
    )
    assert "tactileq.commands.demo" in loaded
    assert not (HEAVY | {"numpy"}) & set(loaded)


def test_no_public_name_of_modeling_loads_what_only_some_of_it_needs() -> None:
    # SciPy as a whole: importing any of its parts takes longer than all of the modeling.
    loaded = loaded_after(f"from tactileq.modeling import {', '.join(modeling.__all__)}")
    assert "tactileq.modeling.rendering.renderer" in loaded
    assert not HEAVY & set(loaded)


@pytest.mark.parametrize("face", [modeling, experiments], ids=lambda face: face.__name__)
def test_a_face_names_what_is_there_to_readers_and_at_run_time(face) -> None:  # type: ignore[no-untyped-def]
    for_types: set[str] = set()
    tree = ast.parse(Path(face.__file__).read_text(encoding="utf-8"))
    (block,) = (
        node
        for node in tree.body
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"
    )
    # At the top `__getattr__` would let type checkers take every name for public.
    assert len(block.orelse) == 1
    assert "__getattr__" in ast.unparse(block.orelse[0])
    assert not any("__getattr__" in ast.unparse(n) for n in tree.body if n is not block)
    for node in block.body:
        assert isinstance(node, ast.ImportFrom)
        for alias in node.names:
            home = f"{node.module}.{alias.name}"
            assert HOMES[f"{face.__name__}.{alias.name}"] in (node.module, home)
            for_types.add(alias.name)
    assert for_types == set(face.__all__)
    for name in face.__all__:
        assert getattr(face, name) is not None
    assert set(face.__all__) <= set(dir(face))
    with refused(AttributeError, names=[f"'{face.__name__}'", "'nothing'"]):
        _ = face.nothing


def test_tests_mirror_the_rooms() -> None:
    for room in ROOMS[:-1]:
        inner = {path.name for path in (ROOT / room).iterdir() if (path / "__init__.py").exists()}
        tested = {path.name for path in (ROOT / "tests" / room).iterdir() if path.is_dir()}
        assert tested - {"__pycache__"} <= inner, room
        for package in inner - tested:
            assert not any((ROOT / room / package).glob("[a-z]*.py")), f"{room}/{package} untested"


def test_another_file_under_the_name_of_a_room_is_told_in_one_sentence(tmp_path: Path) -> None:
    """The working folder comes first for `python -m` and for a script in it."""
    other = tmp_path / "modeling.py"
    other.write_text("fit = None\n")
    (tmp_path / "analysis").mkdir()
    (tmp_path / "analysis/__init__.py").touch()
    began = subprocess.run(
        [sys.executable, "-m", "tactileq", "--help"], cwd=tmp_path, capture_output=True, text=True
    )
    assert began.returncode == 1
    assert began.stdout == ""
    [sentence] = began.stderr.splitlines()
    assert sentence.startswith("error: expected the packages modeling, ")
    assert f"got {other}, {tmp_path / 'analysis/__init__.py'} in place" in sentence
    script = tmp_path / "script.py"
    script.write_text(
        "for room in ('experiments', 'rig', 'stimuli'):\n"
        "    try:\n        __import__(room)\n"
        "    except ImportError as error:\n        print(error)\n"
        "import shutil; shutil.rmtree('analysis')\n"
        "import tactileq.analysis.columns\n"
    )
    run = subprocess.run(
        [sys.executable, script], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    told = [*run.stdout.splitlines(), run.stderr.splitlines()[-1].removeprefix("ImportError: ")]
    assert len(told) == 4
    assert len(set(told)) == 1
    assert f"from '{other}'>; rename that" in told[0]
