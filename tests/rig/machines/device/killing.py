"""A host that is killed while the wall pushes, and how long the device pulled on."""

from __future__ import annotations

import random
import signal
import subprocess
import sys

from tactileq.rig.machines.device.definition import DEVICE
from tactileq.rig.shared.live.clock import sleep
from tactileq.rig.shared.wire.conversation import Conversation
from tactileq.rig.shared.wire.transports import opened_transport

BAUD = 1_000_000
HOST = """
import sys
from tactileq.rig.machines.device.definition import DEVICE
from tactileq.rig.shared.live.clock import now_s, sleep, taking_part
from tactileq.rig.shared.wire.link import Link
from tactileq.rig.shared.wire.transports import opened_transport
with taking_part(), Link(lambda: opened_transport(sys.argv[1], 1_000_000), DEVICE) as link:
    while link.read("State") == 0:
        sleep(0.01)
    if link.read("State") == 5:
        link.write("Command", 4)
        sleep(0.05)
    for command in (6, 1, 2):
        link.write("Command", command)
    begun_s = now_s()
    while link.read("Force") < 0.2:
        link.beat()
        if now_s() > begun_s + 5:
            sys.exit(f"no force: cause {link.read('Cause')}")
    print("pushes", flush=True)
    while True:
        link.beat()
        sleep(0.02)
"""


def ticks_after_kill(address: str, seed: int, how: int = signal.SIGKILL) -> int:
    """From the host's last frame to no current, in ticks of the device.

    Parameters
    ----------
    how : int
        SIGKILL or SIGSTOP.
    """
    with subprocess.Popen(
        [sys.executable, "-c", HOST, address], stdout=subprocess.PIPE, text=True
    ) as host:
        try:
            assert host.stdout is not None
            assert host.stdout.readline() == "pushes\n"
            sleep(random.Random(seed).uniform(0.0, 0.1))
            host.send_signal(how)
            sleep(0.25)
        finally:
            host.kill()
    transport = opened_transport(address, BAUD)
    try:
        talk = Conversation(transport, DEVICE)
        talk.hello()
        assert talk.read("Current") == (0.0, 0.0)
        assert (talk.read("State"), talk.read("Cause")) == (5, 14)
        zero, heard = talk.read("ZeroTick"), talk.read("HeardTick")
        assert isinstance(zero, int)
        assert isinstance(heard, int)
        return zero - heard
    finally:
        transport.close()
