"""A conversation with a simulated board in virtual time."""

from __future__ import annotations

import socket
from collections.abc import Sequence
from typing import Any

import numpy as np

from tactileq.rig.machines.board.virtual import TICK_HZ, VirtualBoard, VirtualTransport
from tactileq.rig.machines.device.definition import DEVICE
from tactileq.rig.machines.device.registers import (
    DeviceCause,
    DeviceCommand,
    DeviceSimulation,
    DeviceSource,
    DeviceState,
)
from tactileq.rig.machines.device.virtual import compiled_device
from tactileq.rig.shared.wire.conversation import RECORD, Block, Conversation


class Talk(Conversation):
    """With the board's transport, and words for what tests do."""

    def __init__(self, board: VirtualBoard | None = None) -> None:
        self.wire = VirtualTransport(board or VirtualBoard(compiled_device()))
        super().__init__(self.wire, DEVICE)
        self.hello()

    def ask(self, command: DeviceCommand) -> DeviceState:
        """The state after a command."""
        return DeviceState(int(self.write("Command", command)))  # type: ignore[arg-type]

    def number(self, name: str) -> Any:
        """A register of one number."""
        return self.read(name)

    @property
    def state(self) -> DeviceState:
        """As it is now."""
        return DeviceState(self.number("State"))

    @property
    def cause(self) -> DeviceCause:
        """Of the last fault."""
        return DeviceCause(self.number("Cause"))

    def run(self, seconds: float) -> None:
        """Look after the device for so long."""
        end_s = self.now_s() + seconds
        while self.now_s() < end_s:
            self.write("Heartbeat", 1)
            self.wire.step(round(0.02 * TICK_HZ))

    def push(self) -> None:
        """Show the wall, and stroke until it pushes."""
        assert self.ask(DeviceCommand.HOME) == DeviceState.IDLE
        assert self.ask(DeviceCommand.ARM) == DeviceState.ARMED
        assert self.ask(DeviceCommand.SHOW) == DeviceState.RUNNING
        self.run(1.5)
        assert self.number("Force") > 0.2

    def spoil(self, what: DeviceSimulation) -> None:
        """Something goes wrong with the board."""
        self.write("Simulate", what)

    def recorded(
        self, seconds: float, *, source: DeviceSource = DeviceSource.NOTHING
    ) -> list[Block]:
        """Records of so long, at every tick."""
        self.write("Source", source)
        self.write("EventRate", TICK_HZ)
        return self.listened(seconds)

    def listened(self, seconds: float) -> list[Block]:
        """The records of so long more."""
        blocks, end_s, step_s = [], self.now_s() + seconds, 0.004
        while self.now_s() < end_s:
            self.write("Heartbeat", 1)
            self.listen(step_s)
            blocks += self.blocks()
        return blocks


def joined(blocks: Sequence[Block]) -> np.ndarray[Any, np.dtype[Any]]:
    """The records of all blocks, which are to have no gap."""
    numbers = [block.number for block in blocks]
    sizes = [block.values.size for block in blocks]
    assert numbers == list(np.cumsum([numbers[0], *sizes])[:-1])
    return np.concatenate([block.values for block in blocks]).astype(RECORD)


def free_port() -> int:
    """A port of this computer that nobody has now."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        return int(server.getsockname()[1])
