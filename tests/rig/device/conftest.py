"""An emulated device of its own for each test.

Behind a socket: a pseudo-terminal waits for a thread of the kernel, on a busy machine for ten
seconds and more (pseudo-terminals: test_process.py, tests/rig/wire/test_link.py).
"""

from __future__ import annotations

import socket
from collections.abc import Iterator

import pytest

from rig.device.emulating import Emulator


@pytest.fixture
def device(given_clock: None) -> Iterator[Emulator]:
    with Emulator("process", port=free_port()) as emulator:
        yield emulator


def free_port() -> int:
    """A port of this computer that nobody has now."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        return int(server.getsockname()[1])
