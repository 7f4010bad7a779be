"""What the processes of a rig share: readings of the hand, blocks that were played, a heartbeat.

docs/method/live.md#shared-memory
"""

from __future__ import annotations

import mmap
import os
import secrets
import tempfile
from contextlib import suppress
from math import nan
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactileq.modeling.arrays import Floats
from tactileq.modeling.errors import InputError, shown
from tactileq.modeling.files.locks import WAIT_S, HeldError, Lock
from tactileq.rig.shared.live.compiled import compiled

# Flags of a reading, and of a block.
CONTACT, BUTTON, FORCE_ASSUMED, SIMULATED, GONE, FORCE_COMMANDED, BEYOND = 1, 2, 4, 8, 16, 32, 64
STALE, UNDERFLOW, NO_HEARTBEAT = 1, 2, 4

HEARTBEAT_S = 1.0  # the session writes a heartbeat at least this often
OLDEST_READING_S = 0.1  # a hand whose last reading is older counts as lifted off

READING = np.dtype(
    [
        ("time_s", "f8"),
        ("x_mm", "f8"),
        ("y_mm", "f8"),
        ("depth_mm", "f8"),
        ("speed_mm_s", "f8"),
        ("force_n", "f8"),
        ("flags", "u4"),
        ("spare", "u4"),
    ]
)
BLOCK = np.dtype(
    [
        ("time_s", "f8"),
        ("dac_time_s", "f8"),
        ("speed_mm_s", "f8"),
        ("force_n", "f8"),
        ("hand_s", "f8"),
        ("square_sum_g2", "f8"),
        ("weighted_square_sum_g2", "f8"),
        ("position", "u8"),
        ("readings", "u8"),
        ("frames", "u4"),
        ("presentation", "u4"),
        ("peak_g", "f4"),
        ("seconds", "f4"),
        ("flags", "u4"),
        ("taken", "u4"),
    ]
)
_PREFIX, _LOCK = "tactileq-live-", ".lock"
_MOST_ROWS = 16384
Rows = NDArray[np.void]


