"""Firmware on a simulated board in this process: in virtual time, as a transport."""

from __future__ import annotations

from typing import Any

TICK_HZ = 5000
_MOST = 4096


class VirtualBoard:
    """A simulated board, switched on.

    Parameters
    ----------
    module : module
        The machine's firmware, compiled for this computer.
    entropy : int
        Another one for another start, 0 … 2³² − 1.
    baud : int
        Of its port; 0 for any.
    """

    def __init__(self, module: Any, *, entropy: int = 1, baud: int = 0) -> None:
        self.ffi, self.lib = module.ffi, module.lib
        self._memory = self.ffi.new("char[]", self.lib.tq_virtual_size())
        self.address = self.ffi.cast("tq_virtual *", self._memory)
        self.lib.tq_virtual_start(self.address, entropy, baud)

    def run(self, port: int, end: int, other: int = -1) -> int:
        """Let it run in real time, talking through a descriptor that does not block (-1: none).

        Returns
        -------
        int
            0 or 1 once `end` or `other` can be read or is closed, −1 once the port is gone.
        """
        return int(self.lib.tq_virtual_run(self.address, port, end, other))

    def given(self, output: int) -> float:
        """What a motor or the vibrator's converter was told last."""
        return float(self.lib.tq_virtual_given(self.address, output))

    def shut(self) -> None:
        """Every output off."""
        self.lib.tq_virtual_shut(self.address)


class VirtualTransport:
    """A simulated board in virtual time: each read lets it tick until something comes.

    Parameters
    ----------
    board : VirtualBoard
    """

    name = "virtual device"

    def __init__(self, board: VirtualBoard) -> None:
        self.board = board
        self._buffer = self.board.ffi.new("uint8_t[]", _MOST)
        self.ticks = 0
        self._held = bytearray()

    def now_s(self) -> float:
        """Virtual time since it was switched on."""
        return self.ticks / TICK_HZ

    def read(self, within_s: float) -> bytes:
        """See `Transport`; the device ticks once at least."""
        for _ in range(max(1, round(within_s * TICK_HZ))):
            self.step(1)
            if self._held:
                break
        data, self._held = bytes(self._held), bytearray()
        return data

    def step(self, ticks: int) -> None:
        """Let the device tick."""
        self.board.lib.tq_virtual_step(self.board.address, ticks)
        self.ticks += ticks
        count = self.board.lib.tq_virtual_take(self.board.address, self._buffer, _MOST)
        self._held += bytes(self.board.ffi.buffer(self._buffer, count))

    def write(self, data: bytes) -> None:
        """See `Transport`."""
        self.board.lib.tq_virtual_receive(self.board.address, data, len(data))

    def wake(self) -> None:
        """Nothing waits here."""

    def close(self) -> None:
        """Nothing to give back."""
