"""States of a force device, and why it let go: the words of rig/machines/force/force.h."""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple


class State(IntEnum):
    """Force is 0 in all but ARMED, RUNNING and RELEASING."""

    BOOT = 0
    IDLE = 1
    ARMED = 2
    RUNNING = 3
    RELEASING = 4
    FAULT = 5


class ForceEvent(IntEnum):
    """What changes the state; all but SENSED, FAILED and ZERO are asked for."""

    SENSED = 0
    ARM = 1
    SHOW = 2
    HIDE = 3
    CLEAR = 4
    FAILED = 5
    ZERO = 6


class Cause(IntEnum):
    """Why the device let go."""

    NONE = 0
    NOT_READ = 1
    NOT_A_NUMBER = 2
    LATE = 3
    JUMP = 4
    SPEED = 5
    WORKSPACE = 6
    FROZEN = 7
    HEARTBEAT = 8
    SOUND = 9
    WATCHDOG = 10
    NOT_WRITTEN = 11
    STOPPED = 12
    STOOD_STILL = 13
    LINK = 14
    HOST = 15
    STUCK = 16
    SLACK = 17
    SLOW = 18
    UNANSWERED = 19
    PRESSED_THROUGH = 20
    FORCES_OFF = 21
    OFF_SWITCH = 22
    OFF_SPEED = 23
    OFF_WATCHDOG = 24


class Ask(IntEnum):
    """What the host asks of the servo."""

    NOTHING = 0
    ARM = 1
    SHOW = 2
    HIDE = 3
    CLEAR = 4
    STOP = 5


SENTENCES = {
    Cause.NOT_READ: "expected the force device to say where it is, got a failed reading; check "
    "its cable and power.",
    Cause.NOT_A_NUMBER: "expected numbers from the force device, got a position that is none; home "
    "it again.",
    Cause.LATE: "expected the force device's readings in time, got one later than force.late_ms; "
    "close other programs, or allow real-time priority.",
    Cause.JUMP: "expected a steady movement of the force device, got a jump of its position; check "
    "its encoders and cable.",
    Cause.SPEED: "expected a tool slower than force.most_mm_s, got a faster one; stroke slower.",
    Cause.WORKSPACE: "expected the tool within the workspace of the force device, got it outside; "
    "bring it back.",
    Cause.FROZEN: "expected a hand that moves the force device a little under force, got the very "
    "same position for longer than force.frozen_ms; take hold of it, or check its encoders.",
    Cause.HEARTBEAT: "expected the session to look after the wall, got no heartbeat for a second; "
    "close other programs.",
    Cause.SOUND: "expected the sound to go on under the wall, got none; see what it reports.",
    Cause.WATCHDOG: "expected a watchdog of the force device, got none; start the rig again.",
    Cause.NOT_WRITTEN: "expected the force device to take its force, got a failure; check its "
    "cable and power.",
    Cause.STOOD_STILL: "expected the servo of the force device to tick, got none for 20 ms; "
    "close other programs.",
    Cause.LINK: "expected the device to hear from this computer every 0.1 s, got silence; check "
    "its cable, and close other programs.",
    Cause.HOST: "expected one program to command the device, got another one that said hello; end "
    "it.",
    Cause.STUCK: "expected both encoders of the device to move, got one that stands still; check "
    "its cable.",
    Cause.SLACK: "expected both cables of the device to pull, got one that is slack; lift the tool "
    "more slowly, or check its cables.",
    Cause.SLOW: "expected the servo of the force device to tick every 1/force.rate_hz, got more "
    "than 1.5 times that on average; close other programs, allow real-time priority, or lower "
    "force.rate_hz.",
    Cause.UNANSWERED: "expected the tool to give way to a small force, got one that stood still or "
    "moved against it; hold it loosely in the air, and if that does not help, check that its "
    "encoders count the right way, and force.delay_ms.",
    Cause.PRESSED_THROUGH: "expected a hand that presses no harder than force.most_n, got a tool "
    "that went through the wall for a second; press less hard, and if nobody did, check that "
    "the device's encoders count the right way.",
    Cause.FORCES_OFF: "expected the force device to have its forces on, got them off; check its "
    "power and cable, its deadman switch, and what its own display says.",
    Cause.OFF_SWITCH: "expected the force device to have its forces on, got them off by its force "
    "switch; switch them on there.",
    Cause.OFF_SPEED: "expected a tool slower than the force device's own limit, got a faster "
    "one, upon which it has switched its forces off; move slower.",
    Cause.OFF_WATCHDOG: "expected the force device to hear from this computer in time, got "
    "silence, upon which its own watchdog has switched its forces off; close other programs, or "
    "allow real-time priority.",
    Cause.STOPPED: "the force device was stopped.",
}


class Status(NamedTuple):
    """What the servo last reported.

    Parameters
    ----------
    asked : int
        Which request was done last, counted by the host.
    """

    state: State
    cause: Cause
    asked: int

    @classmethod
    def from_word(cls, word: int) -> Status:
        """As the shared memory holds it."""
        return cls(State(word & 255), Cause(word >> 8 & 255), word >> 16)

    @property
    def sentence(self) -> str:
        """Why it let go, and what to do; empty where it did not."""
        return SENTENCES.get(self.cause, "")
