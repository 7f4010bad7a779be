"""The render bench measures everything once, and judges as it was told; how fast is not asked."""

from __future__ import annotations

from itertools import product

import numpy as np
import pandas as pd
import pytest

from analysis.benches.rendering import (
    BLOCKS,
    BY_BLOCK,
    CALLS,
    LAYERS,
    ONE_CALL,
    PARTS,
    PYTHON,
    RENDERER,
    SOSFILT,
    SWEEP,
    UPDATES,
    Effort,
    Line,
    RenderingBench,
    bench_rendering,
    stroke,
)
from analysis.benches.rivals import AR, COMPILED, DIRECT, FORMS, KERNEL, RATE_HZ, TRANSPOSED
from analysis.figures.rendering import figure_rendering, plot_costs, plot_sweep

PARTS_TOLD: list[str] = []


@pytest.fixture(scope="module")
def bench() -> RenderingBench:
    return bench_rendering(
        Effort(samples=1024, turns=1, starts=1), progress=lambda part: PARTS_TOLD.append(part)
    )


def planted() -> RenderingBench:
    """A bench of known times: kernel 3 ns a layer, direct forms 2.5 and 1.5, AR 18, sosfilt 600."""
    ns = {KERNEL: 3.0, DIRECT: 2.5, TRANSPOSED: 1.5, "TPT": 2.7, AR: 18.0}
    rows = [
        (name, m, update, ns[name] * (1 if name == AR else m))
        for name, m, update in product(COMPILED, LAYERS, UPDATES)
    ]
    by_block = {SOSFILT: 600.0, RENDERER: 12.0, CALLS: 5.0, ONE_CALL: 4.0}
    rows += [(n, m, b, ns) for (n, ns), m, b in product(by_block.items(), LAYERS, BLOCKS)]
    rows.append((PYTHON, 3, 5, 1500.0))
    columns = ["filter", "layers", "update_samples", "ns_per_sample"]
    return RenderingBench(
        times=pd.DataFrame(rows, columns=columns),
        sweep=pd.DataFrame({"layers": SWEEP, "ns_per_sample": 3.0 * np.array(SWEEP)}),
        line=Line(3.0, 0.0, 1.0),
        memory_bytes=1000,
        import_s=0.6,
        machine="a processor, -O3",
    )


def test_every_combination_is_measured(bench: RenderingBench) -> None:
    times = bench.times
    assert np.isfinite(times["ns_per_sample"]).all()
    assert (times["ns_per_sample"] > 0).all()
    measured = set(zip(times["filter"], times["layers"], times["update_samples"], strict=True))
    wanted = set(product(COMPILED, LAYERS, UPDATES))
    wanted |= set(product(BY_BLOCK, LAYERS, BLOCKS))
    assert measured == wanted | {(PYTHON, 3, 5)}
    assert len(times) == len(measured)
    assert tuple(bench.sweep["layers"]) == SWEEP
    assert (bench.sweep["ns_per_sample"] > 0).all()
    assert 0 < bench.import_s < np.inf
    assert bench.memory_bytes > 0
    assert "-std=c99 -O3" in bench.machine
    assert len(PARTS_TOLD) == PARTS


def test_tables_and_aims_cover_every_combination(bench: RenderingBench) -> None:
    filters, blocks = bench.filters, bench.blocks
    assert list(zip(filters["layers"], filters["update_samples"], strict=True)) == list(
        product(LAYERS, UPDATES)
    )
    assert list(zip(blocks["layers"], blocks["block_samples"], strict=True)) == list(
        product(LAYERS, BLOCKS)
    )
    assert np.isfinite(filters.to_numpy()).all()
    assert np.isfinite(blocks.to_numpy()).all()
    counts = bench.aims["what"].value_counts()
    for name in FORMS:
        assert counts[f"kernel / {name}"] == len(LAYERS) * len(UPDATES)
    assert counts["AR(20) / kernel"] == len(UPDATES)
    for name in (RENDERER, CALLS, ONE_CALL):
        assert counts[f"sosfilt / {name}"] == len(LAYERS) * len(BLOCKS)


