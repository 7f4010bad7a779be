"""The device's firmware, compiled for a simulated board in this process."""

from __future__ import annotations

from typing import Any

from tactileq.modeling.errors import InputError

try:
    import tactileq.rig.machines.device._device as _device
except ImportError:  # no compiler at installation
    _device = None


def compiled_device() -> Any:
    """The module of the compiled firmware.

    Raises
    ------
    InputError
        If there is none.
    """
    if _device is None:
        raise InputError(
            "expected the compiled parts of tactileq, which an emulated device needs, got none; "
            "install a C compiler (gcc or clang), then tactileq again."
        )
    return _device
