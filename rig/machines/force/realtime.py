"""How the processes of a force device run: in real time where they may, and to their end."""

from __future__ import annotations

import os
import signal
import sys

from tactileq.rig.shared.live.clock import is_given

SERVO_PRIORITY = 20
WATCHDOG_PRIORITY = 30


def outlive_signals() -> None:
    """Let no signal to all processes of a terminal or a session end this one.

    It would leave the device with its force. It ends when its parent is gone, without force.
    """
    for name in ("SIGTERM", "SIGHUP"):
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.SIG_IGN)


def real_time(priority: int) -> bool:
    """Give this thread a real-time priority (FIFO, 1 … 99); whether it may have it.

    A given clock waits for all: there it would only keep others from the processor, such as the
    kernel's own thread that passes on what a pseudo-terminal gets.
    """
    if sys.platform != "linux" or is_given():
        return False
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
    except OSError:
        return False
    return True
