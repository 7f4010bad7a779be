"""Serial ports: which there are, and one opened for this program alone."""

from __future__ import annotations

import os

from tactileq.modeling.errors import InputError, shown
from tactileq.modeling.extras import extra

with extra("rig"):
    import serial
    from serial.tools import list_ports

WRITE_S = 1.0  # a port that takes nothing for so long is gone


def port_names() -> tuple[tuple[str, str], ...]:
    """Path and description of every serial port, whatever is connected to it."""
    ports = sorted(list_ports.comports(), key=lambda port: str(port.device))
    return tuple((str(port.device), port.description or "unknown") for port in ports)


def opened_port(path: str, baud: int) -> serial.Serial:
    """A port without what waited in it; reading does not wait.

    Raises
    ------
    InputError
        Where there is none, another program has it, this one may not, or it cannot have that baud
        rate.
    """
    try:
        port = serial.Serial(path, baud, timeout=0, write_timeout=WRITE_S, exclusive=True)
        port.reset_input_buffer()  # what waited there has no moment of arrival
    except Exception as error:  # pyserial lets those of the system's layers through (termios.error)
        raise _not_opened(path, baud, error) from None
    return port


def _not_opened(path: str, baud: int, error: Exception) -> InputError:
    text = str(error)
    if not os.path.exists(path):
        return InputError(
            f"expected a serial port at {shown(path)}, got nothing there; there are "
            f"{ports_listed()}."
        )
    if "lock port" in text:
        return InputError(
            f"expected the serial port {path} for this program alone, got one that another program "
            "reads; end that program."
        )
    if isinstance(error, OSError) and error.errno == 13:
        return InputError(
            f"expected permission to read {path}, got none; run `sudo usermod -aG dialout $USER` "
            "and log in again."
        )
    if isinstance(error, ValueError | OverflowError) or "baud" in text:
        return InputError(
            f"expected a baud rate that {path} can do, got {baud}; take 115200 or 500000."
        )
    return InputError(f"expected a serial port at {path}, got a refusal ({text}); check the path.")


def ports_listed() -> str:
    """All of them for a sentence; none where there are none."""
    return ", ".join(f"{path} ({name})" for path, name in port_names()) or "none"
