"""The render bench measures everything once, and judges as it was told; how fast is not asked."""

from __future__ import annotations

from itertools import product

import numpy as np
import pandas as pd
import pytest

from tactileq.benches.rendering.bench import (
    BLOCKS,
    BY_BLOCK,
    FROM_PYTHON,
    LAYERS,
    LFILTER,
    LIVE,
    LOOPED,
    ONE_CALL,
    PYTHON,
    RENDERER,
    SOSFILT,
    SOUND_CARD,
    SWEEP,
    SWEEP_UPDATE,
    UPDATES,
    BenchEffort,
    RenderingBench,
    bench_rendering,
    stroke,
)
from tactileq.benches.rendering.figure import (
    BLOCK_COLOURS,
    FILTER_COLOURS,
    figure_rendering,
    plot_costs,
    plot_sweep,
)
from tactileq.benches.rendering.rivals import (
    AR,
    COMPILED,
    DIRECT_FORM_I,
    KERNEL,
    RATE_HZ,
    RIVAL_FORMS,
    TRANSPOSED,
    layered_texture,
    operations,
)
from tactileq.modeling.rendering.plan import RenderPlan

PARTS_TOLD: list[str] = []
EFFORT = BenchEffort(samples=1024, turns=2, starts=1)


@pytest.fixture(scope="module")
def bench() -> RenderingBench:
    return bench_rendering(EFFORT, progress=lambda part: PARTS_TOLD.append(part))


def planted() -> RenderingBench:
    """A bench of known times: kernel 3 ns a layer, direct forms 2.5 and 1.5, AR 18, sosfilt 600.

    Twice as much live.
    """
    ns = {KERNEL: 3.0, DIRECT_FORM_I: 2.5, TRANSPOSED: 1.5, "TPT": 2.7, AR: 18.0}
    rows = [
        (called, name, m, update, factor * ns[name] * (1 if name == AR else m))
        for (called, factor), name, m, update in product(
            ((ONE_CALL, 1), (LIVE, 2)), COMPILED, LAYERS, UPDATES
        )
    ]
    by_block = {SOSFILT: 600.0, LFILTER: 120.0, RENDERER: 12.0}
    rows += [
        (FROM_PYTHON, n, m, b, ns) for (n, ns), m, b in product(by_block.items(), LAYERS, BLOCKS)
    ]
    rows += [(ONE_CALL, KERNEL, m, SWEEP_UPDATE, 3.0 * m) for m in SWEEP if m not in LAYERS]
    rows.append((ONE_CALL, PYTHON, 3, 5, 1500.0))
    rows.append((SOUND_CARD, KERNEL, 3, 48, 40.0))
    rows.append((SOUND_CARD, LOOPED, 3, 48, 10.0))
    columns = ["called", "filter", "layers", "update_samples", "ns_per_sample"]
    return RenderingBench(
        times=pd.DataFrame(rows, columns=columns),
        memory_bytes=1000,
        import_s=0.6,
        machine="a processor",
        compiler="a compiler: -O3",
    )


def test_every_combination_is_measured(bench: RenderingBench) -> None:
    times = bench.times
    assert np.isfinite(times["ns_per_sample"]).all()
    assert (times["ns_per_sample"] > 0).all()
    keys = ["called", "filter", "layers", "update_samples"]
    measured = set(times[keys].itertuples(index=False, name=None))
    wanted = set(product((ONE_CALL, LIVE), COMPILED, LAYERS, UPDATES))
    wanted |= set(product([FROM_PYTHON], BY_BLOCK, LAYERS, BLOCKS))
    wanted |= {(ONE_CALL, PYTHON, 3, 5), (SOUND_CARD, KERNEL, 3, 48)}
    wanted.add((SOUND_CARD, LOOPED, 3, 48))
    wanted |= set(product([ONE_CALL], [KERNEL], SWEEP, [SWEEP_UPDATE]))
    assert measured == wanted
    assert len(times) == len(measured)
    assert tuple(bench.sweep["layers"]) == SWEEP
    assert (bench.sweep[["ns_per_sample", "ar_ns_per_sample"]] > 0).all(axis=None)
    assert 0 < bench.import_s < np.inf
    assert bench.memory_bytes > 0
    assert len(PARTS_TOLD) == EFFORT.parts


def test_it_says_what_compiled_it_and_how(bench: RenderingBench) -> None:
    assert bench.compiler.startswith(("GCC ", "Clang ", "another compiler"))
    assert "-std=c99 -O3 -ffp-contract=off" in bench.compiler
    assert "/" not in bench.compiler.split(": ", 1)[1]
    assert bench.machine


def test_tables_and_aims_cover_every_combination(bench: RenderingBench) -> None:
    blocks = bench.blocks
    for filters in (bench.throughput, bench.live):
        assert list(zip(filters["layers"], filters["update_samples"], strict=True)) == list(
            product(LAYERS, UPDATES)
        )
        assert np.isfinite(filters.to_numpy()).all()
    assert list(zip(blocks["layers"], blocks["block_samples"], strict=True)) == list(
        product(LAYERS, BLOCKS)
    )
    assert np.isfinite(blocks.to_numpy()).all()
    counts = bench.aims["what"].value_counts()
    for name, called in product(RIVAL_FORMS, (ONE_CALL, LIVE)):
        assert counts[f"kernel / {name}, {called}"] == len(LAYERS) * len(UPDATES)
    assert not counts.index.str.contains("AR").any()  # its coefficients are made at each update
    assert counts["sosfilt / Renderer"] == len(LAYERS) * len(BLOCKS)


