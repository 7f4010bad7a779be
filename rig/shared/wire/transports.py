"""What carries bytes between host and device: a serial port, a pseudo-terminal, a socket."""

from __future__ import annotations

import os
import socket
from contextlib import suppress
from typing import Protocol

from tactileq.modeling.errors import InputError, shown
from tactileq.modeling.extras import extra
from tactileq.rig.shared.live.clock import now_s, readable, sleep
from tactileq.rig.shared.wire.ports import WRITE_S, opened_port

with extra("rig"):
    import serial

SOCKET = "socket://"
_CONNECT_S = 2.0
_MOST = 65536  # bytes of one read
_POLL_S = 0.001  # where nothing says that bytes came


class TransportLost(Exception):
    """The other end is gone; one sentence."""


class Transport(Protocol):
    """Bytes there and back, and the clock that deadlines count on."""

    @property
    def name(self) -> str: ...

    def now_s(self) -> float:
        """Its clock: monotonic, or virtual time."""

    def read(self, within_s: float) -> bytes:
        """Bytes as they come; none after this time, or once `wake` was called."""

    def write(self, data: bytes) -> None:
        """Send all of it; TransportLost where the other end takes nothing for a second."""

    def wake(self) -> None:
        """End a `read` of another thread."""

    def close(self) -> None:
        """Give it back; harmless when closed already."""


class _Waking:
    """A pipe that ends a wait."""

    def __init__(self) -> None:
        self._out, self._in = os.pipe()
        os.set_blocking(self._in, False)
        os.set_blocking(self._out, False)

    def wake(self) -> None:
        with suppress(OSError):  # full, or closed: it wakes anyhow
            os.write(self._in, b"\0")

    def until_readable(self, of: int, within_s: float) -> bool:
        """Wait until a descriptor can be read, this wakes, or the time is over; whether it can."""
        ready, woken = readable(of, within_s, or_else=self._out)
        if woken:
            with suppress(OSError):
                os.read(self._out, _MOST)
        return ready

    def close(self) -> None:
        for end in (self._out, self._in):
            with suppress(OSError):
                os.close(end)


class SerialTransport:
    """A serial port or pseudo-terminal, for this program alone.

    Parameters
    ----------
    path : str
    baud : int

    Raises
    ------
    InputError
        As `opened_port`.
    """

    def __init__(self, path: str, baud: int) -> None:
        self.name = path
        self._port = opened_port(path, baud)
        self._waking = _Waking()
        self._closed = False

    def now_s(self) -> float:
        """Monotonic: the rig's."""
        return now_s()

    def read(self, within_s: float) -> bytes:
        """See `Transport`."""
        try:
            self._wait(within_s)
            return bytes(self._port.read(_MOST))
        except (OSError, ValueError, TypeError, serial.SerialException):
            raise TransportLost(f"the device at {self.name} was unplugged.") from None

    def _wait(self, within_s: float) -> None:
        if os.name == "posix":
            self._waking.until_readable(self._port.fileno(), within_s)
            return
        end_s = self.now_s() + within_s
        while not self._port.in_waiting and self.now_s() < end_s:
            sleep(_POLL_S)

    def write(self, data: bytes) -> None:
        """See `Transport`."""
        try:
            self._port.write(data)
        except serial.SerialTimeoutException:
            raise TransportLost(
                f"the device at {self.name} took no bytes for {WRITE_S:g} s."
            ) from None
        except (OSError, ValueError, TypeError, serial.SerialException):
            raise TransportLost(f"the device at {self.name} was unplugged.") from None

    def wake(self) -> None:
        """See `Transport`."""
        self._waking.wake()

    def close(self) -> None:
        """See `Transport`."""
        if not self._closed:
            self._closed = True
            with suppress(OSError, serial.SerialException):
                self._port.close()
            self._waking.close()


class SocketTransport:
    """A device behind a TCP socket, such as an emulator or a serial server.

    Parameters
    ----------
    address : str
        socket://host:port

    Raises
    ------
    InputError
        For another address, or where nobody listens.
    """

    def __init__(self, address: str) -> None:
        self.name = address
        host, _, port = address.removeprefix(SOCKET).rpartition(":")
        try:
            self._socket = socket.create_connection((host, int(port)), timeout=_CONNECT_S)
        except (OSError, ValueError, OverflowError) as error:
            raise InputError(
                f"expected a device at {shown(address)} ({SOCKET}HOST:PORT), got none ({error}); "
                "start it first, or correct the address."
            ) from None
        self._socket.settimeout(WRITE_S)
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._waking = _Waking()
        self._closed = False

    def now_s(self) -> float:
        """Monotonic: the rig's."""
        return now_s()

    def read(self, within_s: float) -> bytes:
        """See `Transport`."""
        try:
            if not self._waking.until_readable(self._socket.fileno(), within_s):
                return b""
            data = self._socket.recv(_MOST)
        except (OSError, ValueError):
            data = b""
        if not data:
            raise TransportLost(f"the device at {self.name} has closed the connection.")
        return data

    def write(self, data: bytes) -> None:
        """See `Transport`."""
        try:
            self._socket.sendall(data)
        except TimeoutError:
            raise TransportLost(
                f"the device at {self.name} took no bytes for {WRITE_S:g} s."
            ) from None
        except OSError:
            raise TransportLost(f"the device at {self.name} has closed the connection.") from None

    def wake(self) -> None:
        """See `Transport`."""
        self._waking.wake()

    def close(self) -> None:
        """See `Transport`."""
        if not self._closed:
            self._closed = True
            self._socket.close()
            self._waking.close()


def opened_transport(address: str, baud: int) -> Transport:
    """What carries bytes to this address: a path of a port, or socket://HOST:PORT.

    Raises
    ------
    InputError
        Where it cannot be opened.
    """
    if address.startswith(SOCKET):
        return SocketTransport(address)
    return SerialTransport(address, baud)
