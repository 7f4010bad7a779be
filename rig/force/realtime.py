"""Real-time priority, where a process may have it."""

from __future__ import annotations

import os
import sys

SERVO_PRIORITY = 20
WATCHDOG_PRIORITY = 30


def real_time(priority: int) -> bool:
    """Give this thread a real-time priority (FIFO, 1 … 99); whether it may have it."""
    if sys.platform != "linux":
        return False
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
    except OSError:
        return False
    return True
