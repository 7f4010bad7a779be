"""Emulated boards: what their ports can do; what runs on them is tested with each machine."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from tactileq.modeling import InputError
from tactileq.rig.machines.board.emulating import (
    KINDS,
    Kind,
    Machine,
    build_firmware,
    check_baud,
)
from tactileq.rig.machines.device.machine import CABLE_DEVICE
from tactileq.rig.machines.recorder.machine import SURFACE_RECORDER
from tests.refusals import refused

DOCS = Path(__file__).parents[4] / "docs"


@pytest.mark.parametrize(
    ("kind", "baud"), [("m7", 9000), ("m7", 1_515_000), ("stm32", 6_000_000), ("stm32", 0)]
)
def test_a_baud_rate_that_the_board_cannot_have_is_refused(kind: Kind, baud: int) -> None:
    with refused(InputError, expected="baud", got=baud):
        check_baud(kind, baud)


def test_usual_baud_rates_are_taken() -> None:
    for kind in KINDS:
        for baud in (115_200, 500_000):
            check_baud(kind, baud)


@pytest.mark.long("a cross build")
@pytest.mark.skipif(shutil.which("arm-none-eabi-gcc") is None, reason="no arm-none-eabi-gcc")
@pytest.mark.parametrize(
    ("machine", "page"), [(CABLE_DEVICE, "device.md"), (SURFACE_RECORDER, "recorder.md")]
)
def test_the_program_is_as_large_as_the_page_says(
    tmp_path: Path, machine: Machine, page: str
) -> None:
    """With GCC 12, the page's, within 5 % or 0.5 kB; with others within 20 %."""
    text = " ".join((DOCS / page).read_text(encoding="utf-8").split())
    stated = re.search(r"takes (\d+) kB of flash memory and (\d+) kB of RAM", text)
    assert stated is not None
    file = build_firmware("stm32", machine, tmp_path / "a.elf", baud=1_000_000, simulated=False)
    sized = subprocess.run(["arm-none-eabi-size", file], capture_output=True, text=True, check=True)
    code, data, zeros = map(int, sized.stdout.splitlines()[1].split()[:3])
    compiler = subprocess.run(
        ["arm-none-eabi-gcc", "-dumpversion"], capture_output=True, text=True, check=True
    )
    band = 0.05 if compiler.stdout.startswith("12.") else 0.2
    assert code + data == pytest.approx(1e3 * int(stated[1]), rel=band, abs=500)
    assert data + zeros == pytest.approx(1e3 * int(stated[2]), rel=band, abs=500)
