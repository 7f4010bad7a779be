"""A scene: how hands will move, the actuator, the error bound and the budget.

A scene is a TOML file; docs/scene-file.md lists its keys.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from numpy.typing import ArrayLike

from modeling.arrays import Floats
from modeling.checks import HIGHEST_FORCE_N, HIGHEST_SPEED_MM_S, is_number
from modeling.errors import InputError, shown
from modeling.files.described import DescribedFile, FileSection, key, keys_of, naming
from modeling.files.hashes import sha256_of, sha256_of_values
from modeling.files.kinds import Name, Rate, TextureNames
from modeling.files.values import NameOrFile
from modeling.perception.thresholds import Threshold
from modeling.recordings.trajectory import Trajectory, load_trajectory
from modeling.rendering.limits import Limits
from modeling.scenes.microcontrollers import MicroController

STROKE_HZ = 2.0
FASTEST_STROKES_HZ = 20.0
HIGHEST_MARGIN_DB = 100.0
HIGHEST_BOUND_DB = 100.0
HIGHEST_BUDGET = 1e15
READ_EVERY_S = 5e-3  # a recorded hand, for its speed, force and their slopes
CODEC = NameOrFile("codec")
RECORDED = "recorded"
Range = tuple[float, float]
Recorded = Literal["recorded"]
AskedRange = Range | Recorded


def _ends(asked: Any) -> Any:
    """Lowest and highest, from both or from one number."""
    return (asked, asked) if is_number(asked) else asked


Speed = Annotated[float, key(unit="mm/s", gt=0, le=HIGHEST_SPEED_MM_S)]
Force = Annotated[float, key(unit="N", gt=0, le=HIGHEST_FORCE_N)]
_ADVICE = 'write [lowest, highest], or "recorded" for all of the grid'
SpeedRange = Annotated[
    tuple[Speed, Speed] | Recorded,
    key(
        "lowest and highest speed, within which the hand may be anywhere, or one speed",
        expected=f"the lowest and the highest speed, above 0 and up to {HIGHEST_SPEED_MM_S:g}",
        unit="mm/s",
        advice=_ADVICE,
        reads=_ends,
        also=Speed,
    ),
]
ForceRange = Annotated[
    tuple[Force, Force] | Recorded,
    key(
        "lowest and highest force, likewise",
        expected=f"the lowest and the highest force, above 0 and up to {HIGHEST_FORCE_N:g}",
        unit="N",
        advice=_ADVICE,
        reads=_ends,
        also=Force,
    ),
]
StrokeRate = Annotated[
    float,
    key("strokes back and forth per second (2)", unit="Hz", ge=0, le=FASTEST_STROKES_HZ),
]


@dataclass(frozen=True, kw_only=True)
class HandRange(FileSection):
    """A hand that may stay anywhere within a range of speeds and forces, or within all recorded.

    In every stroke it goes back and forth up to the highest speed and presses up and down through
    all forces: what a parameter update comes too late for.
    """

    WHERE: ClassVar[str] = "[hand]"
    speed_mm_s: SpeedRange
    force_n: ForceRange
    stroke_hz: StrokeRate = STROKE_HZ

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("speed_mm_s", "force_n"):
            _check_order(f"{name} under [hand]", getattr(self, name))


@dataclass(frozen=True, kw_only=True)
class Place(FileSection):
    """Where a hand is, and for what share of its time."""

    WHERE: ClassVar[str] = "[[hand.place]]"
    speed_mm_s: Annotated[Speed, key("speed of the hand")]
    force_n: Annotated[Force, key("its force")]
    share: Annotated[float, key("share of its time; any sum", gt=0, le=1e9)]


@dataclass(frozen=True, kw_only=True)
class HandTable(FileSection):
    """The hand of a scene file: a range, a recorded hand, or places with their shares."""

    WHERE: ClassVar[str] = "[hand]"
    speed_mm_s: SpeedRange | None = None
    force_n: ForceRange | None = None
    stroke_hz: StrokeRate | None = None
    file: Annotated[Path, key("a recorded hand: time_s, speed_mm_s, force_n (CSV)")] | None = None
    place: Annotated[tuple[Place, ...], key("or a distribution: places with shares")] = ()

    def hand(self) -> HandUse:
        """The one hand that it describes."""
        ranged = [name for name in ("speed_mm_s", "force_n") if getattr(self, name) is not None]
        kinds = [bool(ranged), self.file is not None, bool(self.place)]
        if sum(kinds) != 1 or len(ranged) == 1:
            given = [name for name, value in vars(self).items() if value not in (None, ())]
            raise InputError(
                "expected one hand under [hand]: speed_mm_s and force_n, or a file, or tables "
                f"[[hand.place]], got {', '.join(given) or 'none'}; give one of the three."
            )
        stroke_hz = STROKE_HZ if self.stroke_hz is None else self.stroke_hz
        if self.file is not None:
            if self.stroke_hz is not None:
                raise InputError(
                    "expected no stroke_hz beside a recorded hand, whose strokes are known, got "
                    f"{shown(self.stroke_hz)}; remove it."
                )
            return recorded_hand(load_trajectory(self.file, name=self.file.stem))
        if self.place:
            columns = [[getattr(place, name) for place in self.place] for name in _PLACE]
            return distributed_hand(*columns, stroke_hz=stroke_hz)
        return HandRange(**{name: getattr(self, name) for name in ranged}, stroke_hz=stroke_hz)


_PLACE = tuple(f.name for f in fields(Place))


@dataclass(frozen=True, eq=False, kw_only=True)
class HandPlaces:
    """A hand by the places where it is, and for what share of its time.

    Parameters
    ----------
    speed_mm_s, force_n : (n,) array_like
        > 0; what is not contact is no place.
    share : (n,) array_like
        > 0; any sum.
    speed_change_mm_s2, force_change_n_s : (n,) array_like
        How fast the hand's speed and force change there, ≥ 0.
    kind : str
        Where it comes from, for tables: "recorded" or "distribution".
    """

    speed_mm_s: Floats
    force_n: Floats
    share: Floats
    speed_change_mm_s2: Floats
    force_change_n_s: Floats
    kind: str

    def __post_init__(self) -> None:
        for name in _HAND_ARRAYS:
            value = np.array(getattr(self, name), dtype=np.float64)
            value.setflags(write=False)
            object.__setattr__(self, name, value)
        if not self.share.size:
            raise InputError(
                "expected a hand that touches and moves, got none that does; give one that strokes."
            )
        object.__setattr__(self, "share", self.share / self.share.sum())

    @property
    def ranges(self) -> tuple[Range, Range]:
        """Lowest and highest speed and force."""
        speed, force = self.speed_mm_s, self.force_n
        return (float(speed.min()), float(speed.max())), (float(force.min()), float(force.max()))

    def to_dict(self) -> dict[str, Any]:
        """Plain values: those of a distribution, of a recorded hand what it covers and its hash."""
        if self.kind == "distribution":
            places = zip(self.speed_mm_s, self.force_n, self.share, strict=True)
            return {"place": [dict(zip(_PLACE, map(float, p), strict=True)) for p in places]}
        speed, force = self.ranges
        content = repr([getattr(self, name).tolist() for name in _HAND_ARRAYS])
        return {
            "recorded": sha256_of(content),
            "speed_mm_s": list(speed),
            "force_n": list(force),
        }


_HAND_ARRAYS = tuple(f.name for f in fields(HandPlaces) if f.name != "kind")
HandUse = HandRange | HandPlaces


def recorded_hand(trajectory: Trajectory) -> HandPlaces:
    """What a recorded hand does, read every 5 ms while it touches and moves."""
    time_s = np.arange(0.0, trajectory.duration_s + READ_EVERY_S / 2, READ_EVERY_S)
    speed, force = trajectory.at(time_s)
    if time_s.size > 1:
        changes = [np.abs(np.gradient(x, READ_EVERY_S)) for x in (speed, force)]
    else:
        changes = [np.zeros(1), np.zeros(1)]
    with np.errstate(invalid="ignore"):
        touches = (np.abs(speed) > 0) & (force > 0) & np.isfinite(speed) & np.isfinite(force)
    return HandPlaces(
        speed_mm_s=np.abs(speed[touches]),
        force_n=force[touches],
        share=np.ones(int(touches.sum())),
        speed_change_mm_s2=np.nan_to_num(changes[0][touches], posinf=0.0),
        force_change_n_s=np.nan_to_num(changes[1][touches], posinf=0.0),
        kind="recorded",
    )


def distributed_hand(
    speed_mm_s: ArrayLike, force_n: ArrayLike, share: ArrayLike, *, stroke_hz: float = STROKE_HZ
) -> HandPlaces:
    """A hand by its shares of the time at (n,) speeds and forces; strokes as in `HandRange`."""
    speed, force = np.asarray(speed_mm_s, dtype=float), np.asarray(force_n, dtype=float)
    omega = 2 * np.pi * stroke_hz
    speed_change = omega * np.sqrt(speed.max() ** 2 - speed**2)
    return HandPlaces(
        speed_mm_s=speed,
        force_n=force,
        share=np.asarray(share, dtype=float),
        speed_change_mm_s2=speed_change,
        force_change_n_s=np.full(force.size, omega * np.ptp(force) / 2),
        kind="distribution",
    )


Frequency = Annotated[float, key(unit="Hz", gt=0, le=1e6)]
Positive = Annotated[float, key(gt=0, as_given=True)]
Amount = Annotated[float, key(ge=0, le=HIGHEST_BUDGET, as_given=True)]


@dataclass(frozen=True, kw_only=True)
class Actuator(FileSection):
    """What plays the output; None for no such limit."""

    WHERE: ClassVar[str] = "[actuator]"
    band_hz: (
        Annotated[
            tuple[Frequency, Frequency],
            key(
                "what it can play; without it all",
                expected="the lowest and the highest frequency, above 0 and up to 1000000 Hz,",
                unit="Hz",
                advice="give both ends",
            ),
        ]
        | None
    ) = None
    rate_hz: (
        Annotated[Rate, key("its sampling rate; without it the models'", as_given=True)] | None
    ) = None
    peak_g: Annotated[Positive, key("largest value of the output", unit="g")] | None = None
    rms_g: Annotated[Positive, key("largest RMS value of the output", unit="g")] | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.band_hz is None:
            return
        _check_order("band_hz under [actuator]", self.band_hz)
        if self.band_hz[0] == self.band_hz[1]:
            raise InputError(
                f"expected a band_hz from a lower to a higher frequency, got {self.band_hz[0]:g} "
                "Hz twice; give both ends."
            )

    @cached_property
    def limits(self) -> Limits:
        """As a renderer takes them."""
        given = {"peak": self.peak_g, "rms": self.rms_g}
        return Limits(**{name: float(value) for name, value in given.items() if value is not None})


@dataclass(frozen=True, kw_only=True)
class Bound(FileSection):
    """How far a compiled model may be from what is felt of the full one, wherever the hand is.

    The full model's response is known exactly, so that a GFC of 1 is attainable.
    """

    WHERE: ClassVar[str] = "[bound]"
    gfc30: Annotated[float, key("least share of the attainable GFC with σ = 30 Hz", ge=0, le=1)] = (
        0.95
    )
    bands_db: Annotated[
        float,
        key(
            "largest RMS error of the levels in nine bands, 10 … 480 Hz",
            unit="dB",
            ge=0,
            le=HIGHEST_BOUND_DB,
        ),
    ] = 1.0
    level_db: Annotated[
        float,
        key("largest error of the level of the whole band", unit="dB", ge=0, le=HIGHEST_BOUND_DB),
    ] = 1.0

    def widened(self, factor: float) -> Bound:
        """The bound with every error that it allows this many times as large."""
        angle = min(np.arccos(self.gfc30) * factor, np.pi / 2)
        return Bound(
            gfc30=float(np.cos(angle)),
            bands_db=min(self.bands_db * factor, HIGHEST_BOUND_DB),
            level_db=min(self.level_db * factor, HIGHEST_BOUND_DB),
        )


@dataclass(frozen=True, kw_only=True)
class Budget(FileSection):
    """What a scene may cost at most; a micro-controller gives what is not given."""

    WHERE: ClassVar[str] = "[budget]"
    operations: Annotated[Amount, key("operations per sample of any texture")] | None = None
    device: Annotated[str, key("or a micro-controller (modeling/scenes/shipped)")] | None = None
    bytes: Annotated[Amount, key("bytes of tables and state of all textures")] | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.device is not None:
            if self.operations is not None:
                raise InputError(
                    "expected operations or a device under [budget], got both, which may "
                    "contradict each other; remove one."
                )
            MicroController.named(self.device)

    def most_operations(self, rate_hz: float) -> float:
        """Operations per sample at a rate; infinite where there is no limit."""
        if self.device is not None:
            return MicroController.named(self.device).operations_per_sample(rate_hz)
        return np.inf if self.operations is None else float(self.operations)

    @property
    def most_bytes(self) -> float:
        """Infinite where there is no limit."""
        if self.bytes is not None:
            return float(self.bytes)
        if self.device is not None:
            return float(MicroController.named(self.device).memory_bytes)
        return np.inf


@dataclass(frozen=True, kw_only=True)
class SceneFile(DescribedFile):
    """What a scene file holds; `Scene.load` makes the scene of it."""

    WHAT: ClassVar[str] = "a scene"
    WHERE: ClassVar[str] = "[scene]"
    VERSION: ClassVar[int] = 1
    name: Annotated[Name, key("what tables and compiled models call it")]
    models: (
        Annotated[Path, key("folder of full models; without it given on the command line")] | None
    ) = None
    textures: Annotated[TextureNames, key("their names; without it all of the folder")] = ()
    threshold: Annotated[
        NameOrFile, key("codec, pen-hold, mobile, or a TSV; what is below it is dropped")
    ] = CODEC
    margin_db: Annotated[
        float,
        key(
            "how far below the threshold a layer must be to be dropped",
            unit="dB",
            ge=0,
            le=HIGHEST_MARGIN_DB,
        ),
    ] = 0.0
    hand: Annotated[HandTable, key("what hands will do")]
    actuator: Annotated[Actuator, key("what plays the output")] = Actuator()
    bound: Annotated[Bound, key("how far from the full model")] = Bound()
    budget: Annotated[Budget, key("what it may cost")] = Budget()


@dataclass(frozen=True, eq=False, kw_only=True)
class Scene:
    """What is to be rendered, for which hand, by which actuator, how well and at what cost.

    Parameters
    ----------
    name, textures, margin_db, actuator, bound, budget, models
        As a scene file has them (docs/scene-file.md).
    hand : HandRange or HandPlaces
        What hands will do.
    threshold : Threshold
        What is below it in this scene is dropped.
    files : tuple of Path
        Where all of this comes from: the scene's file, and those that it names.

    Raises
    ------
    InputError
        For values out of range, and for those that contradict each other.
    """

    name: str
    hand: HandUse
    textures: tuple[str, ...] = ()
    threshold: Threshold = field(default_factory=lambda: Threshold.named("codec"))
    margin_db: float = 0.0
    actuator: Actuator = field(default_factory=Actuator)
    bound: Bound = field(default_factory=Bound)
    budget: Budget = field(default_factory=Budget)
    models: Path | None = None
    files: tuple[Path, ...] = ()

    def __post_init__(self) -> None:
        for name in ("name", "textures", "margin_db"):
            held = SceneFile.of_field(name, getattr(self, name))
            object.__setattr__(self, name, held)

    def to_dict(self) -> dict[str, Any]:
        """Plain values of all that a compiled model follows from, but the models."""
        return {
            "name": self.name,
            "textures": list(self.textures),
            "threshold": self.threshold.name,
            "threshold_sha256": self.threshold.sha256,
            "margin_db": self.margin_db,
            "hand": self.hand.to_dict(),
            "actuator": self.actuator.to_dict(),
            "bound": self.bound.to_dict(),
            "budget": self.budget.to_dict(),
        }

    @cached_property
    def sha256(self) -> str:
        """SHA-256 of its values, by which compiled models name the scene that they are for."""
        return sha256_of_values(self.to_dict())

    @staticmethod
    def load(path: str | Path) -> Scene:
        """Read a scene file (TOML); its paths are relative to it.

        Raises
        ------
        InputError
            If the file is missing, no TOML or of another version, has unknown or missing keys, or
            values that are out of range or contradict each other; likewise of the recorded hand
            and the threshold that it names.
        """
        file = Path(path)
        stated = SceneFile.load(file)
        with naming(file):
            named = [one for one in (stated.hand.file, stated.threshold.file) if one is not None]
            own = {key.field: getattr(stated, key.field) for key in keys_of(SceneFile)}
            return Scene(
                **own
                | {
                    "hand": stated.hand.hand(),
                    "threshold": Threshold.named(stated.threshold),
                    "files": (file, *named),
                }
            )


def _check_order(name: str, ends: AskedRange) -> None:
    if not isinstance(ends, str) and ends[0] > ends[1]:
        raise InputError(
            f"expected the lowest {name} before the highest, got {ends[0]:g} before {ends[1]:g}; "
            "swap them."
        )
