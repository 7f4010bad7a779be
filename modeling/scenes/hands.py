"""Hands of a scene: anywhere in ranges of speed and force, or at places with their weights.

docs/method/scenes.md
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from numpy.typing import ArrayLike

from tactileq.modeling.arrays import Floats
from tactileq.modeling.checks import HIGHEST_FORCE_N, HIGHEST_SPEED_MM_S, is_number
from tactileq.modeling.errors import InputError, shown
from tactileq.modeling.files.described import FileSection, key
from tactileq.modeling.files.hashes import sha256_of
from tactileq.modeling.recordings.trajectory import Trajectory, load_trajectory

STROKE_HZ = 2.0
FASTEST_STROKES_HZ = 20.0
READ_EVERY_S = 5e-3  # a recorded hand, for its speed, force and their slopes
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
            check_order(f"{name} under [hand]", getattr(self, name))


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


def check_order(name: str, ends: AskedRange) -> None:
    if not isinstance(ends, str) and ends[0] > ends[1]:
        raise InputError(
            f"expected the lowest {name} before the highest, got {ends[0]:g} before {ends[1]:g}; "
            "swap them."
        )


_PLACE = tuple(f.name for f in fields(Place))
_HAND_ARRAYS = tuple(f.name for f in fields(HandPlaces) if f.name != "kind")
HandUse = HandRange | HandPlaces
