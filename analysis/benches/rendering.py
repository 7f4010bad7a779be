"""A bench: what rendering costs, beside what its users would run otherwise.

What came out: docs/method/rendering.md#cost.
"""

from __future__ import annotations

import platform
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from time import perf_counter
from typing import Any, TypeVar

import numpy as np
import pandas as pd
from scipy.stats import linregress

from analysis.benches.rivals import (
    AR,
    COMPILED,
    FORMS,
    KERNEL,
    RATE_HZ,
    CompiledStream,
    SosfiltStream,
    compiled_parts,
    layered_texture,
    predictor_of,
    tabled_predictor,
)
from modeling import Renderer
from modeling.hand import Hand
from modeling.rendering.noise import stream_key
from modeling.rendering.plan import LayeredModel, RenderPlan
from modeling.rendering.reference.bands import BandFilter
from modeling.rendering.reference.engine import PythonEngine

LAYERS = (1, 3, 8)
UPDATES = (1, 5, 32)
BLOCKS = (32, 1024)
SWEEP = (1, 2, 3, 4, 6, 8, 12, 16)
SWEEP_UPDATE = 5
SOSFILT, PYTHON = "sosfilt", "Python"
# Ours in blocks: as users call it, the bare call of C for each block, and one call for all of them.
RENDERER, CALLS, ONE_CALL = "Renderer", "kernel by block", "kernel in one call"
BY_BLOCK = (SOSFILT, RENDERER, CALLS, ONE_CALL)
# Timed parts: each pair of layers and updates, each pair of layers and blocks, the sweep, the rest.
PARTS = len(LAYERS) * (len(UPDATES) + len(BLOCKS)) + 2
STROKE_HZ, FASTEST_MM_S, FORCE_N = 2.0, 300.0, (0.8, 2.4)
_PYTHON_SAMPLES = 1000
_IMPORT = (
    "from time import perf_counter; start = perf_counter(); import modeling; "
    "print(perf_counter() - start)"
)

Name = TypeVar("Name")


@dataclass(frozen=True)
class Effort:
    """How long to measure: samples per turn, turns of everything, starts of Python."""

    samples: int = 20480
    turns: int = 15
    starts: int = 5


