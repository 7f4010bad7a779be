"""A benchmark: the cost of rendering compared with alternatives.

Results: docs/method/rendering.md#cost.
"""

from __future__ import annotations

import itertools
import platform
import subprocess
import sys
import sysconfig
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from scipy.stats import linregress

from tactileq.benches.rendering.coefficients import tabled_predictor
from tactileq.benches.rendering.rivals import (
    AR,
    COMPILED,
    KERNEL,
    RATE_HZ,
    RIVAL_FORMS,
    CompiledStream,
    LfilterStream,
    SosfiltStream,
    SoundStream,
    compiled_parts,
    layered_texture,
    operations,
    predictor_of,
)
from tactileq.benches.rendering.stored_sounds import Loops, make_loops
from tactileq.benches.rendering.timer import Turn, turn_ns
from tactileq.modeling import Renderer, TextureModel
from tactileq.modeling.arrays import Floats
from tactileq.modeling.hand import Hand
from tactileq.modeling.rendering.noise import stream_key
from tactileq.modeling.rendering.plan import LayeredModel, RenderPlan
from tactileq.modeling.rendering.reference.bands import BandFilter
from tactileq.modeling.rendering.reference.engine import PythonEngine

LAYERS = (1, 3, 8)
UPDATES = (1, 5, 32)
BLOCKS = (32, 1024)
SWEEP = (1, 2, 3, 4, 6, 8, 12, 16)
SWEEP_UPDATE = 5
SOUND_CARD_HZ, SOUND_CARD_UPDATE = 48_000.0, 48
SOSFILT, LFILTER, PYTHON, LOOPED = "sosfilt", "lfilter", "Python", "looped wavetables"
# As users call it: two numbers and an array of their own for each block.
RENDERER = "Renderer"
BY_BLOCK = (SOSFILT, LFILTER, RENDERER)
# How a row was called: all samples in one call, one call of C for each parameter update, one call
# from Python for each block, at the rate of a sound card.
ONE_CALL, LIVE, FROM_PYTHON, SOUND_CARD = "one call", "live", "from Python", "48 kHz"
STROKE_HZ, FASTEST_MM_S, FORCE_N = 2.0, 300.0, (0.8, 2.4)
_PYTHON_SAMPLES = 1000
_SHARE_OF_BLOCKS = 8  # one of so many blocks of a turn is rendered by scipy, each timed by itself
_IMPORT = (
    "from time import perf_counter; start = perf_counter(); import tactileq.modeling; "
    "print(perf_counter() - start)"
)


@dataclass(frozen=True)
class BenchEffort:
    """How long to measure: samples per turn, turns of everything, starts of Python."""

    samples: int = 20480
    turns: int = 40
    starts: int = 5

    @property
    def parts(self) -> int:
        """Parts of which progress is reported: the turns, and the starts."""
        return self.turns + 1


QUICK = BenchEffort(samples=2048, turns=2, starts=1)


@dataclass(frozen=True)
class Line:
    """Cost against the number of layers: ns per sample, by least squares."""

    ns_per_layer: float
    ns_at_none: float
    r_squared: float