def test_ratios_and_verdicts_of_known_times() -> None:
    bench = planted()
    for table in (bench.throughput, bench.live):
        assert table["kernel / direct form I"].to_numpy() == pytest.approx(1.2)
        assert table["kernel / direct form II"].to_numpy() == pytest.approx(2.0)
        assert table["AR(20) / kernel"].to_numpy() == pytest.approx(np.repeat([6.0, 2.0, 0.75], 3))
    assert bench.live[KERNEL].to_numpy() == pytest.approx(2 * bench.throughput[KERNEL].to_numpy())
    assert bench.blocks["sosfilt / Renderer"].to_numpy() == pytest.approx(50.0)
    assert bench.blocks["lfilter / Renderer"].to_numpy() == pytest.approx(10.0)
    assert bench.python_ns == 1500.0
    assert (bench.sound_card_ns, bench.looped_ns) == (40.0, 10.0)
    verdicts = bench.aims.set_index(["what", "where"])["met"]
    assert verdicts["kernel / direct form I, one call"].all()
    assert not verdicts["kernel / direct form II, one call"].any()
    assert verdicts["kernel / direct form II, live"].all()
    for layers in LAYERS:
        assert not verdicts["sosfilt / Renderer", f"layers {layers}, blocks of 32"]
        assert verdicts["sosfilt / Renderer", f"layers {layers}, blocks of 1024"]
    assert verdicts["cost is linear in layers: R²"].all()
    assert not verdicts["import tactileq.modeling, s"].any()


@pytest.mark.parametrize("layers", LAYERS)
def test_operations_of_the_kernel_are_those_of_its_plan(layers: int) -> None:
    """But for the noise and the readings of the hand, which every form has."""
    cost = RenderPlan(rate_hz=RATE_HZ, update_samples=5).cost(layered_texture(layers))
    shared = RenderPlan(rate_hz=RATE_HZ, update_samples=5).cost(layered_texture(1).with_layers([]))
    found = operations(KERNEL, layers)
    branch = operations(KERNEL, 0)
    products = cost.per_sample.multiplications - shared.per_sample.multiplications
    sums = cost.per_sample.additions - shared.per_sample.additions
    assert found == (products + branch.products, sums + branch.sums)


def test_the_line_runs_through_the_sweep(bench: RenderingBench) -> None:
    slope, intercept = np.polyfit(SWEEP, bench.sweep["ns_per_sample"], 1)
    assert bench.line.ns_per_layer == pytest.approx(slope)
    assert bench.line.ns_at_none == pytest.approx(intercept)
    assert 0 <= bench.line.r_squared <= 1


def test_the_hand_strokes_to_and_fro_over_the_whole_grid() -> None:
    speed, force = stroke(20480, rate_hz=RATE_HZ)
    assert speed.max() == pytest.approx(300.0, rel=1e-3)
    assert speed.min() == pytest.approx(-300.0, rel=1e-3)
    turns = np.flatnonzero(np.diff(np.sign(speed[1:])))
    assert np.diff(turns) == pytest.approx(RATE_HZ / 4, abs=2)  # 2 Hz: two reversals a period
    assert force.min() >= 0.5
    assert force.max() - force.min() > 1.0


def test_the_figure_shows_what_was_measured() -> None:
    bench = planted()
    figure = figure_rendering(bench)
    assert len(figure.axes) == 9
    assert bench.machine in figure.get_supxlabel()
    assert bench.compiler in figure.get_supxlabel()
    for ax in figure.axes[:8]:
        assert ax.get_ylabel() == "time per sample (ns)"
        assert ax.get_xlabel() == "layers"
        low, high = ax.get_ylim()
        assert all(low < bar.get_height() < high for bar in ax.patches)
    for panel, table in ((0, bench.throughput), (3, bench.live)):
        heights = [bar.get_height() for bar in figure.axes[panel].patches]
        wanted = table[table["update_samples"] == 1]
        assert heights == pytest.approx([ns for name in COMPILED for ns in wanted[name]])
    legend = [text.get_text() for text in figure.legends[0].get_texts()]
    assert legend == [*COMPILED, RENDERER, LFILTER, SOSFILT]


def test_no_two_series_have_one_colour() -> None:
    colours = [*FILTER_COLOURS.values(), *BLOCK_COLOURS.values()]
    assert len(set(colours)) == len(colours)


def test_panels_stand_alone() -> None:
    bench = planted()
    ax = plot_sweep(bench)
    assert {text.get_text() for text in ax.texts} == {AR, "kernel: 3 ns per layer, R² = 1.0000"}
    assert ax.lines[0].get_ydata() == pytest.approx([0.0, 48.0])
    assert ax.lines[2].get_ydata() == pytest.approx([18.0, 18.0])
    rows = bench.blocks[bench.blocks["block_samples"] == 32]
    panel = plot_costs(rows, {SOSFILT: "black"}, logarithmic=True)
    assert len(panel.patches) == len(LAYERS)
    assert panel.get_yscale() == "log"
    assert plot_costs(rows, {SOSFILT: "black"}).get_ylim()[0] == 0
