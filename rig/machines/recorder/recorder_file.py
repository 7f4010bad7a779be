"""The recorder file: what is known or assumed about one (docs/recorder.md#recorder-file)."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, ClassVar, Literal, Self

from tactileq.modeling.errors import InputError
from tactileq.modeling.files.described import BESIDE, DescribedFile, FileSection, key, naming
from tactileq.modeling.files.documents import read_toml
from tactileq.modeling.files.kinds import Name
from tactileq.rig.machines.recorder.law import MotorLaw, RecorderLaw
from tactileq.rig.shared.setup.figures import Figure

IN_VIRTUAL_TIME = "simulated"  # in place of an address
SHIPPED_RECORDER_FILE = Path(__file__).with_name("recorder.toml")
SENSOR_RATE_HZ = 22704.0


def _assumed(value: float, unit: str) -> Figure:
    return Figure(value, unit, True, "default of tactileq, measured nowhere")


@dataclass(frozen=True, kw_only=True)
class RecorderSection(FileSection):
    """The recorder, and the computer's way to it."""

    WHERE: ClassVar[str] = "[recorder]"
    name: Annotated[Name, key("of this recorder")]
    address: Annotated[
        Name,
        key(f'path of its serial port, or socket://HOST:PORT; "{IN_VIRTUAL_TIME}" in virtual time'),
    ]
    baud: Annotated[int, key("of its port", unit="baud", ge=9600, le=4_000_000)] = 1_000_000
    simulated: Annotated[bool, key("whether it is emulated; refused where it lies")] = False


@dataclass(frozen=True, kw_only=True)
class SampleSection(FileSection):
    """The sample, and where the ball runs on it."""

    WHERE: ClassVar[str] = "[sample]"
    radius: Annotated[
        Figure, key("from the turntable's axis to the ball", unit="mm", ge=5, le=100)
    ] = field(default=_assumed(40.0, "mm"))
    inner: Annotated[
        Figure, key("radius within which the sample is fastened", unit="mm", ge=0, le=1000)
    ] = field(default=_assumed(15.0, "mm"))
    outer: Annotated[Figure, key("radius of the sample", unit="mm", ge=1, le=1000)] = field(
        default=Figure(60.0, "mm", True, "paper: samples of 120 mm")
    )
    safety: Annotated[
        Figure, key("least distance of the ball from both", unit="mm", ge=0, le=100)
    ] = field(default=_assumed(3.0, "mm"))
    run_in_s: Annotated[
        float, key("on the sample before each record", unit="s", ge=0.05, le=60)
    ] = 1.0

    def __post_init__(self) -> None:
        super().__post_init__()
        low = self.inner.value + self.safety.value
        high = self.outer.value - self.safety.value
        if not low <= self.radius.value <= high:
            raise InputError(
                f"expected sample.radius from {low:g} to {high:g} mm, sample.safety within "
                f"sample.inner and sample.outer, got {self.radius.value:g} mm; move the contactor, "
                "then correct the radius."
            )


@dataclass(frozen=True, kw_only=True)
class MotorsSection(FileSection):
    """Both motors and their encoders."""

    WHERE: ClassVar[str] = "[motors]"
    n_m_per_a: Annotated[Figure, key("torque constant", unit="N·m/A", ge=1e-4, le=10)] = field(
        default=Figure(0.0273, "N·m/A", True, "data sheet of a DCX32L, by third parties")
    )
    nominal: Annotated[Figure, key("current that they bear for ever", unit="A", ge=0.1, le=20)] = (
        field(default=Figure(4.12, "A", True, "data sheet of a DCX32L, by third parties"))
    )
    most: Annotated[Figure, key("largest current", unit="A", ge=0.1, le=20)] = field(
        default=_assumed(6.0, "A")
    )
    heat: Annotated[
        Figure,
        key("integral of i² − nominal² that they bear, too", unit="A²·s", ge=0.1, le=1e4),
    ] = field(default=_assumed(60.0, "A²·s"))
    counts: Annotated[
        int,
        key("of an encoder in a turn; with fewer no speed is held within 2 %", ge=4096, le=65535),
    ] = 4096

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.nominal.value > self.most.value:
            raise InputError(
                f"expected motors.nominal of at most motors.most, {self.most.value:g} A, got "
                f"{self.nominal.value:g} A; exchange them."
            )


@dataclass(frozen=True, kw_only=True)
class TurntableSection(FileSection):
    """The turntable with its motor."""

    WHERE: ClassVar[str] = "[turntable]"
    inertia: Annotated[
        Figure, key("of motor, magnets and turntable", unit="kg·m²", ge=1e-9, le=1)
    ] = field(default=_assumed(2.82e-4, "kg·m²"))
    cut_off: Annotated[
        Figure, key("of both [observers](#observers)", unit="rad/s", ge=0.1, le=200)
    ] = field(default=_assumed(60.0, "rad/s"))
    fastest: Annotated[Figure, key("largest speed", unit="rad/s", ge=0.1, le=1000)] = field(
        default=_assumed(20.0, "rad/s")
    )


