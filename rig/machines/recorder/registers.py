"""What registers of tactileq-recorder hold.

Made from device.yml by `make docs-tables`; do not edit.
"""

from __future__ import annotations

from enum import IntEnum


class RecorderState(IntEnum):
    """Phases of a record."""

    RESTS = 0
    SPINS = 1
    LOWERS = 2
    SETTLES = 3
    RUNS_IN = 4
    RECORDS = 5
    LIFTS = 6
    RECORDED = 7
    FAILS = 8


class RecorderCause(IntEnum):
    """Why a record is refused."""

    NONE = 0
    NO_SPEED = 1
    NO_TOUCH = 2
    NO_FORCE = 3
    OFF_SPEED = 4
    OFF_FORCE = 5
    STUCK = 6
    SLIPS = 7
    TOO_HOT = 8
    OVERSPEED = 9
    STOPPED = 10
    LINK = 11
    HEARTBEAT = 12
    HOST = 13
    NOT_WRITTEN = 14


class RecorderCommand(IntEnum):
    """What the host asks for."""

    NONE = 0
    START = 1
    STOP = 2
    CLEAR = 3
    FINISH = 4


class RecorderSimulation(IntEnum):
    """What goes wrong from now on, of a simulated recorder only."""

    NONE = 0
    TABLE_STUCK = 1
    ARM_STUCK = 2
    SLIPPING = 3
    BROWN_OUT = 4
    MOTOR = 5
    NO_SAMPLE = 6


class RecorderStatus(IntEnum):
    """First byte of every reply."""

    OK = 0
    ADDRESS = 1
    ACCESS = 2
    LENGTH = 3
    RANGE = 4
    STATE = 5
    NONCE = 6
    SEQUENCE = 7
    KIND = 8
    TOO_LARGE = 9
    MODEL = 10
    BUSY = 11
    FULL = 12
