"""Starts an emulated machine for those without a board: a process, or QEMU with the firmware."""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, Self

from tactileq.modeling.errors import InputError
from tactileq.rig.shared.wire.transports import SOCKET

Kind = Literal["process", "m7", "stm32"]
KINDS: tuple[Kind, ...] = ("process", "m7", "stm32")
_HERE = Path(__file__).parent
_COMPILER = "arm-none-eabi-gcc"
# Of an UART whose samples of a bit are 16 clocks: what both sides bear together.
_WORST_BAUD = 0.02


@dataclass(frozen=True)
class Board:
    """A micro-controller that the firmware is compiled for.

    Parameters
    ----------
    machine : str
        QEMU's name; empty where QEMU has none.
    name : str
        Of the files in `boards/`.
    clock_hz : float
        Of its UART.
    """

    machine: str
    name: str
    clock_hz: float
    options: tuple[str, ...]


@dataclass(frozen=True)
class Machine:
    """What a board with our firmware can be.

    Parameters
    ----------
    process : str
        The module whose process is an emulated one.
    folders : tuple of Path
        Of its simulated.h and of all headers that this includes beside the board's.
    macros : tuple of str
        That the compiler is given.
    compiled : callable
        Gives its firmware, compiled for a simulated board; InputError where there is none.
    """

    process: str
    folders: tuple[Path, ...]
    macros: tuple[str, ...]
    compiled: Callable[[], Any]


_DOUBLE = ("-mcpu=cortex-m7", "-mfpu=fpv5-d16", "-DTQ_REAL=double", "-DTQ_NUMBER=double")
BOARDS: dict[str, Board] = {
    "m7": Board("mps2-an500", "mps2", 25e6, _DOUBLE),
    "f767": Board("", "stm32f767", 54e6, _DOUBLE),
    "stm32": Board(
        "netduinoplus2",
        "stm32f405",
        84e6,
        ("-mcpu=cortex-m4", "-mfpu=fpv4-sp-d16", "-DTQ_REAL=float", "-DTQ_NUMBER=float"),
    ),
}
USUAL_BAUD = {"process": 1_000_000, "m7": 921_600, "stm32": 1_000_000}


def check_baud(kind: Kind, baud: int) -> None:
    """Refuse a baud rate that the board's clock does not divide into.

    Raises
    ------
    InputError
        Below 9600, or where the nearest rate is over 2 % off.
    """
    board = BOARDS.get(kind)
    least, most = 9600, 4_000_000
    nearest = baud
    if board is not None:
        most = int(board.clock_hz / 16)
        nearest = round(board.clock_hz / max(1, round(board.clock_hz / max(1, baud))))
    if not least <= baud <= most or abs(nearest / baud - 1) > _WORST_BAUD:
        raise InputError(
            f"expected a baud rate from {least} to {most} that the board's clock divides into, got "
            f"{baud}; take {USUAL_BAUD[kind]}."
        )


def build_firmware(
    kind: str, machine: Machine, file: Path, *, baud: int, simulated: bool = True
) -> Path:
    """Compile the firmware of a board.

    Parameters
    ----------
    kind : str
        One of `BOARDS`.
    file : Path
        To be written (ELF).
    simulated : bool
        Whether a simulated hand, or simulated mechanics, take the place of encoders and motors.

    Raises
    ------
    InputError
        Without the compiler, or where it refuses.
    """
    board = BOARDS[kind]
    if shutil.which(_COMPILER) is None:
        raise InputError(
            f"expected {_COMPILER} for the firmware of {kind}, got none; install it (Debian: "
            "gcc-arm-none-eabi libnewlib-arm-none-eabi), or emulate process."
        )
    folders = [_HERE, _HERE / "boards", *machine.folders]
    command = [_COMPILER, "-std=c99", "-O3", "-ffp-contract=off", "-fno-math-errno", "-mthumb"]
    command += ["-mfloat-abi=hard", *board.options, f"-DBAUD={baud}"]
    command += ["-DTQ_SIMULATED"] * simulated + [f"-D{macro}" for macro in machine.macros]
    command += [f"-I{folder}" for folder in folders]
    command += ["-ffunction-sections", "-Wl,--gc-sections", "-nostartfiles", "-specs=nano.specs"]
    command += [f"-L{_HERE / 'boards'}", "-T", str(_HERE / "boards" / f"{board.name}.ld")]
    command += [str(_HERE / "boards" / f"{board.name}.c"), str(_HERE / "firmware.c")]
    done = subprocess.run(
        [*command, "-o", str(file), "-lm"], capture_output=True, text=True, check=False
    )
    if done.returncode:
        raise InputError(
            f"expected {_COMPILER} to compile the firmware of {kind}, got: "
            f"{' '.join(done.stderr.split())[:300]}; install one of version 10 or later."
        )
    return file


