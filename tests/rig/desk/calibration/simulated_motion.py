"""Tools on a soft wall that a servo renders, many at once, simulated in virtual time."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from tactileq.modeling.arrays import Floats
from tactileq.rig.desk.calibration.damping import RUN_S, RUNS, Run, sines

PERIOD_S = 1e-3
SOFT_N_PER_MM = 0.1
REST_N = 0.5
RESOLUTION_MM = 0.01


def _none() -> Floats:
    return np.zeros(1)


@dataclass(frozen=True, kw_only=True)
class Tools:
    """Devices, each figure (n,) or (1,), whose force comes one period late.

    Parameters
    ----------
    dry_n, noise_n : ndarray
        Coulomb friction; standard deviation of a force that changes every millisecond.
    beside_n_per_mm : ndarray
        Of another surface on which the tool rests, too.
    """

    mass_kg: Floats
    damping_n_s_per_m: Floats
    dry_n: Floats = field(default_factory=_none)
    noise_n: Floats = field(default_factory=_none)
    beside_n_per_mm: Floats = field(default_factory=_none)


def moved(tools: Tools, *, peak_n: float, seed: int) -> list[list[Run]]:
    """The runs of each tool.

    Between two ticks a mass with viscous damping moves exactly; dry friction and noise are pulses.
    """
    rng = np.random.default_rng(seed)
    m, b = tools.mass_kg, tools.damping_n_s_per_m
    ticks = round(RUN_S / PERIOD_S) + 1
    times = np.arange(ticks) * PERIOD_S
    peaks = [peak_n * (0.5 if run % 2 else 1.0) for run in range(RUNS + 1)]
    forces = [sines(rng, peak_n=peak) for peak in peaks]
    asked = times[::2]  # the host asks for another force every second tick
    press = np.array([[REST_N + force(at) for at in asked] for force in forces])
    rest = 1e-3 * REST_N / SOFT_N_PER_MM
    place, speed = np.full(m.shape, rest), np.zeros(m.shape)
    given = np.zeros(m.shape)
    shown = np.empty((RUNS + 1, ticks, m.size))
    decay = np.exp(-b / m * PERIOD_S)
    reach, held = m / b * (1 - decay), tools.dry_n * PERIOD_S / m
    noise = rng.normal(size=(RUNS + 1, ticks)) * PERIOD_S
    for run, tick in np.ndindex(RUNS + 1, ticks):
        shown[run, tick] = read_mm = RESOLUTION_MM * np.rint(1e3 / RESOLUTION_MM * place)
        late, given = given, press[run, tick // 2] - SOFT_N_PER_MM * read_mm
        steady = (late - 1e3 * tools.beside_n_per_mm * (place - rest)) / b
        place = place + steady * PERIOD_S + (speed - steady) * reach
        speed = steady + (speed - steady) * decay + noise[run, tick] * tools.noise_n / m
        speed = np.sign(speed) * np.maximum(0, np.abs(speed) - held)
    return [
        [
            Run(
                time_s=times,
                depth_mm=shown[run, :, tool],
                pressed_s=asked,
                press_n=press[run],
                peak_n=peaks[run],
            )
            for run in range(1, RUNS + 1)  # the first one only settles
        ]
        for tool in range(m.size)
    ]
