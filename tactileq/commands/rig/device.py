"""tactileq rig device: an emulated device, and what any device says of itself."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from tactileq.interruption import Interrupted

if TYPE_CHECKING:
    from tactileq.rig.machines.board.emulating import Machine

Kind = Literal["process", "m7", "stm32"]
# Which board, and whether it is a recorder.
EMULATED: dict[str, tuple[Kind, bool]] = {
    "process": ("process", False),
    "m7": ("m7", False),
    "stm32": ("stm32", False),
    "recorder": ("process", True),
    "recorder-m7": ("m7", True),
    "recorder-stm32": ("stm32", True),
}


def rig_device(
    address: Annotated[
        str | None,
        typer.Argument(help="Port or socket://HOST:PORT of a device that is to be asked."),
    ] = None,
    emulate: Annotated[
        Literal["process", "m7", "stm32", "recorder", "recorder-m7", "recorder-stm32"] | None,
        typer.Option(
            "--emulate",
            help="Start one: a process, or a Cortex-M7 or an STM32F405 in QEMU; the same of a "
            "recorder of surfaces (until Ctrl-C).",
        ),
    ] = None,
    baud: Annotated[
        int | None, typer.Option("--baud", help="Of the port; else what the board usually has.")
    ] = None,
    port: Annotated[
        int, typer.Option("--port", min=0, max=65535, help="TCP port of an emulated one.")
    ] = 0,
    firmware: Annotated[
        Path | None,
        typer.Option("--firmware", help="Write the board's firmware (ELF) there, and end."),
    ] = None,
) -> None:
    """Ask a device what it is, or emulate one.

    With an address it prints the device's firmware, state and counters, and changes nothing but
    letting go of what was armed. With --emulate it starts the firmware with a simulated hand, or
    simulated mechanics of a recorder, and prints where it is reached.

    Example: tactileq rig device --emulate process
    """
    if (address is None) == (emulate is None):
        raise ValueError(
            "expected an address or --emulate, got both or neither; give one of them, such as "
            "--emulate process."
        )
    if address is not None:
        _ask(address, baud or 1_000_000)
        return
    assert emulate is not None
    kind, recorder = EMULATED[emulate]
    if firmware is None:
        _emulate(kind, baud, port, recorder=recorder)
    elif kind == "process":
        raise ValueError(
            f"expected a board for its firmware, got {emulate}, which has none; take "
            f"{'recorder-m7 or recorder-stm32' if recorder else 'm7 or stm32'}."
        )
    else:
        _write_firmware(kind, firmware, baud, recorder=recorder)


def _machine(recorder: bool) -> Machine:
    from tactileq.rig.machines.device.machine import CABLE_DEVICE
    from tactileq.rig.machines.recorder.machine import SURFACE_RECORDER

    return SURFACE_RECORDER if recorder else CABLE_DEVICE


def _emulate(kind: Kind, baud: int | None, port: int, *, recorder: bool) -> None:
    from tactileq.rig.machines.board.emulating import Emulator

    what = "recorder" if recorder else "device"
    with Emulator(kind, _machine(recorder), baud=baud, port=port) as emulator:
        print(
            f"emulated {what} ({kind}, simulated) at {emulator.address}; Ctrl-C ends it",
            flush=True,
        )
        try:
            while emulator.runs:
                time.sleep(0.2)
        except Interrupted as end:
            if end.signal_name != "SIGINT":
                raise
            end.accept()
            return
    raise ValueError("expected the emulated device to run, got its end; start it again.")


def _write_firmware(kind: Kind, file: Path, baud: int | None, *, recorder: bool) -> None:
    from tactileq.rig.machines.board.emulating import USUAL_BAUD, build_firmware, check_baud

    rate = baud or USUAL_BAUD[kind]
    check_baud(kind, rate)
    simulated = kind == "m7"
    build_firmware(kind, _machine(recorder), file, baud=rate, simulated=simulated)
    moves = "simulated mechanics" if recorder else "a simulated hand"
    name = f"a recorder on {kind}" if recorder else kind
    print(
        f"{file}: firmware of {name} at {rate} baud, with "
        f"{moves if simulated else 'its own encoders and motors'}"
    )


def _ask(address: str, baud: int) -> None:
    from tactileq.rig.machines.device.asking import asked
    from tactileq.rig.machines.device.definition import DEVICE
    from tactileq.rig.machines.recorder.definition import RECORDER

    found = asked(address, baud, (DEVICE, RECORDER))
    print(f"{address}: {found.name}{', simulated' if found.simulated else ''}")
    print(found.state)
    for name, value in found.counts.items():
        print(f"{name} {value}")
