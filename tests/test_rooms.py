"""Rooms and floors: who imports whom, no circle, contracts that bite, faces that load late."""

from __future__ import annotations

import ast
import re
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

import tactileq.modeling
from tests.refusals import refused

ROOT = Path(__file__).parents[1]
ROOMS = ("modeling", "stimuli", "rig", "experiments", "analysis", "benches", "tactileq")


def name_of(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    own = parts if parts[0] == "tactileq" else ("tactileq", *parts)
    return ".".join(own).removesuffix(".__init__")


MODULES = {name_of(path): path for room in ROOMS for path in (ROOT / room).rglob("*.py")}
FACES = (tactileq, tactileq.modeling)
# A name asked of a face comes from the module that it lives in.
HOMES = {
    f"{face.__name__}.{name}": f"{face.__name__}.{module}"
    for face in FACES
    for module, names in face.HOMES.items()
    for name in names.split() or [module.rpartition(".")[2]]
}


def imported_by(path: Path) -> set[str]:
    """Modules of the house that one imports or names, late and for types alone included."""
    found = named_by(path)
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            for full in (f"{node.module}.{alias.name}" for alias in node.names):
                found.add(HOMES.get(full, full if full in MODULES else node.module))
    return found & set(MODULES)


def named_by(path: Path) -> set[str]:
    """Modules that one starts (`-m`) or loads by a string, `MODULE` or `MODULE:NAME`."""
    strings = (
        node.value.partition(":")[0].removesuffix(".")  # what an f-string begins with
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Constant) and isinstance(node.value, str)
    )
    return {name for name in strings if "." in name and name in MODULES}


def test_no_module_imports_itself_by_way_of_others() -> None:
    graph = {name: imported_by(path) - {name} for name, path in MODULES.items()}
    order = list(TopologicalSorter(graph).static_order())  # CycleError names a circle
    assert len(order) > 650
    # A face loads late what lives below it; nothing below imports it.
    for name, imports in graph.items():
        for face in FACES:
            assert face.__name__ not in imports or not name.startswith(face.__name__), name


def test_a_circle_would_be_seen(tmp_path: Path) -> None:
    late = tmp_path / "late.py"
    late.write_text(
        "from typing import TYPE_CHECKING\n"
        "if TYPE_CHECKING:\n    from tactileq.modeling import TextureModel\n"
        "def f():\n    from tactileq.analysis import labels\n    import tactileq.rig.desk.twin\n"
    )
    assert imported_by(late) == {
        "tactileq.modeling.models.texture_model",
        "tactileq.analysis.labels",
        "tactileq.rig.desk.twin",
    }


# A file, what it then imports, and the contract that forbids it.
PLANTED = {
    "modeling/models/grid.py": ("tactileq.stimuli.planted.textures", "Data flows one way"),
    "stimuli/sets/levels.py": ("tactileq.rig.desk.twin", "Data flows one way"),
    "analysis/labels.py": ("tactileq.experiments.study.study", "Data flows one way"),
    "rig/shared/interface.py": ("tactileq.app", "Data flows one way"),
    "modeling/equalizer/bands.py": ("tactileq.modeling.models.grid", "Floors of modeling"),
    "modeling/fitting/field.py": ("tactileq.modeling.regression.driving", "Floors of modeling"),
    "stimuli/planted/textures.py": ("tactileq.stimuli.sets.recipe", "Floors of stimuli"),
    "rig/recording/importing/files.py": ("tactileq.rig.desk.twin", "Floors of rig"),
    "experiments/study/study.py": (
        "tactileq.experiments.sessions.store.interface",
        "Floors of experiments",
    ),
    "analysis/statistics/holm.py": ("tactileq.analysis.figures.answers", "Floors of analysis"),
    "analysis/spectra/findings.py": ("tactileq.benches.rendering.bench", "Data flows one way"),
    "benches/rendering/clicks.py": ("tactileq.benches.atlas.tables", "Floors of the benches"),
    "analysis/chapters/hand/speed.py": (
        "tactileq.analysis.chapters.speed.section",
        "A chapter of the report imports no other",
    ),
    "tactileq/printing.py": ("tactileq.commands.benches.demo", "Data flows one way"),
    "modeling/perception/clock.py": ("time", "modeling is pure numerics"),
    "modeling/hand.py": ("random", "modeling is pure numerics"),
    "rig/desk/twin.py": ("tests", "Nobody imports tests"),
    "tactileq/newcomer.py": ("", "Data flows one way"),
    "rig/shared/live/clock.py": ("tactileq.rig.shared.setup.figures", "Floors of shared in rig"),
    "rig/devices/hand/events.py": ("tactileq.rig.devices.sound.played", "Floors of devices"),
    "rig/recording/importing/times.py": (
        "tactileq.rig.recording.capture.grid",
        "Floors of recording",
    ),
    "rig/machines/board/virtual.py": ("tactileq.rig.machines.device.models", "Floors of machines"),
    "experiments/sessions/kept/log.py": (
        "tactileq.experiments.sessions.loop.order",
        "Floors of sessions",
    ),
    "tactileq/commands/models/model.py": (
        "tactileq.commands.study.session",
        "Floors of the commands",
    ),
    "modeling/newcomer.py": ("", "Floors of modeling"),  # every module has its floor
}