@dataclass(frozen=True, kw_only=True)
class ContactorSection(FileSection):
    """The contactor with its motor."""

    WHERE: ClassVar[str] = "[contactor]"
    inertia: Annotated[Figure, key("of motor and lever", unit="kg·m²", ge=1e-9, le=1)] = field(
        default=_assumed(1.6e-5, "kg·m²")
    )
    cut_off: Annotated[
        Figure, key("of both [observers](#observers)", unit="rad/s", ge=0.1, le=2000)
    ] = field(default=_assumed(400.0, "rad/s"))
    friction: Annotated[
        Figure,
        key(
            "Coulomb's, which limits [the force's error](#error-of-the-force)",
            unit="N·m",
            ge=0,
            le=1,
        ),
    ] = field(default=_assumed(3e-4, "N·m"))
    gravity: Annotated[
        Figure, key("torque of its weight, positive downwards", unit="N·m", ge=-1, le=1)
    ] = field(default=_assumed(0.0, "N·m"))
    lever: Annotated[Figure, key("of the ball", unit="mm", ge=1, le=1000)] = field(
        default=Figure(30.0, "mm", True, "paper")
    )
    stiffness: Annotated[
        Figure,
        key("of ball and sample, for which the force loop is made", unit="N/mm", ge=0.01, le=1000),
    ] = field(default=_assumed(5.0, "N/mm"))


@dataclass(frozen=True, kw_only=True)
class SensorSection(FileSection):
    """The accelerometer: files of its evaluation tool, or an input of a sound card."""

    WHERE: ClassVar[str] = "[sensor]"
    files: (
        Annotated[Name, key("folder in which the evaluation tool saves a CSV file for each record")]
        | None
    ) = None
    axis: Annotated[Literal["x", "y", "z"], key("of these files, across the sample")] = "z"
    wait_s: Annotated[
        float,
        key("longest time that speed and force are held for a file", unit="s", ge=0.1, le=55),
    ] = 30.0
    device: (
        Annotated[Name, key("name of a sound card, or a part of it, in place of files")] | None
    ) = None
    channel: Annotated[int, key("of the card, from 1", ge=1, le=64)] = 1
    g_per_fullscale: (
        Annotated[
            Figure,
            key("acceleration of a full-scale sample of the card", unit="g", ge=1e-6, le=1e6),
        ]
        | None
    ) = None
    rate_hz: Annotated[float, key("of the sensor", unit="Hz", ge=100, le=1e6)] = SENSOR_RATE_HZ

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.files is not None and self.device is not None:
            raise InputError(
                "expected sensor.files or sensor.device, got both; remove one of them."
            )
        if self.device is not None and self.g_per_fullscale is None:
            raise InputError(
                "expected sensor.g_per_fullscale (g) of a sound card, got none; calibrate the "
                "input (tactileq rig calibrate), then add it."
            )


@dataclass(frozen=True, kw_only=True)
class RecorderFile(DescribedFile):
    """One recorder, as its file describes it.

    Parameters
    ----------
    path : Path
        The file.
    """

    WHAT: ClassVar[str] = "a recorder file"
    VERSION: ClassVar[int] = 1
    recorder: RecorderSection
    sample: SampleSection = field(default=SampleSection())
    motors: MotorsSection = field(default=MotorsSection())
    turntable: TurntableSection = field(default=TurntableSection())
    contactor: ContactorSection = field(default=ContactorSection())
    sensor: SensorSection = field(default=SensorSection())
    path: Annotated[Path, BESIDE] = Path()

    def __post_init__(self) -> None:
        super().__post_init__()
        given = [name for name in ("files", "device") if getattr(self.sensor, name) is not None]
        if self.simulated and given:
            raise InputError(
                f"expected sensor.{given[0]} of a real recorder, or a simulated one, whose "
                "vibration is drawn, got both; remove one of them."
            )

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Read a recorder file (TOML).

        Raises
        ------
        InputError
            If the file is missing, no TOML or of another version, has unknown or missing keys,
            other units, values out of range, or a sensor of a simulated recorder.
        """
        file = Path(path)
        with naming(file):
            return replace(cls.from_tables(read_toml(file, cls.WHAT)), path=file)

    @property
    def simulated(self) -> bool:
        """Whether there is no recorder."""
        return self.recorder.simulated or self.recorder.address == IN_VIRTUAL_TIME

    @property
    def sensor_folder(self) -> Path | None:
        """Where the evaluation tool saves."""
        files = self.sensor.files
        return None if files is None else self.path.parent / files

    def law(self) -> RecorderLaw:
        """What the recorder is written."""
        motors, table, arm = self.motors, self.turntable, self.contactor
        both = {"n_m_per_a": motors.n_m_per_a.value}
        return RecorderLaw(
            table=MotorLaw(
                inertia_kg_m2=table.inertia.value,
                cut=table.cut_off.value,
                reaction_cut=table.cut_off.value,
                **both,
            ),
            arm=MotorLaw(
                inertia_kg_m2=arm.inertia.value,
                cut=arm.cut_off.value,
                reaction_cut=arm.cut_off.value,
                friction_n_m=arm.friction.value,
                gravity_n_m=arm.gravity.value,
                **both,
            ),
            counts=motors.counts,
            most_a=motors.most.value,
            nominal_a=motors.nominal.value,
            heat_a2_s=motors.heat.value,
            arm_m=1e-3 * arm.lever.value,
            contact_n_per_m=1e3 * arm.stiffness.value,
            radius_mm=self.sample.radius.value,
            fastest_rad_s=table.fastest.value,
        )
