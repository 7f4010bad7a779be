"""tactileq rig device: an emulated device, and what any device says of itself."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from tactileq.interruption import Interrupted

if TYPE_CHECKING:
    from rig.wire.conversation import Hello
    from rig.wire.definition import Value

_SHOWN = ("State", "Cause", "Tick", "EventRate", "ModelHash", "FramesBad", "RecordsLost")


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
    from rig.device.definition import DEVICE
    from rig.wire.conversation import Conversation
    from rig.wire.transports import TransportLost, opened_transport

    transport = opened_transport(address, baud)
    try:
        talk = Conversation(transport, DEVICE)
        hello = talk.hello()
        values = {name: talk.read(name) for name in _SHOWN}
    except TransportLost as lost:
        raise ValueError(f"expected a device that stays, got an end: {lost}") from None
    finally:
        transport.close()
    _print(address, hello, values)


def _print(address: str, hello: Hello, values: dict[str, Value]) -> None:
    from rig.device.registers import DeviceCause, DeviceState

    major, minor = hello.firmware_version
    precision = "double" if hello.real_size == 8 else "single"
    print(
        f"{address}: device {hello.who_am_i}, firmware {major}.{minor}, schema "
        f"{hello.schema_hash:016x}, {hello.tick_rate_hz:g} Hz, {precision} precision"
    )
    state, cause = DeviceState(int(values["State"])), DeviceCause(int(values["Cause"]))  # type: ignore[arg-type]
    print(f"state {state.name}, last cause {cause.name}")
    for name in _SHOWN[2:]:
        print(f"{name} {values[name]}")
