"""The firmware judged from outside, in virtual time (walks.c).

The large numbers, on demand: python -m tests.rig.machines.device.large
"""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from tactileq.rig.shared.wire.envelope import WireFrame
from tests.rig.machines.device.compiled import ROOT, compiled_walks

pytestmark = pytest.mark.skipif(shutil.which("gcc") is None, reason="gcc is not installed")


@pytest.fixture(scope="session")
def walks(once_per_run: Callable[..., Any]) -> Path:
    """Compiled once for all workers."""
    return Path(once_per_run("walks", compiled_walks))


@pytest.fixture(scope="session")
def checked_walks(once_per_run: Callable[..., Any]) -> Path:
    """The same under the sanitizers."""
    return Path(once_per_run("checked_walks", lambda folder: compiled_walks(folder, checked=True)))


def told(program: Path, *arguments: object) -> dict[str, float]:
    """What a walk prints: names and numbers."""
    run = subprocess.run(
        [program, *map(str, arguments)], capture_output=True, text=True, check=False
    )
    found = re.findall(r"(\w+) ([-\d.]+)", run.stdout)
    assert not run.stderr, run.stderr  # where the sanitizers say what they found
    assert run.returncode in (0, 1)
    return {name: float(number) for name, number in found}


@pytest.mark.long("sweeps: all sequences of inputs, ten million ticks")
def test_no_path_arms_without_a_command(walks: Path) -> None:
    """All sequences of four of twelve inputs: commands, a host that says hello, falls silent or
    whose loop hangs, an encoder that jumps, a restart."""
    found = told(walks, "paths", 4)
    assert found["paths"] == 12 + 12**2 + 12**3 + 12**4
    assert found["running"] > 0  # hello, home, arm, show
    assert found["wrong"] == 0


@pytest.mark.long("sweeps: all sequences of inputs, ten million ticks")
def test_no_limit_is_broken_in_ten_million_ticks(walks: Path) -> None:
    found = told(walks, "limits", 6, 10_000_000)
    assert found["running"] > 1e6
    assert found["clipped"] > 1e4
    assert found["causes"] >= 7
    assert found["broken"] == 0


def test_no_damaged_frame_is_applied_and_the_next_one_counts(checked_walks: Path) -> None:
    """Under the address and undefined-behaviour sanitizers, uploads included."""
    found = told(checked_walks, "damaged", 9, 50_000)
    assert found["damaged"] > 45_000
    assert found["uploading"] == found["damaged"]
    assert found["applied"] == found["next_lost"] == 0


def test_no_counter_and_no_mechanics_make_the_firmware_do_what_c_leaves_undefined(
    checked_walks: Path,
) -> None:
    found = told(checked_walks, "extremes", 5, 200_000)
    assert found["ticks"] == 200_000
    assert found["stuck"] > 0
    assert found["wrapped"] > 20


def test_a_silent_host_costs_heartbeat_and_ramp(walks: Path) -> None:
    """500 ticks of silence and 100 of the ramp, by the device's own clock."""
    found = told(walks, "silences", 100)
    assert abs(found["shortest"] - 601) <= 1
    assert abs(found["longest"] - 601) <= 1


def test_the_vectors_are_what_the_firmware_sends_and_takes(walks: Path) -> None:
    rows = json.loads((ROOT / "docs/device/vectors.json").read_text(encoding="utf-8"))["frames"]
    lines = [f"{row['kind']} {row['sequence']} {row['nonce']} {row['body'] or '-'}" for row in rows]
    run = subprocess.run(
        [walks, "frames"], input="\n".join(lines), capture_output=True, text=True, check=True
    )
    assert len(rows) > 90
    assert run.stdout.splitlines() == [f"{row['bytes']} 1" for row in rows]
    for row in rows:
        frame = WireFrame(row["kind"], row["sequence"], row["nonce"], bytes.fromhex(row["body"]))
        assert frame.encoded().hex() == row["bytes"]
