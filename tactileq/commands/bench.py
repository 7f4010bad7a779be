"""tactileq bench: what runs beside what would run instead."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tactileq.keeping import check_own_results
from tactileq.options import Out
from tactileq.telling import progress

if TYPE_CHECKING:
    from analysis.benches.rendering import RenderingBench

bench = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode=None,
    help="Time what runs beside what would run instead.",
)


@bench.command("render")
def bench_render(
    out: Out = Path("bench-render"),
    quick: Annotated[bool, typer.Option("--quick", help="Measure briefly and roughly.")] = False,
    plot: Annotated[bool, typer.Option("--plot", help="Draw the times.")] = False,
) -> None:
    """Time rendering per sample beside other filters in C and in scipy, noise included.

    Writes times.tsv, layers.tsv, operations.tsv and aims.tsv, with --plot also rendering.png. The
    machine should have nothing else to do.

    Example: tactileq bench render --plot
    """
    bench_rendering_into(out, quick=quick, plot=plot)


def bench_rendering_into(out: Path, *, quick: bool, plot: bool) -> None:
    """Time the renderer beside its rivals, print and write what was measured."""
    from analysis.benches.rendering import QUICK, Effort, bench_rendering
    from analysis.figures.rendering import figure_rendering
    from analysis.report.findings import DOTS_PER_INCH
    from modeling.files.folders import replace_folder
    from modeling.files.provenance import provenance_of, seal_folder

    check_own_results(out, "bench render")
    effort = QUICK if quick else Effort()
    with progress("Timing", effort.parts) as advance:
        timed = bench_rendering(effort, progress=advance)
    with replace_folder(out) as fresh:
        tables = {"times": timed.times, "layers": timed.sweep, "aims": timed.aims}
        for name, table in {**tables, "operations": timed.operations}.items():
            table.to_csv(fresh / f"{name}.tsv", sep="\t", index=False)
        if plot:
            figure_rendering(timed).savefig(fresh / "rendering.png", dpi=DOTS_PER_INCH)
        settings = {
            "quick": quick,
            "machine": timed.machine,
            "compiler": timed.compiler,
            "memory_bytes": timed.memory_bytes,
            "import_s": timed.import_s,
        }
        seal_folder(fresh, provenance_of("bench render", settings))
    _tell_bench(timed)
    print(f"{int(timed.aims['met'].sum())} of {len(timed.aims)} aims met: {out / 'aims.tsv'}")


def _tell_bench(bench: RenderingBench) -> None:
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
    line, cheaper = bench.line, bench.ar_cheaper_from
    print(
        f"kernel: {line.ns_at_none:.2f} ns + {line.ns_per_layer:.2f} ns per layer (R² = "
        f"{line.r_squared:.4f}); {bench.memory_bytes} bytes a stream of 3 layers\n"
        f"AR(20) is cheaper {f'from {cheaper} layers on' if cheaper else 'with none of these'}\n"
        f"at 48 kHz, 3 layers, updates each millisecond: {bench.sound_card_ns:.0f} ns\n"
        f"rendering in Python, 3 layers: {bench.python_ns:.0f} ns\n"
    )
    aims = bench.aims.assign(met=bench.aims["met"].map({True: "met", False: "not met"}))
    print(aims.to_string(index=False, float_format="%.2f"), end="\n\n")
