"""Many streams side by side: `many.h` by way of cffi, on all cores."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from tactileq.modeling.arrays import Floats
from tactileq.modeling.errors import InputError, counted
from tactileq.modeling.hand import Hand
from tactileq.modeling.models.ar_model import ARModel
from tactileq.modeling.models.parameter_table import ParameterTable
from tactileq.modeling.rendering.compiled import filled_texture, is_compiled, render_counters
from tactileq.modeling.rendering.limits import Limits
from tactileq.modeling.rendering.noise import stream_key
from tactileq.modeling.rendering.plan import (
    LayeredModel,
    Notch,
    RenderCounters,
    RenderPlan,
    plan_for,
    usual_update_s,
)
from tactileq.modeling.rendering.renderer import Renderer, as_floats
from tactileq.modeling.threads import in_order, usable_cores

try:
    from tactileq.modeling.rendering._many import ffi, lib
except ImportError:  # no compiler at installation, or one without vectors
    lib = ffi = None

WIDTHS = (2, 4, 8)  # streams in one vector
CACHE_LINE = 8  # numbers


def render_many(
    models: Sequence[LayeredModel | ARModel],
    hands: Sequence[tuple[ArrayLike, ArrayLike]],
    *,
    seeds: Sequence[int],
    streams: Sequence[int] | None = None,
    rate_hz: float | None = None,
    update_samples: int | None = None,
    limits: Limits | None = None,
    compensation: Notch | None = None,
) -> list[Floats]:
    """Vibrations of k models under k hands, each from its start.

    Bit-identical to `Renderer(models[i], seed=seeds[i], stream=streams[i], …).render(*hands[i])`
    one after the other, but parallel in the processor's vectors and on all cores that this
    process may use (docs/method/rendering.md#many-streams). Streams with the same number of layers,
    rates and update interval run together; an ARModel is rendered by itself.

    Parameters
    ----------
    models : (k,) sequence of TextureModel, RegressedModel or ARModel
        What to render; a model may occur several times.
    hands : (k,) sequence of pairs of (n_i,) array_like
        Tangential speed (mm/s, either direction) and normal force (N) at each sample, each pair of
        its own length. NaN and infinite values count as missing.
    seeds, streams : (k,) sequences of int
        Which noise, 0 … 2⁶⁴ − 1; streams are 0 by default.
    rate_hz, update_samples, limits, compensation : optional
        As for `Renderer`, the same for all.

    Returns
    -------
    list of (n_i,) ndarray
        Acceleration in the models' units (g).

    Raises
    ------
    InputError
        For sequences of different lengths, for a hand that is not two arrays of one length, and
        where `Renderer` refuses a model or an option.
    """
    streams = [0] * len(models) if streams is None else streams
    if not len(models) == len(hands) == len(seeds) == len(streams):
        raise InputError(
            "expected as many hands, seeds and streams as models, got "
            f"{counted(len(models), 'model')}, {counted(len(hands), 'hand')}, "
            f"{counted(len(seeds), 'seed')} and "
            f"{counted(len(streams), 'stream')}; give one of each for every signal."
        )
    options = {
        "rate_hz": rate_hz,
        "update_samples": update_samples,
        "limits": limits,
        "compensation": compensation,
    }
    checked = [_checked(number, hand) for number, hand in enumerate(hands)]
    noise = list(zip(seeds, streams, strict=True))
    return [signal for signal, _ in rendered(models, checked, noise, options=options)]


def rendered(
    models: Sequence[LayeredModel | ARModel],
    hands: Sequence[Hand],
    noise: Sequence[tuple[int, int]],
    *,
    options: dict[str, Any],
    lanes: int | None = None,
) -> list[tuple[Floats, RenderCounters]]:
    """Each signal, and what had to be corrected in it.

    `noise` is seed and stream of each; `options` are those of `Renderer`; `lanes` is how many
    streams go into one vector, by default as many as the processor can take.
    """
    if lib is None or not is_compiled():
        return [_alone(*each, options) for each in zip(models, hands, noise, strict=True)]
    results: dict[int, tuple[Floats, RenderCounters]] = {}
    textures: dict[int, _Texture] = {}
    alike: dict[tuple[float, ...], list[_Stream]] = defaultdict(list)
    for number, (model, hand, which) in enumerate(zip(models, hands, noise, strict=True)):
        if isinstance(model, ARModel):
            results[number] = _alone(model, hand, which, options)
            continue
        if id(model) not in textures:
            plan = plan_for(model.rate_hz, update_s=usual_update_s(model), **options)
            textures[id(model)] = _Texture(model, plan)
        texture = textures[id(model)]
        alike[texture.kind].append(_Stream(number, texture, stream_key(*which), hand))
    tasks = list(_tasks(alike.values(), lanes or lib.tq_widest()))
    # The calls of C let other threads run.
    done = in_order(_Task.run, tasks, threads=usable_cores())
    for task, corrected in zip(tasks, done, strict=True):
        for stream, counters in zip(task.streams, corrected, strict=True):
            results[stream.number] = stream.signal, counters
    return [results[number] for number in range(len(models))]


def _alone(
    model: LayeredModel | ARModel, hand: Hand, noise: tuple[int, int], options: dict[str, Any]
) -> tuple[Floats, RenderCounters]:
    renderer = Renderer(model, seed=noise[0], stream=noise[1], **options)
    return renderer.render(*hand), renderer.counters


class _Texture:
    """A layered model as `many.h` reads it, filled once for all its streams."""

    def __init__(self, model: LayeredModel, plan: RenderPlan) -> None:
        fields = plan.texture(model) | {"values": _rows(model.table)}
        self.filled, self._arrays = filled_texture(ffi, fields, np.float64)
        # What all streams of one vector have in common.
        self.kind = (self.filled.layers, model.rate_hz, plan.rate_hz, plan.own.update_samples)


def _rows(table: ParameterTable) -> Floats:
    """The values of a table in rows as `many.h` wants them."""
    layers, gains_at = table.n_layers, lib.tq_gains_at(table.n_layers)
    values = table.values.reshape(-1, 1 + 3 * layers)
    shape = values.shape[0], lib.tq_table_row(layers)
    spare = np.zeros(shape[0] * shape[1] + CACHE_LINE)
    start = -spare.ctypes.data % (8 * CACHE_LINE) // 8  # no load of a vector crosses a cache line
    rows = spare[start : start + shape[0] * shape[1]].reshape(shape)
    rows[:, 0 : 2 * layers : 2] = values[:, 1 : 1 + layers]
    rows[:, 1 : 2 * layers : 2] = values[:, 1 + layers : 1 + 2 * layers]
    rows[:, gains_at] = values[:, 0]
    rows[:, gains_at + 1 : gains_at + 1 + layers] = values[:, 1 + 2 * layers :]
    return rows


class _Stream:
    """One stream: where it belongs, what it renders, its noise and hand, and what comes of it."""

    def __init__(self, number: int, texture: _Texture, key: np.uint64, hand: Hand) -> None:
        self.number, self.texture, self.key, self.hand = number, texture, key, hand
        self.signal = np.empty(hand.speed_mm_s.size)


class _Task(NamedTuple):
    """Streams that are rendered together, in vectors of `lanes`; at most so many."""

    streams: list[_Stream]
    lanes: int

    def run(self) -> list[RenderCounters]:
        """Renders them; what had to be corrected in each."""
        filled = ffi.new("tq_stream[]", self.lanes)
        for lane in range(self.lanes):  # a lane without a stream has a count of 0
            stream = self.streams[min(lane, len(self.streams) - 1)]
            filled[lane].texture = stream.texture.filled[0]
        for lane, stream in enumerate(self.streams):
            filled[lane].key = int(stream.key)
            filled[lane].speed = ffi.from_buffer("double[]", stream.hand.speed_mm_s)
            filled[lane].force = ffi.from_buffer("double[]", stream.hand.force_n)
            filled[lane].out = ffi.from_buffer("double[]", stream.signal)
            filled[lane].count = stream.signal.size
        texture = filled[0].texture
        memory = np.empty(lib.tq_many_memory(texture.layers))
        lib.tq_render_many(filled, ffi.from_buffer("double[]", memory), self.lanes)
        return [render_counters(filled[lane].counters) for lane in range(len(self.streams))]


def _tasks(kinds: Iterable[list[_Stream]], lanes: int) -> Iterator[_Task]:
    """Streams of each kind by length, so that those of one vector end at about the same time.

    The last ones go into the narrowest vector that holds them.
    """
    for streams in kinds:
        longest_first = sorted(streams, key=lambda stream: -stream.signal.size)
        for start in range(0, len(streams), lanes):
            together = longest_first[start : start + lanes]
            narrowest = next(width for width in WIDTHS if width >= len(together))
            yield _Task(together, narrowest)


def _checked(number: int, hand: tuple[ArrayLike, ArrayLike]) -> Hand:
    got = f"{len(hand)} of them"
    if len(hand) == 2:
        speed, force = as_floats(*hand)
        if speed.ndim == 1 and speed.shape == force.shape:
            return Hand(speed, force)
        got = f"shapes {speed.shape}, {force.shape}"
    raise InputError(
        f"expected speed and force as two arrays of one length for signal {number}, got {got}; "
        "match them."
    )