class Emulator:
    """An emulated machine while this is open; it ends with this process, however that ends.

    Parameters
    ----------
    kind : {"process", "m7", "stm32"}
    machine : Machine
    baud : int, optional
        Of its port, which limits the records that it sends.
    port : int
        Of a TCP socket on this computer instead of a pseudo-terminal; 0 for none.

    Attributes
    ----------
    address : str
        Path of the pseudo-terminal, or socket://HOST:PORT.
    firmware : Path, optional
        What QEMU runs.
    """

    def __init__(
        self, kind: Kind, machine: Machine, *, baud: int | None = None, port: int = 0
    ) -> None:
        self._kind, self._machine = kind, machine
        self._baud = USUAL_BAUD[kind] if baud is None else baud
        self._port = port
        self._stack = ExitStack()
        self._child: subprocess.Popen[str] | None = None
        self.address = ""
        self.firmware: Path | None = None

    def open(self) -> None:
        """Start it; returns once it can be reached.

        Raises
        ------
        InputError
            Without the emulator or its compiler, for a baud rate that the board cannot have, or a
            port that is taken.
        """
        check_baud(self._kind, self._baud)
        what: str = self._kind
        if self._kind == "process":
            self._machine.compiled()
        else:
            self.firmware = self._built()
            what = f"{BOARDS[self._kind].machine}:{self.firmware}"
        command = [sys.executable, "-P", "-m", self._machine.process, what]
        self._child = subprocess.Popen(
            [*command, str(self._baud), str(self._port)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        assert self._child.stdout is not None
        self.address = self._child.stdout.readline().strip()
        if not self.address.startswith(("/dev/", SOCKET)):
            said = self.address or self._child.communicate()[1].strip().splitlines()[-1:]
            self.close()
            raise InputError(
                f"expected the emulated device to start, got: {said}; take another port, or none."
            )

    def _built(self) -> Path:
        if shutil.which("qemu-system-arm") is None:
            raise InputError(
                f"expected qemu-system-arm to emulate {self._kind}, got none; install it (Debian: "
                "qemu-system-arm), or emulate process."
            )
        folder = Path(self._stack.enter_context(tempfile.TemporaryDirectory()))
        file = folder / "firmware.elf"
        return build_firmware(self._kind, self._machine, file, baud=self._baud)

    @property
    def pid(self) -> int:
        """Number of its process; 0 where there is none."""
        return self._child.pid if self._child is not None else 0

    @property
    def runs(self) -> bool:
        """Whether it has not ended by itself."""
        return self._child is not None and self._child.poll() is None

    def close(self) -> None:
        """End it."""
        if (child := self._child) is not None:
            assert child.stdin is not None
            child.stdin.close()
            try:
                child.wait(5.0)
            except subprocess.TimeoutExpired:
                child.kill()
                child.wait()
            for pipe in (child.stdout, child.stderr):
                if pipe is not None:
                    pipe.close()
            self._child = None
        self._stack.close()

    def __enter__(self) -> Self:
        self.open()
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
