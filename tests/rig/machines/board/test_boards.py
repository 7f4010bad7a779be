"""What is written for boards: on this computer against models of registers, and in QEMU."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

from tactileq.rig.machines.board.emulating import BOARDS, Machine, build_firmware
from tactileq.rig.machines.device.machine import CABLE_DEVICE
from tactileq.rig.machines.recorder.machine import SURFACE_RECORDER
from tests.rig.conftest import PATIENCE_S

HERE = Path(__file__).parent
ROOT = HERE.parents[3]
BOARD = ROOT / "rig/machines/board"
ROOMS = ("board", "board/boards", "device", "force")
FOLDERS = [*(f"-I{ROOT}/rig/machines/{room}" for room in ROOMS), f"-I{ROOT}/modeling/rendering"]
STRICT = ("-std=c99", "-Wall", "-Wextra", "-Werror", "-Wno-unused-function")
HUNG, ENDED = 0, 3  # QEMU's status

needs_chips = pytest.mark.skipif(
    not all(map(shutil.which, ("qemu-system-arm", "arm-none-eabi-gcc"))),
    reason="qemu-system-arm and arm-none-eabi-gcc are not installed",
)


def said(folder: Path, source: str, *options: str) -> str:
    """What a program of this folder prints, compiled for this computer."""
    command = ["gcc", *STRICT, *FOLDERS, *options, str(HERE / source)]
    program = folder / "program"
    subprocess.run([*command, "-o", str(program), "-lm"], check=True)
    return subprocess.run([program], check=True, capture_output=True, text=True).stdout


@pytest.mark.parametrize("board", ["stm32f405", "stm32f767"])
def test_no_overrun_of_the_uart_leaves_an_interrupt_or_loses_more(
    board: str, tmp_path: Path
) -> None:
    """Two bytes complete before any two accesses to registers."""
    told = said(tmp_path, "overrun.c", f'-DBOARD="{board}.c"')
    assert told == "scenarios 78 storms 0 wrong 0\n"


def test_the_watchdog_is_fed_while_tick_and_main_loop_turn(tmp_path: Path) -> None:
    """Once in a turn with a tick; never without a tick; once more after the last turn."""
    assert said(tmp_path, "watched.c", "-DTQ_SIMULATED") == "100 0 1\n"


@pytest.mark.long("firmware that a cross compiler optimises, and a chip that QEMU emulates")
@needs_chips
@pytest.mark.parametrize(("hangs", "status"), [(0, ENDED), (1, HUNG), (2, HUNG)])
def test_a_main_loop_or_tick_that_hangs_resets_the_board(
    hangs: int, status: int, tmp_path: Path
) -> None:
    """By the time of instructions: nothing depends on how busy this computer is."""
    program, board = tmp_path / "firmware.elf", BOARDS["m7"]
    command = ["arm-none-eabi-gcc", "-std=c99", "-O2", "-mthumb", "-mfloat-abi=hard"]
    command += [*board.options, *FOLDERS, "-DTQ_SIMULATED", f"-DHANGS={hangs}"]
    command += ["-nostartfiles", "-specs=nano.specs", f"-L{BOARD}/boards", "-o", str(program)]
    command += ["-T", f"{BOARD}/boards/mps2.ld", f"{BOARD}/boards/mps2.c", str(HERE / "hangs.c")]
    subprocess.run([*command, "-lm"], check=True)
    qemu = ["qemu-system-arm", "-M", board.machine, "-display", "none", "-monitor", "none"]
    qemu += ["-serial", "null", "-icount", "shift=3,sleep=off", "-semihosting"]
    qemu += ["-action", "watchdog=poweroff", "-kernel", str(program)]
    assert subprocess.run(qemu, check=False, timeout=PATIENCE_S).returncode == status


@pytest.mark.long("firmware that a cross compiler optimises")
@needs_chips
@pytest.mark.parametrize("machine", [CABLE_DEVICE, SURFACE_RECORDER])
@pytest.mark.parametrize("kind", ["stm32", "f767"])
def test_firmware_for_motors_and_encoders_is_compiled(
    kind: str, machine: Machine, tmp_path: Path
) -> None:
    """It is linked, too; nothing ran it."""
    file = build_firmware(kind, machine, tmp_path / "firmware.elf", baud=1_000_000, simulated=False)
    assert file.read_bytes().startswith(b"\x7fELF")


@needs_chips
@pytest.mark.parametrize("board", ["mps2", "stm32f405", "stm32f767"])
def test_a_board_file_is_compiled_without_a_warning(board: str, tmp_path: Path) -> None:
    options = next(each.options for each in BOARDS.values() if each.name == board)
    command = ["arm-none-eabi-gcc", "-O0", *STRICT, "-mthumb", "-mfloat-abi=hard", *options]
    command += [*FOLDERS, "-c", f"{BOARD}/boards/{board}.c", "-o", str(tmp_path / "board.o")]
    subprocess.run(command, check=True)
