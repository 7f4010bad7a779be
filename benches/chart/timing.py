"""How long a rendered sample takes, all methods in turn in one process."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from tactileq.benches.chart.fitted import Fitted, Layered, update_samples
from tactileq.benches.chart.rival_costs import COST_RATE_HZ
from tactileq.benches.chart.rival_fits import Filtered, Grained, Looped, Shaped
from tactileq.benches.rendering.coefficients import BandTable
from tactileq.benches.rendering.rivals import BANDS, COEFFICIENTS, CompiledStream, SoundStream
from tactileq.benches.rendering.timer import Turn, turn_ns
from tactileq.modeling import Renderer
from tactileq.modeling.hand import Hand

TURNS = 20
WARM_UP = 2
SAMPLES = 4096
SPEEDS_MM_S, FORCES_N = (60.0, 300.0), (1.0, 3.0)
_BLOCKS = 8  # of FFT-shaped noise in a turn

# Kind of surface, method, blending, update interval (ms) and precision of a row.
Key = tuple[str, str, str, float, str]
KEY = ["kind", "method", "blending", "update_ms", "precision"]


def time_table(streams: Mapping[Key, Turn], *, turns: int = TURNS) -> pd.DataFrame:
    """Nanoseconds per rendered sample: median and quartiles over the turns.

    In every turn each stream renders a few thousand samples; the first turns warm up. So whatever
    slows the machine down for a while slows all of them.

    Returns
    -------
    DataFrame
        kind, method, blending, update_ms, precision, ns, ns_25, ns_75.
    """
    taken = {key: np.empty(turns) for key in streams}
    for turn in range(-WARM_UP, turns):
        for key, one in turn_ns(streams).items():
            if turn >= 0:
                taken[key][turn] = one
    rows = []
    for key, ns in taken.items():
        low, median, high = np.percentile(ns, [25, 50, 75])
        rows.append((*key, median, low, high))
    return pd.DataFrame(rows, columns=[*KEY, "ns", "ns_25", "ns_75"])


def stream_of(fitted: Fitted, update_ms: float, *, single: bool) -> Turn | None:
    """What renders at 5 kHz along a moving hand; None of what is not timed.

    Layers by the program's renderer, in double or single precision; other filters and stored sounds
    by C written with equal care, FFT-shaped noise by NumPy.
    """
    hand, period = _hand(), update_samples(update_ms, COST_RATE_HZ)
    if isinstance(fitted, Shaped):
        return Turn(_shaped_stream(fitted), _BLOCKS * fitted.model.block // 2)
    if isinstance(fitted, Layered):
        renderer = Renderer(fitted.at_cost_rate, update_samples=period, single=single)
        own = np.empty(SAMPLES, dtype=np.float32 if single else np.float64)
        return Turn(partial(renderer.render, *hand, out=own), SAMPLES)
    out = np.empty(SAMPLES)
    if isinstance(fitted, Filtered):
        table = replace(fitted.model, rate_hz=COST_RATE_HZ)
        kind = BANDS if isinstance(table, BandTable) else COEFFICIENTS
        stream = CompiledStream(kind, table, update_samples=period, seed=0)
        return Turn(stream.calls(*hand, out, block=SAMPLES), SAMPLES)
    if isinstance(fitted, Looped | Grained):
        sounds = SoundStream(fitted.model, update_samples=period, seed=0)
        return Turn(sounds.calls(*hand, out), SAMPLES)
    return None


def _hand() -> Hand:
    return Hand(np.linspace(*SPEEDS_MM_S, SAMPLES), np.linspace(*FORCES_N, SAMPLES))


def _shaped_stream(fitted: Shaped) -> Callable[[], object]:
    rng: Any = np.random.default_rng(0)
    ends = (SPEEDS_MM_S, FORCES_N)
    places = np.stack([np.linspace(*end, _BLOCKS) for end in ends], axis=1).tolist()
    return lambda: fitted.model.render(places, rng)
