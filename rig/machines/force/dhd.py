"""Force Dimension's library (libdhd), found at run time where the laboratory installed it.

No real device has confirmed this: the functions are used as the maker's header and manual describe
them (docs/force-device.md#tested).
"""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any

from cffi import FFI

from tactileq.modeling.errors import InputError, shown
from tactileq.rig.machines.force.settings import ForceSettings
from tactileq.rig.shared.live.compiled import compiled
from tactileq.rig.shared.setup.force_sections import STAND_IN

UNTESTED = "untested on hardware"
OLDEST = (3, 3)
_NAMES = {
    "win32": ("dhd64.dll", "dhd.dll"),
    "darwin": ("libdhd.dylib", "libdrd.dylib"),
}
_LINUX = ("libdhd.so", "libdhd.so.3", "libdrd.so", "libdrd.so.3")
_WATCHDOG_STEP_S = 125e-6
_DECLARED = """
int dhdGetDeviceCount(void);
int dhdOpenID(char id);
int dhdClose(char id);
int dhdStop(char id);
int dhdEnableForce(unsigned char on, char id);
int dhdGetSerialNumber(unsigned short *serial, char id);
int dhdGetStatus(int *status, char id);
int dhdGetPosition(double *x, double *y, double *z, char id);
int dhdSetForce(double x, double y, double z, char id);
int dhdGetButton(int index, char id);
int dhdSetWatchdog(unsigned char duration, char id);
const char *dhdGetSystemName(char id);
const char *dhdErrorGetLastStr(void);
void dhdGetSDKVersion(int *major, int *minor, int *release, int *revision);
"""
_OPTIONAL = ("dhdSetWatchdog",)
_NEEDED = tuple(name for name in re.findall(r"dhd\w+", _DECLARED) if name not in _OPTIONAL)


class DhdLibrary:
    """The maker's library, loaded.

    Raises
    ------
    InputError
        If it is not installed, or of a version that is too old.
    """

    def __init__(self, path: str | None) -> None:
        self._ffi = FFI()
        self._ffi.cdef(_DECLARED)
        self.simulated = path == STAND_IN
        self._lib = self._load(_stand_in() if path == STAND_IN else path)
        self._check_version()

    def _load(self, path: str | None) -> Any:
        names = (path,) if path is not None else _NAMES.get(sys.platform, _LINUX)
        for name in names:
            with suppress(OSError):
                lib = self._ffi.dlopen(name)
                break
        else:
            raise InputError(
                f"expected the library of Force Dimension (libdhd), got none as "
                f"{shown(path) if path is not None else ' or '.join(names)}; install the maker's "
                "SDK and give its path as force.library in the rig file."
            )
        for name in _NEEDED:
            try:
                getattr(lib, name)
            except AttributeError:
                raise InputError(
                    f"expected the library of Force Dimension with {name}, got "
                    f"{shown(str(path or names[0]))} without it; install version "
                    f"{OLDEST[0]}.{OLDEST[1]} of the maker's SDK or a later one."
                ) from None
        return lib

    def _check_version(self) -> None:
        numbers = [self._ffi.new("int *") for _ in range(4)]
        self._lib.dhdGetSDKVersion(*numbers)
        self.version = tuple(int(number[0]) for number in numbers)
        if self.version[:2] < OLDEST:
            raise InputError(
                f"expected version {OLDEST[0]}.{OLDEST[1]} or later of Force Dimension's library, "
                f"got {'.'.join(map(str, self.version))}; install a newer SDK."
            )

    def find(self, serial: int | None) -> int:
        """Number of the only device that is connected, or of that with a serial number.

        Raises
        ------
        InputError
            If there is none, or several.
        """
        count = self._lib.dhdGetDeviceCount()
        if count < 1:
            raise InputError(
                "expected a force device, got none; check its cable and power, and whether you may "
                "use it (the maker's udev rule)."
            )
        if serial is None:
            if count > 1:
                raise InputError(
                    f"expected one force device, got {count}; give force.serial in the rig file, "
                    "or unplug the others."
                )
            return 0
        for number in range(count):
            if self._serial(number) == serial:
                return number
        raise InputError(
            f"expected the force device of serial number {serial}, got {count} others; correct "
            "force.serial, or connect it."
        )

    def _serial(self, number: int) -> int:
        """Of a device, which is opened to ask it."""
        with self.opened(number, homed=False):
            found = self._ffi.new("unsigned short *")
            self._lib.dhdGetSerialNumber(found, _char(number))
            return int(found[0])

    @contextmanager
    def opened(self, number: int, *, homed: bool = True) -> Iterator[str]:
        """The open device, without force at its beginning and its end; gives its name.

        Raises
        ------
        InputError
            If it does not open, or has not been homed.
        """
        lib, one = self._lib, _char(number)
        if lib.dhdOpenID(one) < 0:
            raise InputError(
                f"expected the force device to open, got: {self.error()}; end other programs that "
                "use it."
            )
        try:
            lib.dhdSetForce(0.0, 0.0, 0.0, one)
            own = compiled().lib
            status = self._ffi.new("int[]", own.TQ_DHD_STATUS)
            if homed and lib.dhdGetStatus(status, one) >= 0 and status[own.TQ_DHD_RESET]:
                raise InputError(
                    "expected a force device that has been homed, got one that waits for it; home "
                    "it with the maker's program, then calibrate its pose again."
                )
            name = lib.dhdGetSystemName(one)
            yield self._ffi.string(name).decode() if name else "force device"
        finally:
            lib.dhdSetForce(0.0, 0.0, 0.0, one)
            lib.dhdStop(one)
            lib.dhdClose(one)

    def set_watchdog(self, number: int, *, seconds: float) -> bool:
        """Have it switch its forces off after so long without a force; False where it cannot."""
        steps = min(255, max(1, round(seconds / _WATCHDOG_STEP_S)))
        try:
            return int(self._lib.dhdSetWatchdog(steps, _char(number))) >= 0
        except AttributeError:  # of an older library
            return False

    def error(self) -> str:
        """What the library says of what failed last."""
        text = self._lib.dhdErrorGetLastStr()
        return str(self._ffi.string(text).decode(errors="replace")) if text else "no reason"

    def device(self, number: int) -> Any:
        """A `tq_dhd` for the back end of the servo; keep both as long as that runs."""
        device = compiled().ffi.new("tq_dhd *")
        for field, name in (
            ("get_position", "dhdGetPosition"),
            ("set_force", "dhdSetForce"),
            ("get_button", "dhdGetButton"),
            ("get_status", "dhdGetStatus"),
            ("enable_force", "dhdEnableForce"),
        ):
            address = int(self._ffi.cast("uintptr_t", self._ffi.addressof(self._lib, name)))
            kind = compiled().ffi.typeof(getattr(device, field))
            setattr(device, field, compiled().ffi.cast(kind, address))
        device.id = number
        return device


def release(settings: ForceSettings) -> None:
    """Open the device of a servo that is no more, and leave it without force."""
    library = DhdLibrary(settings.library)
    with library.opened(library.find(settings.serial), homed=False):
        pass


def _char(number: int) -> bytes:
    return bytes([number])


def _stand_in() -> str:
    """Path of the stand-in, and the device of its own that it needs."""
    from tactileq.rig.machines.force.standin import PLACE, device_path, library_path

    os.environ[PLACE] = str(device_path())
    return library_path()