@pytest.fixture(scope="module")
def house(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of all rooms, to plant imports in."""
    copy = tmp_path_factory.mktemp("house")
    for room in ROOMS:
        kept_out = shutil.ignore_patterns("__pycache__", "*.so", "*.tsv")
        shutil.copytree(ROOT / room, copy / room, ignore=kept_out, symlinks=True)
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
    return {name: " ".join(told[name].split()) for name in broken}


def test_all_contracts_are_kept(house: Path) -> None:
    assert broken_contracts(house) == {}


@pytest.fixture(scope="module")
def planted(house: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """The contracts that all planted imports together break; each is planted in a function."""
    house = shutil.copytree(house, tmp_path_factory.mktemp("planted") / "house", symlinks=True)
    for file, (module, _) in PLANTED.items():
        path = house / file
        before = path.read_text(encoding="utf-8") if path.exists() else '"""New."""\n'
        late = f"\n\ndef late() -> None:\n    {f'import {module}' if module else 'pass'}\n"
        path.write_text(before + late, encoding="utf-8")
    return broken_contracts(house)


@pytest.mark.parametrize("file", PLANTED)
def test_a_planted_import_breaks_its_contract(planted: dict[str, str], file: str) -> None:
    module, contract = PLANTED[file]
    importer = name_of(ROOT / file)
    (told,) = (told for name, told in planted.items() if name.startswith(contract))
    arrow = f" -> {module}" if module else ""
    assert re.search(rf"\b{re.escape(importer + arrow)}\b", told), told


# --- Arrows that import-linter does not see: names in strings, headers in C -----------------------

CONTRACTS = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"][
    "importlinter"
]["contracts"]
SOURCES = [
    path
    for room in ROOMS
    for path in (ROOT / room).rglob("*.[ch]")
    if not path.name.startswith("_")  # what cffi writes
]
# Who compiles a board says by its folders which machine's it is.
GIVEN_BY_THE_MACHINE = {"simulated.h"}


def broken_by(importer: str, imported: str) -> str:
    """The contract about floors that an arrow breaks; empty for none."""
    for contract in CONTRACTS:
        for container in contract.get("containers", ()):
            inside = f"{container}."
            if importer.startswith(inside) and imported.startswith(inside):
                one, other = (x.removeprefix(inside).split(".")[0] for x in (importer, imported))
                layers = [layer.split(" | ") for layer in contract["layers"]]
                floors = {name: n for n, layer in enumerate(layers) for name in layer}
                if one != other and floors[one] >= floors[other]:
                    return str(contract["name"])
    return ""


def included_by(path: Path, text: str) -> Iterator[Path]:
    """Headers that a C file includes, as the compiler finds them: beside it, or by their name."""
    for name in re.findall(r'^ *#include "(.+)"', text, flags=re.MULTILINE):
        beside = path.parent / name
        if beside.exists():
            yield beside
        elif name not in GIVEN_BY_THE_MACHINE:
            (only,) = (source for source in SOURCES if source.name == name)
            yield only


def test_names_of_modules_in_strings_go_no_floor_up() -> None:
    arrows = [(name, other) for name, path in MODULES.items() for other in named_by(path)]
    assert len(arrows) > 20
    assert [(*arrow, broken_by(*arrow)) for arrow in arrows if broken_by(*arrow)] == []


def test_headers_include_no_floor_up() -> None:
    arrows = [
        (name_of(path), name_of(other))
        for path in SOURCES
        for other in included_by(path, path.read_text(encoding="utf-8"))
    ]
    assert len(arrows) > 40
    assert [(*arrow, broken_by(*arrow)) for arrow in arrows if broken_by(*arrow)] == []


def test_an_arrow_up_would_be_seen_in_a_string_and_in_c(tmp_path: Path) -> None:
    board = "tactileq.rig.machines.board"
    planted = tmp_path / "planted.py"
    planted.write_text('WHAT = "tactileq.rig.machines.recorder.process"\n')
    (named,) = named_by(planted)
    assert broken_by(f"{board}.emulating", named) == "Floors of machines"
    header = ROOT / "rig/machines/board/boards/board.h"
    (included,) = included_by(header, '#include "../../recorder/simulated.h"\n')
    assert broken_by(f"{board}.boards.board", name_of(included.resolve())) == "Floors of machines"
    (included,) = included_by(header, '#include "control.h"\n')
    assert broken_by(f"{board}.boards.board", name_of(included)) == "Floors of machines"
    assert (
        broken_by("tactileq.modeling.files.seeds", "tactileq.rig.desk.twin") == "Data flows one way"
    )
    assert broken_by("tactileq.rig.desk.twin", "tactileq.modeling.files.seeds") == ""


# --- Start-up -------------------------------------------------------------------------------------


def test_an_import_is_planted_for_every_contract() -> None:
    for contract in CONTRACTS:
        assert any(contract["name"].startswith(name) for _, name in PLANTED.values()), contract


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
    assert {name for name in loaded if name.startswith("tactileq")} == {
        "tactileq",
        "tactileq.modeling",
        "tactileq.modeling.errors",
        "tactileq.modeling.face",
    }


HEAVY = {"scipy", "pandas", "matplotlib", "statsmodels", "psychopy"}


def test_help_loads_no_numerics() -> None:
    loaded = loaded_after(
        "from tactileq.app import app\ntry: app(['--help'])\nexcept SystemExit: pass"
    )
    assert "tactileq.commands.benches.demo" in loaded
    assert not (HEAVY | {"numpy"}) & set(loaded)


def test_no_public_name_of_modeling_loads_what_only_some_of_it_needs() -> None:
    # SciPy as a whole: importing any of its parts takes longer than all of the modeling.
    loaded = loaded_after(f"from tactileq import {', '.join(tactileq.modeling.__all__)}")
    assert "tactileq.modeling.rendering.renderer" in loaded
    assert not HEAVY & set(loaded)


@pytest.mark.parametrize("face", FACES, ids=lambda face: face.__name__)
def test_a_face_names_what_is_there_to_readers_and_at_run_time(face) -> None:  # type: ignore[no-untyped-def]
    named: set[str] = set()
    stub = Path(face.__file__).with_suffix(".pyi")
    for node in ast.parse(stub.read_text(encoding="utf-8")).body:
        assert isinstance(node, ast.ImportFrom)
        if [alias.name for alias in node.names] == ["*"]:
            named |= set(tactileq.modeling.__all__)
            continue
        for alias in node.names:
            home = HOMES[f"{face.__name__}.{alias.name}"]
            assert home in (node.module, f"{node.module}.{alias.name}")
            assert alias.asname == alias.name  # else it would be private there
            named.add(alias.name)
    assert named == set(face.__all__)
    for name in face.__all__:
        assert getattr(face, name) is not None
    assert set(face.__all__) <= set(dir(face))
    with refused(AttributeError, names=[f"'{face.__name__}'", "'nothing'"]):
        _ = face.nothing


def test_tests_mirror_the_rooms() -> None:
    inits = [path for path in MODULES.values() if path.name == "__init__.py"]
    packages = {path.parent.relative_to(ROOT) for path in inits}
    files = [path for room in ROOMS for path in (ROOT / "tests" / room).rglob("*.py")]
    folders = {path.parent.relative_to(ROOT / "tests") for path in files}
    assert folders <= packages
    tested = {above for folder in folders for above in (folder, *folder.parents)}
    for package in packages:
        room, *inner = package.parts
        grouped = room == "rig" or inner[:1] == ["sessions"]
        # Commands are tested from end to end.
        if room != "tactileq" and (len(inner) == 1 or grouped):
            assert package in tested or not any((ROOT / package).glob("[a-z]*.py")), package


def test_files_of_a_user_with_the_names_of_rooms_do_no_harm(tmp_path: Path) -> None:
    """The working folder comes first for `python -m` and for a script in it."""
    for room in ROOMS[:-1]:
        (tmp_path / f"{room}.py").write_text("raise ValueError('not this one')\n")
    script = tmp_path / "script.py"
    script.write_text("import tactileq as tq\nprint(tq.PEQ.__module__)\n")
    ways = {
        "tactileq.modeling.equalizer.peq": [script],
        "tactileq ": ["-m", "tactileq", "--version"],
    }
    for told, words in ways.items():
        run = subprocess.run(
            [sys.executable, *words], cwd=tmp_path, capture_output=True, text=True, check=True
        )
        assert run.stdout.startswith(told)
        assert run.stderr == ""
