"""An emulated device of its own for each test.

Behind a socket: a pseudo-terminal waits for a thread of the kernel, on a busy machine for ten
seconds and more (pseudo-terminals: test_process.py, tests/rig/shared/wire/test_link.py).
"""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tactileq.rig.machines.board.emulating import Emulator
from tactileq.rig.machines.device.machine import CABLE_DEVICE
from tests.rig.machines.device.talking import free_port


@pytest.fixture
def device(given_clock: None) -> Iterator[Emulator]:
    with Emulator("process", CABLE_DEVICE, port=free_port()) as emulator:
        yield emulator
