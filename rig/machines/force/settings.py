"""A force device in plain numbers: which one, its limits, its frame."""

from __future__ import annotations

from dataclasses import dataclass

from tactileq.modeling.errors import InputError

MISSED_S = 0.02  # the watchdog acts after this time without a tick
UNWATCHED_S = 0.1  # a servo lets go after this time without its watchdog
JUMP_MM = 2.0
VELOCITY_HZ = 100.0
Vector = tuple[float, float, float]


@dataclass(frozen=True, kw_only=True)
class Pose:
    """Where the frame of the wall lies in that of the device: origin (mm), and unit vectors."""

    origin_mm: Vector = (0.0, 0.0, 0.0)
    x: Vector = (1.0, 0.0, 0.0)
    y: Vector = (0.0, 1.0, 0.0)
    z: Vector = (0.0, 0.0, 1.0)


@dataclass(frozen=True, kw_only=True)
class Vibration:
    """How a device that renders by itself vibrates.

    Parameters
    ----------
    peak_g : float
        Largest acceleration.
    scale : float
        What its converter is given for 1 g.
    weighting : bytes
        Of exposure: sections of five numbers (float64).
    seed : int
        Of the noise.
    """

    peak_g: float
    scale: float
    weighting: bytes
    seed: int = 0


@dataclass(frozen=True, kw_only=True)
class ForceSettings:
    """What the servo of a force device is started with; ranges are those of [force] in a rig file.

    Parameters
    ----------
    library : str, optional
        Path of libdhd, or "stand-in"; None looks for it where libraries are.
    serial : int, optional
        Which of several devices.
    address : str
        Port or socket of a device that renders by itself; empty for the maker's library.
    delay_s : float
        Of the tracking filter, which gives the speed of strokes.
    sound_s : float
        A wall is released where nothing was played for so long; 0 where nothing plays.
    probe_n : float
        Of the small force after arming, to which the tool has to give way; 0 for none.
    answer_s : float
        From a reading to the force that answers it, 0 … 0.02.
    watched : bool
        Whether a watchdog has to look on.
    vibration : Vibration, optional
        Of a device that renders the texture, too.
    """

    library: str | None = None
    serial: int | None = None
    address: str = ""
    baud: int = 1_000_000
    rate_hz: float = 1000.0
    delay_s: float = 0.01
    contact_n: float = 0.05
    most_n: float = 5.0
    most_n_per_s: float = 2000.0
    most_w: float = 5.0
    most_mm_s: float = 1000.0
    late_s: float = 0.004
    frozen_s: float = 0.25
    release_s: float = 0.05
    show_s: float = 0.2
    probe_n: float = 0.0
    answer_s: float = 0.0
    low_mm: Vector = (-100.0, -100.0, -100.0)
    high_mm: Vector = (100.0, 100.0, 100.0)
    pose: Pose = Pose()
    sound_s: float = 0.0
    watched: bool = True
    simulated: bool = False
    vibration: Vibration | None = None

    def check_late(self) -> None:
        """Refuse a limit that the watchdog would be faster than.

        Raises
        ------
        InputError
        """
        if not 1 / self.rate_hz < self.late_s < MISSED_S:
            raise InputError(
                f"expected a late reading between one period ({1e3 / self.rate_hz:g} ms) and the "
                f"watchdog's {1e3 * MISSED_S:g} ms, got {1e3 * self.late_s:g} ms; correct "
                "force.late_ms."
            )