@dataclass(frozen=True, eq=False, kw_only=True)
class RenderingBench:
    """What was measured, in one run.

    Parameters
    ----------
    times : DataFrame
        One row per measurement: called (`ONE_CALL`, `LIVE`, `FROM_PYTHON` or `SOUND_CARD`), filter,
        layers, update_samples, ns_per_sample (the best of all turns, noise included).
    memory_bytes : int
        Of one stream of three layers, beside the model's table.
    import_s : float
        Time to import `modeling`, median of processes of their own.
    machine, compiler : str
        Processor; compiler and flags.
    """

    times: pd.DataFrame
    memory_bytes: int
    import_s: float
    machine: str
    compiler: str

    @property
    def throughput(self) -> pd.DataFrame:
        """Filters in C in one call: layers, update_samples, ns per filter, and ratios."""
        return self._filters(ONE_CALL)

    @property
    def live(self) -> pd.DataFrame:
        """Filters in C, one call for each parameter update; columns as of `throughput`."""
        return self._filters(LIVE)

    def _filters(self, called: str) -> pd.DataFrame:
        wide = self._wide(called, COMPILED)
        for name in RIVAL_FORMS:
            wide[f"{KERNEL} / {name}"] = wide[KERNEL] / wide[name]
        wide[f"{AR} / kernel"] = wide[AR] / wide[KERNEL]
        return wide

    @property
    def blocks(self) -> pd.DataFrame:
        """From Python by block, with one update each: layers, block_samples, ns, and ratios."""
        wide = self._wide(FROM_PYTHON, BY_BLOCK)
        for name in (SOSFILT, LFILTER):
            wide[f"{name} / {RENDERER}"] = wide[name] / wide[RENDERER]
        return wide.rename(columns={"update_samples": "block_samples"})

    def _wide(self, called: str, names: Sequence[str]) -> pd.DataFrame:
        here = (self.times["called"] == called) & self.times["layers"].isin(LAYERS)
        rows = self.times[here & self.times["filter"].isin(names)]
        wide = rows.pivot_table(
            index=["layers", "update_samples"], columns="filter", values="ns_per_sample"
        )
        return wide[list(names)].rename_axis(columns=None).reset_index()

    @property
    def sweep(self) -> pd.DataFrame:
        """The kernel and AR(20) in one call over `SWEEP` layers, updates every `SWEEP_UPDATE`.

        layers, ns_per_sample, and ar_ns_per_sample, which is the same for any number of layers.
        """
        here = (self.times["called"] == ONE_CALL) & (self.times["update_samples"] == SWEEP_UPDATE)
        by_filter = {
            name: self.times[here & (self.times["filter"] == name)] for name in (KERNEL, AR)
        }
        swept = by_filter[KERNEL].sort_values("layers")[["layers", "ns_per_sample"]]
        ar_ns = by_filter[AR].loc[by_filter[AR]["layers"] == 3, "ns_per_sample"].iloc[0]
        return swept.assign(ar_ns_per_sample=ar_ns).reset_index(drop=True)

    @property
    def line(self) -> Line:
        """Through the kernel's sweep."""
        fit = linregress(self.sweep["layers"], self.sweep["ns_per_sample"])
        return Line(float(fit.slope), float(fit.intercept), float(fit.rvalue) ** 2)

    @property
    def operations(self) -> pd.DataFrame:
        """What each form needs for a sample: filter, layers, products, sums."""
        rows = [
            {"filter": name, "layers": layers, **operations(name, layers)._asdict()}
            for layers in LAYERS
            for name in COMPILED
        ]
        return pd.DataFrame(rows)

    @property
    def python_ns(self) -> float:
        """ns per sample where nothing was compiled, at 3 layers."""
        return float(self.times.loc[self.times["filter"] == PYTHON, "ns_per_sample"].iloc[0])

    @property
    def sound_card_ns(self) -> float:
        """ns per sample of the kernel at 48 kHz, 3 layers, an update each millisecond."""
        return self._at_sound_card_ns(KERNEL)

    @property
    def looped_ns(self) -> float:
        """The same of looped wavetables, which hold samples at 48 kHz."""
        return self._at_sound_card_ns(LOOPED)

    def _at_sound_card_ns(self, name: str) -> float:
        here = (self.times["called"] == SOUND_CARD) & (self.times["filter"] == name)
        return float(self.times.loc[here, "ns_per_sample"].iloc[0])

    @property
    def aims(self) -> pd.DataFrame:
        """Every target with its measurement: what, where, aim, measured, met.

        By the operations that each form needs (docs/method/rendering.md#cost).
        """
        rows = [
            _aim(f"{KERNEL} / {name}, {called}", at, row[f"{KERNEL} / {name}"], most=most)
            for called, table, most in (
                (ONE_CALL, self.throughput, 1.6),
                (LIVE, self.live, 2.0),
            )
            for name in RIVAL_FORMS
            for at, row in _places(table, "update_samples")
        ]
        for at, row in _places(self.blocks, "block_samples"):
            least = {32: 100.0, 1024: 5.0}[row["block_samples"]]
            what = f"{SOSFILT} / {RENDERER}"
            rows.append(_aim(what, at, row[what], least=least))
        sweep = f"{SWEEP[0]} to {SWEEP[-1]} layers"
        rows.append(_aim("cost is linear in layers: R²", sweep, self.line.r_squared, least=0.99))
        rows.append(
            _aim("import tactileq.modeling, s", "a process of its own", self.import_s, most=0.5)
        )
        return pd.DataFrame(rows)