QUICK = Effort(samples=2048, turns=2, starts=1)


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
        One row per measurement: filter, layers, update_samples, ns_per_sample (the best of all
        turns, noise included).
    sweep : DataFrame
        The kernel over `SWEEP` layers, updates every `SWEEP_UPDATE` samples: layers,
        ns_per_sample.
    line : Line
        Through the sweep.
    memory_bytes : int
        Of one stream of three layers, beside the model's table.
    import_s : float
        Time to import `modeling`, median of processes of their own.
    machine : str
        Processor and compiler flags.
    """

    times: pd.DataFrame
    sweep: pd.DataFrame
    line: Line
    memory_bytes: int
    import_s: float
    machine: str

    @property
    def filters(self) -> pd.DataFrame:
        """Filters in C in one call: layers, update_samples, ns per filter, and ratios."""
        in_one_call = self.times[self.times["filter"].isin(COMPILED)]
        wide = _wide(in_one_call, "update_samples", COMPILED)
        for name in FORMS:
            wide[f"{KERNEL} / {name}"] = wide[KERNEL] / wide[name]
        wide[f"{AR} / kernel"] = wide[AR] / wide[KERNEL]
        return wide

    @property
    def blocks(self) -> pd.DataFrame:
        """By block, with one update each: layers, block_samples, ns, ratios to sosfilt."""
        by_block = self.times[self.times["filter"].isin(BY_BLOCK)]
        wide = _wide(by_block, "update_samples", BY_BLOCK)
        for name in BY_BLOCK[1:]:
            wide[f"{SOSFILT} / {name}"] = wide[SOSFILT] / wide[name]
        return wide.rename(columns={"update_samples": "block_samples"})

    @property
    def python_ns(self) -> float:
        """ns per sample where nothing was compiled, at 3 layers."""
        return float(self.times.loc[self.times["filter"] == PYTHON, "ns_per_sample"].iloc[0])

    @property
    def aims(self) -> pd.DataFrame:
        """Every aim beside what was measured: what, where, aim, measured, met."""
        rows = [
            _aim(f"{KERNEL} / {name}", at, row[f"{KERNEL} / {name}"], most=1.5)
            for name in FORMS
            for at, row in _places(self.filters, "update_samples")
        ]
        rows += [
            _aim(f"{AR} / kernel", at, row[f"{AR} / kernel"], least=3.0)
            for at, row in _places(self.filters, "update_samples")
            if row["layers"] == 3
        ]
        for at, row in _places(self.blocks, "block_samples"):
            least = {32: 100.0, 1024: 5.0}[row["block_samples"]]
            for name in BY_BLOCK[1:]:
                what = f"{SOSFILT} / {name}"
                rows.append(_aim(what, at, row[what], least=least))
        sweep = f"{SWEEP[0]} to {SWEEP[-1]} layers"
        rows.append(_aim("cost is linear in layers: R²", sweep, self.line.r_squared, least=0.99))
        rows.append(_aim("import modeling, s", "a process of its own", self.import_s, most=0.5))
        return pd.DataFrame(rows)


def _wide(rows: pd.DataFrame, by: str, names: Sequence[str]) -> pd.DataFrame:
    wide = rows.pivot_table(index=["layers", by], columns="filter", values="ns_per_sample")
    return wide[list(names)].rename_axis(columns=None).reset_index()


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
    speed = FASTEST_MM_S * np.abs(np.sin(2 * np.pi * STROKE_HZ * time_s))
    low, high = FORCE_N
    force = low + (high - low) * (0.5 + 0.5 * np.cos(2 * np.pi * STROKE_HZ / 3 * time_s))
    return Hand(speed, force)


def bench_rendering(
    effort: Effort | None = None, *, progress: Callable[[str], None] = lambda part: None
) -> RenderingBench:
    """Time the kernel beside its rivals, everything in turn, so that no disturbance hits only one.

    Parameters
    ----------
    effort : Effort, optional
        How long to measure; the default takes about half a minute.
    progress : callable
        Told each of the `PARTS` that is done.

    Raises
    ------
    InputError
        Where the parts in C were not compiled at installation.
    """
    effort = effort or Effort()
    rows = []
    for layers in LAYERS:
        for update in UPDATES:
            rows += _filters_in_c(layers, update, effort)
            progress(f"{layers} layers, updates every {update}")
        for block in BLOCKS:
            rows += _by_block(layers, block, effort)
            progress(f"{layers} layers, blocks of {block}")
    rows.append(_in_python(effort))
    sweep = _sweep(effort)
    progress("layers")
    memory_bytes = _kernel_stream(3, SWEEP_UPDATE).kernel_bytes
    import_s = _import_s(effort.starts)
    progress("start")
    return RenderingBench(
        times=pd.DataFrame(rows),
        sweep=sweep,
        line=_line_through(sweep),
        memory_bytes=memory_bytes,
        import_s=import_s,
        machine=machine(),
    )


def _filters_in_c(layers: int, update: int, effort: Effort) -> list[dict[str, Any]]:
    texture = layered_texture(layers)
    models: dict[str, LayeredModel] = dict.fromkeys(COMPILED, texture)
    models[AR] = tabled_predictor(predictor_of(texture))
    work = {
        name: _in_one_call(CompiledStream(name, model, update_samples=update, seed=0), effort)
        for name, model in models.items()
    }
    return _rows(work, effort, layers=layers, update=update)


def _by_block(layers: int, block: int, effort: Effort) -> list[dict[str, Any]]:
    texture = layered_texture(layers)
    speed, force = stroke(effort.samples, rate_hz=RATE_HZ)
    renderer = Renderer(texture, update_samples=block)
    sosfilt = SosfiltStream(texture, np.random.default_rng(0))
    calls, one_call = (_kernel_stream(layers, block) for _ in range(2))
    starts = range(0, effort.samples, block)

    def render() -> None:
        for start in starts:
            renderer.render(speed[start : start + block], force[start : start + block])

    def filter_sections() -> None:
        for start in starts:
            sosfilt.render(speed[start], force[start], block)

    work = {
        SOSFILT: filter_sections,
        RENDERER: render,
        CALLS: calls.calls(speed, force, np.empty(effort.samples), block=block),
        ONE_CALL: _in_one_call(one_call, effort),
    }
    return _rows(work, effort, layers=layers, update=block)


def _sweep(effort: Effort) -> pd.DataFrame:
    work = {m: _in_one_call(_kernel_stream(m, SWEEP_UPDATE), effort) for m in SWEEP}
    best = _best_seconds(work, effort.turns)
    ns = [1e9 * seconds / effort.samples for seconds in best.values()]
    return pd.DataFrame({"layers": list(best), "ns_per_sample": ns})


def _in_python(effort: Effort) -> dict[str, Any]:
    """What renders where nothing was compiled."""
    texture = layered_texture(3)
    plan = RenderPlan(rate_hz=texture.rate_hz, update_samples=SWEEP_UPDATE)
    engine = PythonEngine(BandFilter(texture, plan), plan, key=stream_key(0))
    hand = stroke(_PYTHON_SAMPLES, rate_hz=RATE_HZ)
    best = _best_seconds({PYTHON: partial(engine.render, *hand)}, min(effort.turns, 5))
    ns = 1e9 * best[PYTHON] / _PYTHON_SAMPLES
    return _row(PYTHON, 3, update=SWEEP_UPDATE, ns=ns)


def _kernel_stream(layers: int, update: int) -> CompiledStream:
    return CompiledStream(KERNEL, layered_texture(layers), update_samples=update, seed=0)


def _in_one_call(stream: CompiledStream, effort: Effort) -> Callable[[], None]:
    hand = stroke(effort.samples, rate_hz=RATE_HZ)
    return stream.calls(*hand, np.empty(effort.samples), block=effort.samples)


def _best_seconds(work: Mapping[Name, Callable[[], object]], turns: int) -> dict[Name, float]:
    best = dict.fromkeys(work, np.inf)
    for _ in range(turns):
        for name, run in work.items():
            start = perf_counter()
            run()
            best[name] = min(best[name], perf_counter() - start)
    return best


def _rows(
    work: Mapping[str, Callable[[], object]],
    effort: Effort,
    *,
    layers: int,
    update: int,
) -> list[dict[str, Any]]:
    best = _best_seconds(work, effort.turns)
    return [
        _row(name, layers, update=update, ns=1e9 * seconds / effort.samples)
        for name, seconds in best.items()
    ]


def _row(name: str, layers: int, *, update: int, ns: float) -> dict[str, Any]:
    return {
        "filter": name,
        "layers": layers,
        "update_samples": update,
        "ns_per_sample": ns,
    }


def _line_through(sweep: pd.DataFrame) -> Line:
    fit = linregress(sweep["layers"], sweep["ns_per_sample"])
    return Line(float(fit.slope), float(fit.intercept), float(fit.rvalue) ** 2)


def _import_s(starts: int) -> float:
    command = [sys.executable, "-c", _IMPORT]
    runs = [
        subprocess.run(command, capture_output=True, text=True, check=True) for _ in range(starts)
    ]
    return float(np.median([float(run.stdout) for run in runs]))


def machine() -> str:
    """Processor and compiler flags; no name of the computer."""
    ffi, lib = compiled_parts("analysis.benches._rivals")
    flags = ffi.string(lib.tq_build()).decode()
    information = Path("/proc/cpuinfo")
    lines = information.read_text().splitlines() if information.is_file() else []
    named = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return f"{(named or [platform.processor() or platform.machine()])[0]}, {flags}"