class Live:
    """Shared memory of one rig; made by `create`, found again by `attach`.

    A file in memory where the system has such, else in the temporary folder. Close it, or use it in
    a `with` block; who made it removes the file, and those of makers that were killed.
    """

    def __init__(self, path: Path, memory: mmap.mmap, *, lock: Lock | None = None) -> None:
        self.path = path
        self._memory: mmap.mmap | None = memory
        self._lock = lock  # of who made it
        self._lib, ffi = compiled().lib, compiled().ffi
        self._ffi = ffi
        self._buffer = ffi.from_buffer(memory, require_writable=True)
        self.address = ffi.cast("tq_live *", self._buffer)

    @classmethod
    def create(cls) -> Live:
        """New memory, empty."""
        lib = compiled().lib
        in_memory = Path("/dev/shm")
        folder = in_memory if os.access(in_memory, os.W_OK) else Path(tempfile.gettempdir())
        _clear(folder)
        path = folder / f"{_PREFIX}{secrets.token_hex(8)}"
        lock = Lock(path.with_name(path.name + _LOCK))
        lock.acquire(WAIT_S)
        try:
            live = cls(path, _made(path, lib.tq_live_size()), lock=lock)
        except BaseException:
            path.unlink(missing_ok=True)
            lock.release()
            raise
        lib.tq_live_start(live.address)
        return live

    @classmethod
    def attach(cls, path: str | Path) -> Live:
        """Memory that another process has made.

        Raises
        ------
        InputError
            For a file that is none.
        """
        lib, path = compiled().lib, Path(path)
        with open(path, "r+b") as file:
            if os.fstat(file.fileno()).st_size != lib.tq_live_size():
                raise _no_memory(path)
            memory = mmap.mmap(file.fileno(), 0)
        live = cls(path, memory)
        if not lib.tq_live_fits(live.address):
            live.close()
            raise _no_memory(path)
        return live

    def close(self) -> None:
        """Release the memory, which must not be used afterwards."""
        if self._memory is None:
            return
        self.address = None
        self._ffi.release(self._buffer)
        self._memory.close()
        self._memory = None
        if self._lock:
            self.path.unlink(missing_ok=True)
            self._lock.release()

    def __enter__(self) -> Live:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def write_reading(
        self,
        time_s: float,
        x_mm: float,
        *,
        y_mm: float,
        speed_mm_s: float,
        force_n: float,
        flags: int,
        depth_mm: float = nan,
    ) -> None:
        """Add a reading of the hand; only one process may.

        Parameters
        ----------
        time_s : float
            By `now_s`.
        x_mm, y_mm : float
            Position; NaN where it is not measured.
        depth_mm : float
            Below the wall of a force device.
        speed_mm_s : float
            With its sign.
        force_n : float
            ≥ 0.
        flags : int
            Sum of CONTACT, BUTTON, FORCE_ASSUMED, SIMULATED, GONE, FORCE_COMMANDED, BEYOND.
        """
        self._lib.tq_write_reading(
            self.address, time_s, x_mm, y_mm, depth_mm, speed_mm_s, force_n, flags
        )

    def write_block(self, row: np.void) -> None:
        """Add a block (BLOCK) that was played; only one process may."""
        rows = np.array([row], dtype=BLOCK)
        self._lib.tq_write_block(self.address, self._ffi.from_buffer("tq_block *", rows))

    def heartbeat(self) -> None:
        """Write the session's heartbeat, without which playback falls silent.

        Only the loop that polls the participant or the keys may call this, never a thread of its
        own: where the loop hangs nobody looks.
        """
        self._lib.tq_heartbeat(self.address, self._lib.tq_now())

    def latest(self) -> np.void | None:
        """The latest reading (READING), None before the first."""
        row = np.zeros(1, dtype=READING)
        found = self._lib.tq_latest(self.address, self._ffi.from_buffer("tq_reading *", row))
        return row[0] if found else None

    @property
    def readings_written(self) -> int:
        """How many readings there ever were."""
        return int(self._lib.tq_readings_written(self.address))

    @property
    def blocks_written(self) -> int:
        """How many blocks there ever were."""
        return int(self._lib.tq_blocks_written(self.address))

    def readings_since(self, count: int) -> tuple[int, Rows]:
        """The readings (READING) after the first `count`, and how many there ever were with them.

        Where nobody has asked for so long that the oldest are overwritten (16 384 of them), they
        are left out: then the new count less the old one is more than there are rows.
        """
        return self._since(self._lib.tq_readings, READING, "tq_reading *", count)

    def blocks_since(self, count: int) -> tuple[int, Rows]:
        """The same of the blocks (BLOCK) that the audio callback has played."""
        return self._since(self._lib.tq_blocks, BLOCK, "tq_block *", count)

    def _since(self, copy: Any, kind: np.dtype[Any], pointer: str, count: int) -> tuple[int, Rows]:
        rows: Rows = np.zeros(_MOST_ROWS, dtype=kind)
        first = self._ffi.new("uint64_t *")
        taken = copy(self.address, count, self._ffi.from_buffer(pointer, rows), rows.size, first)
        return int(first[0]) + int(taken), rows[:taken].copy()


def reading_ages_s(reading_times_s: Floats, blocks: Rows) -> Floats:
    """How old the latest reading is at the first sample of each block.

    Parameters
    ----------
    reading_times_s : (m,) ndarray
        Rising.
    blocks : (n,) array of BLOCK

    Returns
    -------
    (k,) ndarray
        Of the k ≤ n blocks that a reading precedes.
    """
    index = np.searchsorted(reading_times_s, blocks["hand_s"], side="right") - 1
    known = index >= 0
    ages: Floats = blocks["hand_s"][known] - reading_times_s[index[known]]
    return ages


def _made(path: Path, size: int) -> mmap.mmap:
    """Memory in a file that must not be there yet."""
    handle = os.open(path, os.O_RDWR | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0), 0o600)
    try:
        os.truncate(handle, size)
        return mmap.mmap(handle, size)
    finally:
        os.close(handle)


def _clear(folder: Path) -> None:
    """Remove the memory of makers that were killed, which hold its lock no more."""
    for path in folder.glob(f"{_PREFIX}*{_LOCK}"):
        lock, memory = Lock(path), path.with_name(path.name.removesuffix(_LOCK))
        with suppress(HeldError, InputError, OSError):
            lock.acquire(wait_s=0)
            try:
                if lock.is_held:
                    memory.unlink(missing_ok=True)
            finally:
                lock.release()


def _no_memory(path: Path) -> InputError:
    return InputError(
        f"expected the shared memory of a rig of this version in {shown(str(path))}, got another "
        "file; start both processes from one installation."
    )
