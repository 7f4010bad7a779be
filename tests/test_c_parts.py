"""The C parts walked by their tests, with everything checked that C leaves undefined."""

from __future__ import annotations

import importlib.util
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from tests.sanitizing import ROOT, checked_parts, with_checked_parts

SERVO = "rig/machines/force/test_processes.py"
# Part of tools/c_parts.py → tests that drive it, with ordinary and extreme inputs.
WALKS = {
    "kernel": ["modeling/rendering/test_kernel.py"],
    "kernel_single": ["modeling/rendering/test_kernel_properties.py"],
    "many": ["modeling/rendering/test_many.py"],
    "slopes": ["modeling/estimation/test_compiled.py"],
    "rivals": ["benches/rendering/test_rivals.py", "benches/rendering/test_stored_sounds.py"],
    "live": [
        "modeling/rendering/test_lattice.py",
        "rig/shared/live/test_callback.py",
        "rig/shared/live/test_clock.py",
        "rig/machines/force/test_law.py",
    ],
    "standin": [  # loaded by the servo's process
        f"{SERVO}::test_it_begins_without_force_and_pushes_once_it_is_armed_and_shown",
        f"{SERVO}::test_what_goes_wrong_with_the_device_lets_go_until_people_arm_it_again",
    ],
    "device": [
        "rig/machines/device/test_extremes.py",
        "rig/machines/device/test_faults.py",
        "rig/machines/device/test_mechanics.py",
    ],
    "recorder": [
        "rig/machines/recorder/test_extremes.py",
        "rig/machines/recorder/test_observer.py",
        "rig/machines/recorder/test_recorder.py",
    ],
}

pytestmark = [
    pytest.mark.long("sweeps: all C parts compiled with sanitizers, and their tests with these"),
    pytest.mark.skipif(shutil.which("gcc") is None, reason="gcc is not installed"),
]


@pytest.fixture(scope="session")
def built(once_per_run: Callable[..., Any]) -> Path:
    return Path(once_per_run("checked_parts", checked_parts))


def run(built: Path, *words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, *words],
        cwd=ROOT,
        env=with_checked_parts(built),
        capture_output=True,
        text=True,
        check=False,
    )


def parts() -> dict[str, str]:
    """Each C part of the project with the module that it becomes."""
    spec = importlib.util.spec_from_file_location("c_parts", ROOT / "tools/c_parts.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    made = {name: value for name, value in vars(module).items() if type(value).__name__ == "FFI"}
    return {name: value._assigned_source[0] for name, value in made.items()}


def test_every_part_is_walked_and_checked(built: Path) -> None:
    modules = parts()
    assert WALKS.keys() == modules.keys()
    imported = run(
        built,
        "-c",
        f"import importlib\nfor name in {sorted(modules.values())}:\n"
        "    print(importlib.import_module(name).__file__)",
    )
    assert imported.returncode == 0, imported.stderr
    files = [Path(line) for line in imported.stdout.split()]
    assert len(files) == len(modules)
    assert all(file.is_relative_to(built) for file in files)


@pytest.mark.parametrize("part", WALKS)
def test_nothing_undefined_is_done_by(part: str, built: Path) -> None:
    tests = [f"tests/{test}" for test in WALKS[part]]
    # -s: what a sanitizer says before it ends the process is not lost.
    done = run(built, "-m", "pytest", "-q", "-s", "-p", "no:cacheprovider", *tests)
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]


def test_what_is_undefined_is_found(built: Path) -> None:
    """Or this file shows nothing: memory that is too short."""
    script = (
        "from tactileq.rig.shared.live.compiled import compiled\n"
        "module = compiled()\n"
        "stroke = module.ffi.new('char[8]')\n"
        "module.lib.tq_stroke_start(module.ffi.cast('tq_stroke *', stroke), 0.01)\n"
    )
    found = run(built, "-c", script)
    assert found.returncode != 0
    assert "AddressSanitizer" in found.stderr
