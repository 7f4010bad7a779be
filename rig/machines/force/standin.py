"""The stand-in for Force Dimension's library: a simulated device whose faults are set at will.

What it gives is simulated (rig/machines/force/standin.h, docs/force-device.md#stand-in).
"""

from __future__ import annotations

import mmap
import os
import tempfile
from pathlib import Path
from typing import Any

from tactileq.modeling.errors import InputError
from tactileq.rig.shared.live.clock import sleep

try:
    import tactileq.rig.machines.force._standin as _standin
except ImportError:  # no compiler at installation
    _standin = None

PLACE = "TACTILEQ_STANDIN"  # in the environment: path of the device
CARRIED_S = 1.0


def _module() -> Any:
    if _standin is None:
        raise InputError(
            "expected the compiled parts of tactileq, which the stand-in of a force device needs, "
            "got none; install a C compiler (gcc or clang), then tactileq again."
        )
    return _standin


def library_path() -> str:
    """What is loaded in place of the maker's library."""
    return str(_module().__file__)


class StandIn:
    """A simulated device in a file; `fields` are those of `tq_standin`, read and set at once.

    Parameters
    ----------
    path : Path
        Made where there is none.
    """

    def __init__(self, path: Path) -> None:
        module = _module()
        self.path = path
        size = int(module.lib.tq_standin_size())
        handle = os.open(path, os.O_RDWR | os.O_CREAT, 0o600)
        try:
            new = os.fstat(handle).st_size != size
            os.truncate(path, size)
            self._memory = mmap.mmap(handle, size)
        finally:
            os.close(handle)
        self._ffi, self._lib = module.ffi, module.lib
        self._buffer = self._ffi.from_buffer(self._memory, require_writable=True)
        self.fields = self._ffi.cast("tq_standin *", self._buffer)
        if new:
            self._lib.tq_standin_start(self.fields)

    def reset(self) -> None:
        """As it is by default, with its hand at the beginning of a stroke."""
        self._lib.tq_standin_start(self.fields)

    def let_go(self, *, on_real: bool) -> None:
        """Carry the tool onto the real surface, or into the air, and hold it no more."""
        one = self.fields
        one.stroke, one.hand_stiffness, one.hand_damping = 0.0, 60.0, 5.0
        one.press = -(one.real_height - 0.0005 if on_real else one.real_height + 0.02)
        sleep(CARRIED_S)
        one.hand_stiffness = one.hand_damping = 0.0
        one.velocity = [0.0, 0.0, 0.0]

    def force_n(self, time_s: float) -> tuple[float, float, float]:
        """What its motors push with at a moment of the common clock."""
        x, y, z = (self._lib.tq_standin_force(self.fields, time_s, axis) for axis in range(3))
        return float(x), float(y), float(z)

    def close(self) -> None:
        """Give the memory back; the file stays."""
        self.fields = None
        self._ffi.release(self._buffer)
        self._memory.close()

    def __enter__(self) -> StandIn:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def device_path() -> Path:
    """The device that processes share: the one that the environment names, else this user's.

    Made where there is none.
    """
    folder = Path("/dev/shm") if os.access("/dev/shm", os.W_OK) else Path(tempfile.gettempdir())
    user = os.getuid() if hasattr(os, "getuid") else 0
    path = Path(os.environ.get(PLACE) or folder / f"tactileq-standin-{user}")
    StandIn(path).close()
    return path
