"""tactileq rig device: an emulated device, and what any device says of itself."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated, Literal

import typer

from tactileq.interruption import Interrupted


def rig_device(
    address: Annotated[
        str | None,
        typer.Argument(help="Port or socket://HOST:PORT of a device that is to be asked."),
    ] = None,
    emulate: Annotated[
        Literal["process", "m7", "stm32"] | None,
        typer.Option(
            "--emulate",
            help="Start one: a process, or a Cortex-M7 or an STM32F405 in QEMU (until Ctrl-C).",
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
    letting go of what was armed. With --emulate it starts the firmware with a simulated hand and
    prints where it is reached.

    Example: tactileq rig device --emulate process
    """
    if (address is None) == (emulate is None):
        raise ValueError(
            "expected an address or --emulate, got both or neither; give one of them, such as "
            "--emulate process."
        )
    if address is not None:
        _ask(address, baud or 1_000_000)
    elif emulate is not None and firmware is not None:
        _write_firmware(emulate, firmware, baud)
    elif emulate is not None:
        _emulate(emulate, baud, port)


def _emulate(kind: Literal["process", "m7", "stm32"], baud: int | None, port: int) -> None:
    from rig.device.emulating import Emulator

    with Emulator(kind, baud=baud, port=port) as emulator:
        print(
            f"emulated device ({kind}, simulated) at {emulator.address}; Ctrl-C ends it", flush=True
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


def _write_firmware(kind: Literal["process", "m7", "stm32"], file: Path, baud: int | None) -> None:
    from rig.device.emulating import USUAL_BAUD, build_firmware, check_baud

    if kind == "process":
        raise ValueError(
            "expected a board for its firmware, got process, which has none; take m7 or stm32."
        )
    rate = baud or USUAL_BAUD[kind]
    check_baud(kind, rate)
    build_firmware(kind, file, baud=rate, simulated=kind == "m7")
    hand = "a simulated hand" if kind == "m7" else "its own encoders and motors"
    print(f"{file}: firmware of {kind} at {rate} baud, with {hand}")


def _ask(address: str, baud: int) -> None:
    from rig.device.asking import ASKED, asked

    found = asked(address, baud)
    print(f"{address}: {found.name}{', simulated' if found.simulated else ''}")
    print(found.state)
    for name in ASKED[3:]:
        print(f"{name} {found.values[name]}")