def _places(table: pd.DataFrame, by: str) -> list[tuple[str, dict[str, Any]]]:
    """Each row of a wide table, with words for where it was measured."""
    word = "updates every" if by == "update_samples" else "blocks of"
    rows: list[dict[str, Any]] = table.to_dict(orient="records")  # type: ignore[assignment]
    return [(f"layers {row['layers']:.0f}, {word} {row[by]:.0f}", row) for row in rows]


def _aim(
    what: str, where: str, measured: float, *, least: float | None = None, most: float | None = None
) -> dict[str, Any]:
    met = measured >= least if least is not None else measured <= (most or 0.0)
    aim = f"≥ {least:g}" if least is not None else f"≤ {most:g}"
    return {"what": what, "where": where, "aim": aim, "measured": measured, "met": bool(met)}


def stroke(samples: int, *, rate_hz: float) -> Hand:
    """A hand that moves to and fro under a slowly changing force."""
    time_s = np.arange(samples) / rate_hz
    speed = FASTEST_MM_S * np.sin(2 * np.pi * STROKE_HZ * time_s)
    low, high = FORCE_N
    force = low + (high - low) * (0.5 + 0.5 * np.cos(2 * np.pi * STROKE_HZ / 3 * time_s))
    return Hand(speed, force)


class Setting(NamedTuple):
    """What a row of the times is about."""

    called: str
    filter: str
    layers: int
    update_samples: int


def bench_rendering(
    effort: BenchEffort | None = None, *, progress: Callable[[str], None] = lambda part: None
) -> RenderingBench:
    """Time the kernel and its rivals, all in turn, so that disturbances affect all of them.

    What is timed as a whole takes about as long for a fast filter as for a slow one (many samples
    of a fast one, one block of a slow one): the longer it took, the more of other load it would
    catch. Of all turns the best counts.

    Parameters
    ----------
    effort : BenchEffort, optional
        How long to measure; the default takes about half a minute.
    progress : callable
        Called with each of the effort's `parts` when it is done.

    Raises
    ------
    InputError
        Where the parts in C were not compiled at installation.
    """
    effort = effort or BenchEffort()
    work = _in_python() | _at_sound_card(effort) | _sweep(effort)
    for layers in LAYERS:
        for update in UPDATES:
            work |= _filters_in_c(layers, update, effort)
        for block in BLOCKS:
            work |= _by_block(layers, block, effort)
    best = dict.fromkeys(work, np.inf)
    for turn in range(effort.turns):
        for setting, ns in turn_ns(work).items():
            best[setting] = min(best[setting], ns)
        progress(f"turn {turn + 1} of {effort.turns}")
    import_s = _import_s(effort.starts)
    progress("start")
    return RenderingBench(
        times=pd.DataFrame([{**key._asdict(), "ns_per_sample": ns} for key, ns in best.items()]),
        memory_bytes=_kernel_stream(3, SWEEP_UPDATE).kernel_bytes,
        import_s=import_s,
        machine=processor(),
        compiler=compiler(),
    )


def _filters_in_c(layers: int, update: int, effort: BenchEffort) -> dict[Setting, Turn]:
    texture = layered_texture(layers)
    models: dict[str, LayeredModel] = dict.fromkeys(COMPILED, texture)
    models[AR] = _predictor(layers)
    blocks = {ONE_CALL: effort.samples, LIVE: update}
    return {
        Setting(called, name, layers, update): _in_calls(
            CompiledStream(name, model, update_samples=update, seed=0), effort, block=block
        )
        for called, block in blocks.items()
        for name, model in models.items()
    }


@cache
def _predictor(layers: int) -> LayeredModel:
    return tabled_predictor(predictor_of(layered_texture(layers)))


