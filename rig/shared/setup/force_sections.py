"""The sections of a rig file about a force device: its limits, and where its wall lies."""

from __future__ import annotations

import datetime
from dataclasses import dataclass, field
from math import isclose, sqrt
from typing import Annotated, ClassVar

from tactileq.modeling import InputError
from tactileq.modeling.files.described import FileSection, key
from tactileq.modeling.files.kinds import Name
from tactileq.rig.shared.setup.figures import Figure

STAND_IN = "stand-in"  # in place of a library's path
Vector = tuple[float, float, float]


def _assumed(value: float, unit: str) -> Figure:
    return Figure(value, unit, True, "default of tactileq, measured nowhere")


@dataclass(frozen=True, kw_only=True)
class ForceSection(FileSection):
    """A force device of Force Dimension, for a hand of kind "force" ([which](force-device.md))."""

    WHERE: ClassVar[str] = "[force]"
    library: (
        Annotated[
            Name,
            key(
                f'path of the maker\'s library (libdhd), or "{STAND_IN}" for a simulated device; '
                "without it where the system looks for libraries"
            ),
        ]
        | None
    ) = None
    serial: (
        Annotated[int, key("serial number; which of several devices", ge=0, le=65535)] | None
    ) = None
    rate_hz: Annotated[float, key("of the servo", unit="Hz", ge=500, le=8000)] = 1000.0
    damping: Annotated[
        Figure,
        key(
            "viscous damping of the device itself, on which the "
            "[largest stiffness](force-device.md#stiffness) rests; "
            "`tactileq rig damping` writes it",
            unit="N·s/m",
            ge=0,
            le=1000,
        ),
    ] = field(default=_assumed(0.5, "N·s/m"))
    delay_ms: Annotated[
        Figure,
        key(
            "from a reading to the force that answers it; `tactileq rig damping` writes it if it "
            "is known well enough",
            unit="ms",
            ge=0,
            le=20,
        ),
    ] = field(default=_assumed(1.0, "ms"))
    most_n: Annotated[Figure, key("largest force", unit="N", ge=0.01, le=40)] = field(
        default=_assumed(5.0, "N")
    )
    most_n_per_s: Annotated[
        Figure, key("largest change of the force", unit="N/s", ge=1, le=1e5)
    ] = field(default=_assumed(2000.0, "N/s"))
    most_w: Annotated[
        Figure, key("largest power, into the hand or out of it", unit="W", ge=0.01, le=100)
    ] = field(default=_assumed(5.0, "W"))
    most_mm_s: Annotated[
        Figure, key("fastest tool; one that is faster is let go", unit="mm/s", ge=10, le=10000)
    ] = field(default=_assumed(1000.0, "mm/s"))
    late_ms: Annotated[
        Figure,
        key("two readings further apart let go", unit="ms", ge=0.2, le=19),
    ] = field(default=_assumed(4.0, "ms"))
    frozen_ms: Annotated[
        Figure,
        key("so do bit-identical readings under force for this long", unit="ms", ge=5, le=5000),
    ] = field(default=_assumed(250.0, "ms"))
    release_ms: Annotated[
        Figure, key("from the force at a fault to 0", unit="ms", ge=1, le=500)
    ] = field(default=_assumed(50.0, "ms"))
    low_mm: Annotated[Vector, key("lower corner of the workspace, device's frame", unit="mm")] = (
        -100.0,
        -100.0,
        -100.0,
    )
    high_mm: Annotated[Vector, key("upper corner of the workspace", unit="mm")] = (
        100.0,
        100.0,
        100.0,
    )
    homed_on: (
        Annotated[datetime.date, key("when the device was homed last; poses before it are void")]
        | None
    ) = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if not all(low < high for low, high in zip(self.low_mm, self.high_mm, strict=True)):
            raise InputError(
                f"expected force.low_mm below force.high_mm on each axis, got {self.low_mm} and "
                f"{self.high_mm}; exchange them."
            )
        if self.late_ms.value <= 1e3 / self.rate_hz:
            raise InputError(
                f"expected force.late_ms above one period of force.rate_hz, {1e3 / self.rate_hz:g} "
                f"ms, got {self.late_ms.value:g} ms; raise it."
            )

    @property
    def simulated(self) -> bool:
        """Whether there is no device."""
        return self.library == STAND_IN


@dataclass(frozen=True, kw_only=True)
class DeviceSection(FileSection):
    """A [device that renders by itself](device.md) as the hand of kind "force".

    [force] holds its limits.
    """

    WHERE: ClassVar[str] = "[device]"
    address: Annotated[Name, key("path of its serial port, or socket://HOST:PORT")]
    baud: Annotated[int, key("of its port", unit="baud", ge=9600, le=4_000_000)] = 1_000_000
    simulated: Annotated[
        bool, key("whether it is emulated (tactileq rig device --emulate); refused where it lies")
    ] = False
    renders: Annotated[
        bool,
        key("whether it renders [the texture](device.md#texture), too; else the sound card does"),
    ] = False
    volts_per_g: (
        Annotated[
            Figure,
            key(
                "voltage at the vibrator where the firmware's converter is given 1 g, amplifier "
                "included; required where it renders",
                unit="V/g",
                ge=1e-6,
                le=1000,
            ),
        ]
        | None
    ) = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.renders and self.volts_per_g is None:
            raise InputError(
                "expected device.volts_per_g (V/g) of a device that renders the texture, got none; "
                "measure the voltage at the vibrator, and add it under [device]."
            )


@dataclass(frozen=True, kw_only=True)
class PoseSection(FileSection):
    """Where the frame of the wall lies in the device's; `tactileq rig pose` writes it."""

    WHERE: ClassVar[str] = "[pose]"
    origin_mm: Annotated[Vector, key("the first point that was touched", unit="mm")]
    x: Annotated[Vector, key("unit vector from the first point to the second")]
    z: Annotated[Vector, key("unit vector away from the surface")]
    measured_on: Annotated[datetime.date, key("when")]

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("x", "z"):
            length = sqrt(sum(value * value for value in getattr(self, name)))
            if not isclose(length, 1.0, abs_tol=1e-4):
                raise InputError(
                    f"expected pose.{name} of length 1, got {length:g}; measure the pose again "
                    "(tactileq rig pose)."
                )
        across = sum(a * b for a, b in zip(self.x, self.z, strict=True))
        if abs(across) > 1e-4:
            raise InputError(
                f"expected pose.x at right angles to pose.z, got a cosine of {across:g}; measure "
                "the pose again (tactileq rig pose)."
            )

    @property
    def y(self) -> Vector:
        """The third unit vector, z × x."""
        (ax, ay, az), (bx, by, bz) = self.z, self.x
        return (ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx)
