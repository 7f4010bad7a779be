"""tactileq bench: our methods compared with alternatives."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tactileq.options import Out
from tactileq.printing import progress
from tactileq.results import FolderResults
from tactileq.workers import working

if TYPE_CHECKING:
    from tactileq.benches.chart.chart import Chart
    from tactileq.benches.chart.surfaces import Origin
    from tactileq.benches.rendering.bench import RenderingBench

bench = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode=None,
    help="Benchmarks: our methods compared with alternatives.",
)


@bench.command("render")
def bench_render(
    out: Out = Path("bench-render"),
    quick: Annotated[
        bool, typer.Option("--quick", help="Measure quickly, with less precision.")
    ] = False,
    plot: Annotated[bool, typer.Option("--plot", help="Plot the times.")] = False,
) -> None:
    """Time rendering per sample, compared with other filters in C and in scipy, noise included.

    Writes times.tsv, layers.tsv, operations.tsv and aims.tsv, with --plot also rendering.png. The
    machine should have nothing else to do.

    Example: tactileq bench render --plot
    """
    bench_rendering_into(out, quick=quick, plot=plot)


@bench.command("chart")
def bench_chart(
    out: Out = Path("bench-chart"),
    recordings: Annotated[
        list[Path] | None,
        typer.Option(
            help="Folder of recordings, some of them held out; instead of simulated surfaces."
        ),
    ] = None,
    toolkit: Annotated[
        list[Path] | None,
        typer.Option(help="Toolkit file (Models_….xml); instead of simulated surfaces."),
    ] = None,
    models: Annotated[
        list[Path] | None,
        typer.Option(help="Folder of models of these recordings, to be compared with the others."),
    ] = None,
    method: Annotated[
        list[str] | None, typer.Option(help="A method, such as AR(20); by default most of them.")
    ] = None,
    full: Annotated[
        bool,
        typer.Option(
            "--full",
            help="All methods and 47 surfaces; hold out both halves.",
        ),
    ] = False,
    jobs: Annotated[
        int | None, typer.Option(min=1, help="Textures at a time; by default one per core.")
    ] = None,
    dask: Annotated[
        str | None,
        typer.Option(
            metavar="ADDRESS", help="Address of a Dask scheduler whose workers do the work."
        ),
    ] = None,
) -> None:
    """Chart speed against accuracy: every way to model and render a texture, ours and others'.

    Costs are counted operations, numbers, bytes, and times; accuracy is measured at the conditions,
    between them and during strokes. Writes chart.html, chart_KIND.png, and the tables rows.tsv,
    summary.tsv, fronts.tsv and comparisons.tsv. --method, --recordings, --toolkit and --models are
    repeatable.

    Example: tactileq bench chart --recordings recordings/cork --out chart
    """
    from tactileq.benches.chart.methods import chosen_methods
    from tactileq.benches.chart.page import chart_files, plotly_script

    results = FolderResults(out, "bench chart")
    results.reads(*(recordings or []), *(toolkit or []), *(models or []))
    methods = chosen_methods(method or [], full=full)
    sources = chart_sources(recordings or [], toolkit or [], models or [], full=full)
    plotly_script()  # whether it is there is said before anything is charted
    chart = charted(sources, methods, jobs=jobs, dask=dask)
    settings = {
        "methods": methods,
        "surfaces": [f"{source.kind}: {source.name}" for source in sources],
        "full": full,
        "machine": chart.machine,
    }
    with results.folder(results.provenance(settings)) as fresh:
        for name, data in chart_files(chart).items():
            (fresh / name).write_bytes(data)
    for warning in chart.warnings:
        print(f"warning: {warning}", file=sys.stderr)
    for comparison in chart.comparisons:
        print(f"{comparison.kind}: {comparison.sentence}")
    print((out / "chart.html").resolve())


def chart_sources(
    recordings: Sequence[Path], toolkit: Sequence[Path], models: Sequence[Path], *, full: bool
) -> list[Origin]:
    """Which textures are charted.

    Raises
    ------
    ValueError
        For models without recordings, and a texture of which a folder holds no model.
    """
    from tactileq.benches.chart.surfaces import (
        ALL_SURFACES,
        USUAL,
        recorded_sources,
        simulated_sources,
        toolkit_sources,
    )

    if models and not recordings:
        raise ValueError(
            "expected --recordings for the models that --models names, got none; give both."
        )
    given = recorded_sources(recordings, models, both_halves=full) + toolkit_sources(toolkit)
    return given or simulated_sources(ALL_SURFACES if full else USUAL)


def charted(
    sources: Sequence[Origin],
    methods: Sequence[str],
    *,
    jobs: int | None = None,
    dask: str | None = None,
) -> Chart:
    """Judge all textures, several at a time, then time rendering with nothing else running."""
    from tactileq.benches.chart.chart import chart_of
    from tactileq.benches.chart.judging import Judged, judge

    made = dict[int, Judged]()
    with progress("Modeling and judging", len(sources)) as advance:
        work = partial(judge, methods=methods)
        with working(work, sources, jobs=jobs, dask=dask) as done:
            for number, judged in done:
                made[number] = judged
                advance(judged.source.name)
    return chart_of([made[number] for number in sorted(made)])


def bench_rendering_into(out: Path, *, quick: bool, plot: bool) -> None:
    """Time the renderer and its rivals; print and write the results."""
    from tactileq.analysis.columns import tsv_text
    from tactileq.analysis.page.saving import DOTS_PER_INCH
    from tactileq.benches.rendering.bench import QUICK, BenchEffort, bench_rendering
    from tactileq.benches.rendering.figure import figure_rendering
    from tactileq.modeling.files.writing import write_text

    results = FolderResults(out, "bench render")
    effort = QUICK if quick else BenchEffort()
    with progress("Timing", effort.parts) as advance:
        timed = bench_rendering(effort, progress=advance)
    settings = {
        "quick": quick,
        "machine": timed.machine,
        "compiler": timed.compiler,
        "memory_bytes": timed.memory_bytes,
        "import_s": timed.import_s,
    }
    with results.folder(results.provenance(settings)) as fresh:
        tables = {"times": timed.times, "layers": timed.sweep, "aims": timed.aims}
        for name, table in {**tables, "operations": timed.operations}.items():
            write_text(fresh / f"{name}.tsv", tsv_text(table))
        if plot:
            figure_rendering(timed).savefig(fresh / "rendering.png", dpi=DOTS_PER_INCH)
    _print_bench(timed)
    print(f"{int(timed.aims['met'].sum())} of {len(timed.aims)} targets met: {out / 'aims.tsv'}")


def _print_bench(bench: RenderingBench) -> None:
    """The tables, in ns per sample, and what else was measured."""
    print(f"{bench.machine}\n{bench.compiler}\n\nns per sample, noise included\n")
    tables = {
        "in C, one call": bench.throughput,
        "in C, a call per update": bench.live,
        "from Python, a call and an update per block": bench.blocks,
        "operations per sample, beside the noise": bench.operations,
    }
    for title, table in tables.items():
        print(title)
        print(table.to_string(index=False, float_format="%.2f"), end="\n\n")
    line = bench.line
    print(
        f"kernel: {line.ns_at_none:.2f} ns + {line.ns_per_layer:.2f} ns per layer (R² = "
        f"{line.r_squared:.4f}); {bench.memory_bytes} bytes per stream of 3 layers\n"
        f"at 48 kHz, 3 layers, an update every millisecond: {bench.sound_card_ns:.1f} ns; looped "
        f"wavetables {bench.looped_ns:.1f} ns\n"
        f"rendering in Python, 3 layers: {bench.python_ns:.0f} ns\n"
    )
    aims = bench.aims.assign(met=bench.aims["met"].map({True: "met", False: "not met"}))
    print(aims.to_string(index=False, float_format="%.2f"), end="\n\n")
