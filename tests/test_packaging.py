"""What is released: a complete sdist, one wheel for all Pythons, extras and citation that agree."""

from __future__ import annotations

import importlib.util
import os
import re
import subprocess
import sys
import tarfile
import tomllib
from importlib.machinery import EXTENSION_SUFFIXES
from pathlib import Path
from typing import Any

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from tactileq.modeling.extras import CONSOLE_BEFORE, Extra
from tactileq.modeling.rendering import compiled
from tests.extras import NEEDING

ROOT = Path(__file__).parent.parent
HIDDEN = ("psychopy", "pyglet", "sounddevice", "serial", "plotly", "distributed")
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


@pytest.mark.skipif(not (ROOT / ".git").exists(), reason="the list of files is git's")
def test_the_sdist_holds_what_the_repository_holds(tmp_path: Path) -> None:
    build = [sys.executable, "setup.py", "-q", "egg_info", "--egg-base", tmp_path]
    subprocess.run([*build, "sdist", "--dist-dir", tmp_path], cwd=ROOT, check=True)
    (made,) = tmp_path.glob("*.tar.gz")
    with tarfile.open(made) as archive:
        held = {"/".join(name.split("/")[1:]) for name in archive.getnames()}
    tracked = subprocess.run(
        ["git", "ls-files"], cwd=ROOT, check=True, capture_output=True, text=True
    ).stdout.splitlines()
    assert set(tracked) <= held
    surplus = {name for name in held - set(tracked) if name.endswith((".c", ".so", ".pyc", ".py"))}
    assert not surplus


@pytest.mark.skipif(compiled.Call is None, reason="no kernel was compiled")
def test_every_c_part_keeps_to_the_stable_interface() -> None:
    """One wheel serves all versions of Python only if no part is built for this one alone."""
    stable = tuple(suffix for suffix in EXTENSION_SUFFIXES if "abi3" in suffix)
    own = tuple(suffix for suffix in EXTENSION_SUFFIXES if "cpython" in suffix or "cp3" in suffix)
    rooms = ("modeling", "rig", "benches")
    # Beside a module that loads it: an older version may have left parts in other folders.
    parts = [
        path.name
        for room in rooms
        for path in (ROOT / room).rglob("_*.*")
        if path.suffix != ".c" and any(path.parent.glob("[a-z]*.py"))
    ]
    assert len([name for name in parts if name.endswith(stable)]) == 10
    assert not [name for name in parts if name.endswith(own)]


def test_the_lock_holds_every_extra() -> None:
    """What an extra asks for, and extras of extras; in the versions that it allows."""
    lock = (ROOT / "requirements.lock").read_text(encoding="utf-8")
    pinned = dict(re.findall(r"^([a-z0-9._-]+)==([^ \n]+)", lock, re.MULTILINE))
    extras = PROJECT["optional-dependencies"]
    asked = [Requirement(line) for lines in extras.values() for line in lines]
    asked += [Requirement(line) for line in PROJECT["dependencies"]]
    assert {one for r in asked if r.name == PROJECT["name"] for one in r.extras} <= extras.keys()
    others = [r for r in asked if r.name != PROJECT["name"]]
    assert len(others) > 30
    wrong = {
        r.name: pinned.get(canonicalize_name(r.name))
        for r in others
        if not r.specifier.contains(pinned.get(canonicalize_name(r.name), "0"), prereleases=True)
    }
    assert wrong == {}


@pytest.fixture(scope="module")
def parts() -> dict[str, dict[str, Any]]:
    """Of each C part: its source's text, folders and the files that it says it depends on."""
    spec = importlib.util.spec_from_file_location("c_parts", ROOT / "tools/c_parts.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    found = {}
    for name in re.findall(r'^    "(\w+)",$', (ROOT / "setup.py").read_text(), re.MULTILINE):
        _, source, _, settings = getattr(module, name)._assigned_source
        found[name] = {"source": source, **settings}
    assert len(found) == 9
    return found


def test_a_header_that_changes_rebuilds_every_part_that_includes_it(
    parts: dict[str, dict[str, Any]], tmp_path: Path
) -> None:
    """By what the compiler reads; make, told that a header is new, installs again."""
    headers: set[Path] = set()
    for name, part in parts.items():
        source = tmp_path / f"{name}.c"
        source.write_text(part["source"])
        defines = [f"-D{macro}={value or 1}" for macro, value in part["define_macros"]]
        folders = [f"-I{folder}" for folder in part["include_dirs"]]
        read = subprocess.run(
            ["gcc", "-std=c99", "-MM", *defines, *folders, str(source)],
            check=True,
            capture_output=True,
            text=True,
        ).stdout
        own = {Path(word).resolve() for word in read.split() if word.endswith(".h")}
        assert own <= {Path(depends).resolve() for depends in part["depends"]}, name
        headers |= own
    assert len(headers) > 25
    make = ["make", "-n", "-o", ".venv/packages", ".venv/installed"]
    for header in headers:
        told = subprocess.run(
            [*make, "-W", str(header.relative_to(ROOT))],
            cwd=ROOT,
            check=True,
            capture_output=True,
            text=True,
        ).stdout
        assert "--editable" in told, header


def test_the_citation_names_this_version() -> None:
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    stated = dict(re.findall(r"^([a-z-]+): (.+)$", citation, re.MULTILINE))
    assert stated["version"] == PROJECT["version"]
    assert stated["title"] == PROJECT["name"]
    assert stated["license"] == PROJECT["license"]
    assert PROJECT["authors"][0]["name"] in citation


def test_the_extras_are_those_that_sentences_name() -> None:
    extras = PROJECT["optional-dependencies"]
    assert set(Extra.__args__) <= extras.keys()
    (psychopy,) = extras["console"]
    assert psychopy.endswith(f"; python_version < '{'.'.join(map(str, CONSOLE_BEFORE))}'")


@pytest.mark.parametrize("name", sorted({name for names in NEEDING.values() for name in names}))
def test_what_needs_an_extra_is_there(name: str) -> None:
    """Else it would be run, and fail, where the extra is not installed."""
    file, _, test = name.partition("::")
    place = ROOT / "tests" / file
    assert place.exists()
    assert not test or f"\ndef {test}" in place.read_text(encoding="utf-8")


def test_the_core_needs_none_of_what_extras_install(tmp_path: Path) -> None:
    """Loading every module of the core but those that a screen, card or port needs."""
    lines = "\n".join(
        (
            "import sys, pkgutil, importlib",
            f"for hidden in {HIDDEN}:",
            "    sys.modules[hidden] = None",
            "from tactileq.modeling.extras import MissingExtra",
            "refused = []",
            "import tactileq",
            "for module in pkgutil.walk_packages(tactileq.__path__, 'tactileq.'):",
            "    if module.name != 'tactileq.__main__':",
            "        try: importlib.import_module(module.name)",
            "        except MissingExtra: refused.append(module.name)",
            "print(*refused)",
        )
    )
    environment = {k: v for k, v in os.environ.items() if k != "DISPLAY"}
    done = subprocess.run(
        [sys.executable, "-P", "-c", lines],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    rig = "tactileq.rig."
    wire = tuple(f"{rig}{room}." for room in ("shared.wire", "machines.board", "machines.device"))
    wire += (f"{rig}machines.recorder.", f"{rig}desk.device_twin", "tactileq.benches.recorder.")
    assert {name for name in done.stdout.split() if not name.startswith(wire)} <= {
        "tactileq.rig.devices.hand.serial_sensor",
        "tactileq.experiments.console.events",
        "tactileq.experiments.feel.plots",
    }
