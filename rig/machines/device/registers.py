"""What registers of tactileq-cables hold.

Made from device.yml by `make docs-tables`; do not edit.
"""

from __future__ import annotations

from enum import IntEnum, IntFlag


class DeviceState(IntEnum):
    """States of rig/machines/force/force.h."""

    BOOT = 0
    IDLE = 1
    ARMED = 2
    RUNNING = 3
    RELEASING = 4
    FAULT = 5


class DeviceCommand(IntEnum):
    """What the host asks for."""

    NONE = 0
    ARM = 1
    SHOW = 2
    HIDE = 3
    CLEAR = 4
    STOP = 5
    HOME = 6


class DeviceCause(IntEnum):
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


class DeviceSource(IntEnum):
    """What the vibrator plays."""

    NOTHING = 0
    MODEL = 1
    HOST = 2


class DeviceSimulation(IntEnum):
    """What goes wrong from now on, of a simulated board only."""

    NONE = 0
    STUCK = 1
    JUMP = 2
    FLIPPED = 3
    WRAPPED = 4
    BROWN_OUT = 5
    MOTOR = 6
    UNPLUGGED = 7
    SLACK = 8
    BUTTON = 9


class DeviceStatus(IntEnum):
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


class DeviceModelFault(IntEnum):
    """Why the last upload was refused with the status MODEL."""

    NONE = 0
    HASH = 1
    HEAD = 2
    LAYERS = 3
    GRID = 4
    SIZE = 5
    UPDATE_SAMPLES = 6
    LONGEST = 7
    PAUSE = 8
    MODEL_RATE_HZ = 9
    SPEED_CHANGE = 10
    FORCE_CHANGE = 11
    SLOPE_SHARE = 12
    HOLD = 13
    RELEASE = 14
    PEAK = 15
    MEAN_SQUARE = 16
    MEAN_SHARE = 17
    SILENCE = 18
    NOTCH_HZ = 19
    NOTCH_WIDTH_HZ = 20
    NOTCH_SHARE = 21
    SPEED_MM_S = 22
    FORCE_N = 23
    SIGNS = 24
    SLEWS = 25
    VALUES = 26


class DeviceFlags(IntFlag):
    """Of a record in an event frame."""

    CONTACT = 1
    BUTTON = 2
    CLIPPED = 4
    BEYOND = 8
    EMPTY = 16
    SIMULATED = 32
    SLACK = 64