def _by_block(layers: int, block: int, effort: BenchEffort) -> dict[Setting, Turn]:
    texture = layered_texture(layers)
    hand = stroke(effort.samples, rate_hz=RATE_HZ)
    readings = [(float(v), float(f)) for v, f in zip(*(x[::block] for x in hand), strict=True)]
    renderer, out = Renderer(texture, update_samples=block), np.empty(block)
    turns = {RENDERER: Turn(_rendering(renderer, readings, out), len(readings) * block)}
    for name, kind in ((SOSFILT, SosfiltStream), (LFILTER, LfilterStream)):
        stream, at = kind(texture, np.random.default_rng(0)), itertools.cycle(readings)
        one_block = partial(_next_block, stream, at, block)
        turns[name] = Turn(one_block, block, repeats=-(-len(readings) // _SHARE_OF_BLOCKS))
    return {Setting(FROM_PYTHON, name, layers, block): turn for name, turn in turns.items()}


def _rendering(
    renderer: Renderer, readings: list[tuple[float, float]], out: Floats
) -> Callable[[], None]:
    def render() -> None:
        for speed, force in readings:
            renderer.render(speed, force, out=out)

    return render


def _next_block(
    stream: SosfiltStream, readings: Iterator[tuple[float, float]], block: int
) -> Floats:
    return stream.render(*next(readings), block)


def _sweep(effort: BenchEffort) -> dict[Setting, Turn]:
    """Numbers of layers beside those that are compared with other filters."""
    return {
        Setting(ONE_CALL, KERNEL, layers, SWEEP_UPDATE): _in_calls(
            _kernel_stream(layers, SWEEP_UPDATE), effort
        )
        for layers in set(SWEEP) - set(LAYERS)
    }


def _in_python() -> dict[Setting, Turn]:
    """What renders where nothing was compiled."""
    texture = layered_texture(3)
    plan = RenderPlan(rate_hz=texture.rate_hz, update_samples=SWEEP_UPDATE)
    engine = PythonEngine(BandFilter(texture, plan), plan, key=stream_key(0))
    hand = stroke(_PYTHON_SAMPLES, rate_hz=RATE_HZ)
    turn = Turn(partial(engine.render, *hand), _PYTHON_SAMPLES)
    return {Setting(ONE_CALL, PYTHON, 3, SWEEP_UPDATE): turn}


def _at_sound_card(effort: BenchEffort) -> dict[Setting, Turn]:
    texture, update = layered_texture(3), SOUND_CARD_UPDATE
    stream = CompiledStream(KERNEL, texture, update_samples=update, seed=0, rate_hz=SOUND_CARD_HZ)
    hand, out = stroke(effort.samples, rate_hz=RATE_HZ), np.empty(effort.samples)
    loops = SoundStream(_loops_for_sound_card(texture), update_samples=update, seed=0)
    return {
        Setting(SOUND_CARD, KERNEL, 3, update): _in_calls(stream, effort),
        Setting(SOUND_CARD, LOOPED, 3, update): Turn(loops.calls(*hand, out), effort.samples),
    }


def _loops_for_sound_card(texture: TextureModel) -> Loops:
    """One second for each condition, of the texture up to its Nyquist frequency."""

    def magnitude(speed: float, force: float, frequency: Floats) -> Floats:
        inside = np.minimum(frequency, texture.rate_hz / 2)
        response = texture.peq(speed, force).response(inside)
        share = np.sqrt(SOUND_CARD_HZ / texture.rate_hz)
        return np.where(frequency <= texture.rate_hz / 2, share * response, 0.0)

    axes = texture.speeds_mm_s, texture.forces_n
    rng = np.random.default_rng(0)
    return make_loops(axes, magnitude, rate_hz=SOUND_CARD_HZ, seconds=1.0, rng=rng)


def _kernel_stream(layers: int, update: int) -> CompiledStream:
    return CompiledStream(KERNEL, layered_texture(layers), update_samples=update, seed=0)


def _in_calls(stream: CompiledStream, effort: BenchEffort, *, block: int | None = None) -> Turn:
    """All samples, in calls of so many; in one by default."""
    count = effort.samples
    hand = stroke(count, rate_hz=RATE_HZ)
    return Turn(stream.calls(*hand, np.empty(count), block=block or count), count)


def _import_s(starts: int) -> float:
    command = [sys.executable, "-c", _IMPORT]
    runs = [
        subprocess.run(command, capture_output=True, text=True, check=True) for _ in range(starts)
    ]
    return float(np.median([float(run.stdout) for run in runs]))


def processor() -> str:
    """Its name; none of the computer."""
    information = Path("/proc/cpuinfo")
    lines = information.read_text().splitlines() if information.is_file() else []
    named = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return (named or [platform.processor() or platform.machine()])[0]


def compiler() -> str:
    """What compiled the C parts, and all its flags: those of Python come first."""
    ffi, lib = compiled_parts("tactileq.benches.rendering._rivals")
    name, flags = ffi.string(lib.tq_build()).decode().rsplit(", ", 1)
    words = f"{sysconfig.get_config_var('CFLAGS') or ''} {flags}".split()
    # Paths are of the computer on which Python was built, and say nothing of speed.
    return f"{name}: {' '.join(word for word in words if '/' not in word)}"