def test_ratios_and_verdicts_of_known_times() -> None:
    bench = planted()
    assert bench.filters["kernel / direct form I"].to_numpy() == pytest.approx(1.2)
    assert bench.filters["kernel / direct form II"].to_numpy() == pytest.approx(2.0)
    assert bench.filters["AR(20) / kernel"].to_numpy() == pytest.approx(
        np.repeat([6.0, 2.0, 0.75], 3)
    )
    assert bench.blocks["sosfilt / Renderer"].to_numpy() == pytest.approx(50.0)
    assert bench.blocks["sosfilt / kernel by block"].to_numpy() == pytest.approx(120.0)
    assert bench.blocks["sosfilt / kernel in one call"].to_numpy() == pytest.approx(150.0)
    assert bench.python_ns == 1500.0
    verdicts = bench.aims.set_index(["what", "where"])["met"]
    assert verdicts["kernel / direct form I"].all()
    assert not verdicts["kernel / direct form II"].any()
    assert not verdicts["AR(20) / kernel"].any()
    for layers in LAYERS:
        assert not verdicts["sosfilt / Renderer", f"layers {layers}, blocks of 32"]
        assert verdicts["sosfilt / Renderer", f"layers {layers}, blocks of 1024"]
    assert verdicts["sosfilt / kernel by block"].all()
    assert verdicts["cost is linear in layers: R²"].all()
    assert not verdicts["import modeling, s"].any()


def test_the_line_runs_through_the_sweep(bench: RenderingBench) -> None:
    slope, intercept = np.polyfit(SWEEP, bench.sweep["ns_per_sample"], 1)
    assert bench.line.ns_per_layer == pytest.approx(slope)
    assert bench.line.ns_at_none == pytest.approx(intercept)
    assert 0 <= bench.line.r_squared <= 1


def test_the_hand_strokes_to_and_fro_over_the_whole_grid() -> None:
    speed, force = stroke(20480, rate_hz=RATE_HZ)
    assert speed.min() == 0.0
    assert speed.max() == pytest.approx(300.0, rel=1e-3)
    turns = np.flatnonzero(np.diff(np.sign(np.diff(speed))) > 0)
    assert np.diff(turns) == pytest.approx(RATE_HZ / 4, abs=2)  # 2 Hz: two reversals a period
    assert force.min() >= 0.5
    assert force.max() - force.min() > 1.0


def test_the_figure_shows_what_was_measured() -> None:
    bench = planted()
    figure = figure_rendering(bench)
    assert len(figure.axes) == 6
    assert bench.machine in figure.get_supxlabel()
    for ax in figure.axes[:5]:
        assert ax.get_yscale() == "log"
        assert ax.get_ylabel() == "time per sample (ns)"
        assert ax.get_xlabel() == "layers"
        low, high = ax.get_ylim()
        assert all(low < bar.get_height() < high for bar in ax.patches)
    heights = [bar.get_height() for bar in figure.axes[0].patches]
    wanted = bench.filters[bench.filters["update_samples"] == 1]
    assert heights == pytest.approx([ns for name in COMPILED for ns in wanted[name]])
    legend = [text.get_text() for text in figure.legends[0].get_texts()]
    assert legend == [*COMPILED, ONE_CALL, CALLS, RENDERER, SOSFILT]


def test_panels_stand_alone() -> None:
    bench = planted()
    ax = plot_sweep(bench)
    assert "3 ns per layer" in ax.texts[0].get_text()
    assert ax.lines[0].get_ydata() == pytest.approx([0.0, 48.0])
    rows = bench.blocks[bench.blocks["block_samples"] == 32]
    assert len(plot_costs(rows, {SOSFILT: "black"}).patches) == len(LAYERS)
