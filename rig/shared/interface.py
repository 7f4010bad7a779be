"""What an experiment sees of a rig, real or simulated."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from math import nan, sqrt
from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from tactileq.modeling.arrays import Floats
from tactileq.modeling.models.ar_model import ARModel
from tactileq.modeling.models.loading import AnyModel
from tactileq.modeling.rendering.plan import RenderCounters

Surface = Literal["none", "real", "virtual"]
SURFACES: tuple[Surface, ...] = ("none", "real", "virtual")
Range = tuple[float, float]


@dataclass(frozen=True)
class RigReading:
    """One reading of the hand.

    Parameters
    ----------
    time_s : float
        Since the rig was opened.
    speed_mm_s : float
        Tangential speed without its direction, ≥ 0. A rig renders from the speed with its sign
        (docs/method/rendering.md#extrapolation).
    force_n : float
        Normal force, ≥ 0; 0 off the surface.
    button : bool
        Whether the button was pressed since the last reading.
    """

    time_s: float
    speed_mm_s: float
    force_n: float
    button: bool
    simulated: bool


@dataclass(frozen=True, kw_only=True)
class ToneBurst:
    """A sinusoid with ramps at both ends, felt by a hand at rest (docs/method/live.md#signals).

    Parameters
    ----------
    frequency_hz : float
        Above 0.
    amplitude_g : float
        Of the sinusoid, peak, ≥ 0; 0 is as long a silence.
    duration_s : float
        Ramps included, above 0 … 60.
    """

    frequency_hz: float
    amplitude_g: float
    duration_s: float


@dataclass(frozen=True, eq=False, kw_only=True)
class PreparedSignal:
    """A signal and what is to be known of it.

    Parameters
    ----------
    samples_g : (n,) ndarray
    vibrator_sha256 : str, optional
        SHA-256 of the vibrator's file for which it is compensated; None for the vibration itself.
    simulated : bool
        Whether what it was made from was simulated.
    """

    samples_g: Floats
    rate_hz: float
    vibrator_sha256: str | None
    simulated: bool


@dataclass(frozen=True, eq=False, kw_only=True)
class Stimulus(PreparedSignal):
    """A file of a stimulus set that stands for a surface, felt by a hand at rest.

    Two are equal where one model was rendered in one condition, though with other noise
    (docs/method/live.md#signals).

    Parameters
    ----------
    sha256 : str
        Of the file.
    model_sha256 : str
        Of the model that it was rendered from; of the model's file where the set has no copy.
    made_from : frozenset of str
        SHA-256 of the models that this model says it was made from.
    condition : tuple of str
        Trajectory, speed, force, gain and vibrator, as the manifest of the set states them.
    """

    texture: str
    sha256: str
    model_sha256: str
    made_from: frozenset[str] = frozenset()
    condition: tuple[str, ...] = ()

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Stimulus) and self._rendered == other._rendered

    def __hash__(self) -> int:
        return hash(self._rendered)

    @property
    def _rendered(self) -> tuple[str, tuple[str, ...]]:
        return self.model_sha256, self.condition

    @property
    def duration_s(self) -> float:
        """Its length, fades included."""
        return self.samples_g.size / self.rate_hz


@dataclass(frozen=True)
class Fault:
    """Something that went wrong.

    Parameters
    ----------
    time_s : float
        When it was noticed, on the rig's clock.
    told : str
        One sentence.
    invalidates : bool
        Whether the participant cannot have felt what was to be presented.
    """

    time_s: float
    sentence: str
    invalidates: bool


@dataclass(frozen=True, eq=False, kw_only=True)
class HandRows:
    """What a hand did: n readings, 200 a second at least.

    Parameters
    ----------
    time_s : (n,) ndarray
        On the rig's clock, rising.
    speed_mm_s : (n,) ndarray
        Tangential, its sign the direction; NaN where nothing measures it.
    force_n : (n,) ndarray
        Normal, ≥ 0; NaN where nothing measures it.
    surface : (n,) ndarray of int
        What was presented then: a place in `SURFACES`.
    presentation : (n,) ndarray of int
        Number of the presentation, 0 where there was none.
    force_assumed : (n,) ndarray of bool
        Where no device measured the force.
    x_mm, y_mm, depth_mm : (n,) ndarray
        Position in the frame of a force device's wall, and how far below it; NaN without one.
    force_commanded : (n,) ndarray of bool
        Where the force is what a device was told to push with, not what a sensor said.
    beyond_edge : (n,) ndarray of bool
        Below the height of a wall that is shown, but beside it.
    """

    time_s: Floats
    speed_mm_s: Floats
    force_n: Floats
    surface: NDArray[np.int_]
    presentation: NDArray[np.int_]
    force_assumed: NDArray[np.bool_]
    x_mm: Floats = field(default_factory=lambda: np.zeros(0))
    y_mm: Floats = field(default_factory=lambda: np.zeros(0))
    depth_mm: Floats = field(default_factory=lambda: np.zeros(0))
    force_commanded: NDArray[np.bool_] = field(default_factory=lambda: np.zeros(0, dtype=bool))
    beyond_edge: NDArray[np.bool_] = field(default_factory=lambda: np.zeros(0, dtype=bool))

    def __post_init__(self) -> None:
        """What is not given is not known of any row."""
        rows = self.time_s.size
        for name in ("x_mm", "y_mm", "depth_mm"):
            if getattr(self, name).size != rows:
                object.__setattr__(self, name, np.full(rows, nan))
        for name in ("force_commanded", "beyond_edge"):
            if getattr(self, name).size != rows:
                object.__setattr__(self, name, np.zeros(rows, dtype=bool))

    def __len__(self) -> int:
        return self.time_s.size

    @staticmethod
    def joined(parts: Sequence[HandRows]) -> HandRows:
        """One after the other; no rows for no parts."""
        kinds = {"surface": np.int_, "presentation": np.int_} | dict.fromkeys(
            ("force_assumed", "force_commanded", "beyond_edge"), np.bool_
        )
        columns = {
            name: np.concatenate(
                [np.zeros(0, dtype=kinds.get(name, np.float64))]
                + [getattr(part, name) for part in parts]
            )
            for name in (f.name for f in fields(HandRows))
        }
        return HandRows(**columns)


@dataclass(frozen=True, kw_only=True)
class PresentationRecord:
    """What one presentation was, from its first sample to the last.

    Parameters
    ----------
    number : int
        From 1, since the rig was opened.
    surface : {"real", "virtual"}
    model_sha256 : str
        Of the model that was rendered, or of the stimulus's file; empty for a real surface.
    start_s, end_s : float
        On the rig's clock.
    speeds_mm_s, forces_n : (float, float), optional
        Lowest and highest condition of the model's grid; None of a signal, which has none.
    counters : RenderCounters
        What the renderer had to correct; samples that the limits touched.
    played_s : float
        Duration of the vibration that was played, silence under a resting hand included.
    dose_g2_s : float
        Its square (g²) over time, unweighted.
    weighted_dose_g2_s : float
        The same with the frequency weighting of the hand-arm system; 0 of a twin, which exposes
        nobody (docs/method/rendering.md#exposure).
    misses : int
        Blocks that the card had to do without.
    stale_blocks : int
        Blocks for which the hand was not read in time: rendered as lift-off.
    """

    number: int
    surface: Surface
    texture: str
    model_sha256: str = ""
    start_s: float
    end_s: float
    speeds_mm_s: Range | None = None
    forces_n: Range | None = None
    counters: RenderCounters = field(default_factory=RenderCounters)
    played_s: float = 0.0
    dose_g2_s: float = 0.0
    weighted_dose_g2_s: float = 0.0
    peak_g: float = 0.0
    misses: int = 0
    stale_blocks: int = 0

    @property
    def rms_g(self) -> float:
        """RMS of the vibration (g) over the time that it was played."""
        return sqrt(self.dose_g2_s / self.played_s) if self.played_s else 0.0


@dataclass(frozen=True, eq=False, kw_only=True)
class Acceleration:
    """What an accelerometer at the pen measured, without a gap.

    Parameters
    ----------
    start_s : float
        When the first sample was measured, on the rig's clock.
    samples_g : (n,) ndarray
    """

    start_s: float
    rate_hz: float
    samples_g: Floats


@dataclass(frozen=True, kw_only=True)
class RigHealth:
    """How a rig is now.

    Parameters
    ----------
    hand_age_s : float
        Age of the last reading of the hand; infinite without one.
    output_latency_s : float
        From a block's rendering to its first sample, as the card states it.
    misses, stale_blocks : int
        As in `PresentationRecord`, since the rig was opened.
    problems : tuple of str
        One sentence each; none where all is well.
    """

    hand_age_s: float = 0.0
    output_latency_s: float = 0.0
    misses: int = 0
    stale_blocks: int = 0
    problems: tuple[str, ...] = ()


class TextureRig(Protocol):
    """A device that puts surfaces under a hand, one at a time.

    All times are in seconds since it was opened. Between `open` and `close` it can be read; it is
    silent before the first presentation. While a virtual surface is presented a loop has to call
    `read`, best ten times a second: where nobody does for a second a rig falls silent, which is a
    fault (docs/method/live.md#heartbeat).
    """

    @property
    def simulated(self) -> bool:
        """Whether no real hand touches a real surface here."""

    @property
    def stated(self) -> Mapping[str, object]:
        """What data say of the rig: plain values, such as its file's SHA-256; empty of a twin."""

    @property
    def highest_exposure_m_s2(self) -> float:
        """Daily exposure A(8) after which nobody may be stimulated; infinite of a twin."""

    def open(self) -> None:
        """Start whatever plays and reads; InputError, in one sentence, where it cannot."""

    def close(self) -> None:
        """Fall silent and stop everything; harmless when closed already."""

    def arm(self) -> None:
        """Let a force device push from now on, also after a fault; nothing of a rig without one.

        Only where people have confirmed it: no rig arms itself. A device that cannot be armed
        reports a fault.
        """

    def now_s(self) -> float:
        """The rig's clock."""

    def health(self) -> RigHealth:
        """How the rig is now."""

    def present_model(self, model: AnyModel) -> float:
        """Render this model wherever the virtual surface is touched, from now on.

        Returns
        -------
        float
            When the first sample left.
        """

    def present_signal(self, signal: ToneBurst | Stimulus) -> float:
        """Play a signal once, whatever the hand does.

        A burst that still plays ends first; a stimulus is broken off.

        Returns
        -------
        float
            When the first sample left.

        Raises
        ------
        InputError
            For a signal beyond the rig's limits, or a stimulus that is not made for this rig.
        """

    def check_stimulus(self, stimulus: Stimulus) -> None:
        """Refuse a stimulus that the rig cannot play; it need not be open.

        Raises
        ------
        InputError
            For one at another rate, for another vibrator, or beyond the limits.
        """

    def strongest_g(self, burst: ToneBurst) -> float:
        """The highest amplitude (g) that the limits allow a burst of this frequency and length."""

    def present_real(self, texture: str) -> float:
        """Give way to the mounted real surface, whose texture is named; returns when."""

    def silence(self) -> None:
        """Present nothing: no vibration and no virtual surface."""

    def read(self) -> RigReading:
        """The hand as it is now."""

    def take_faults(self) -> tuple[Fault, ...]:
        """What went wrong since the last call."""

    def take_history(self) -> HandRows:
        """What the hand did since the last call."""

    def take_presentations(self) -> tuple[PresentationRecord, ...]:
        """The presentations that ended since the last call."""

    def take_acceleration(self) -> tuple[Acceleration, ...]:
        """What was measured at the pen during them; nothing without an accelerometer."""


Presentable = AnyModel | Stimulus


def grid_of(model: AnyModel) -> tuple[Range, Range]:
    """Lowest and highest speed (mm/s) and force (N) of the conditions of a model's grid."""
    grid = model if isinstance(model, ARModel) else model.table
    speeds, forces = grid.speeds_mm_s, grid.forces_n
    return (float(speeds[0]), float(speeds[-1])), (float(forces[0]), float(forces[-1]))
