"""Force against depth of the virtual wall and of the real surface; draws and computes nothing."""

from __future__ import annotations

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tactileq.analysis.page.drawing import BLUE, VERMILLION, axes_or_new, stamp_if_simulated
from tactileq.rig.desk.calibration.stiffness import Pressed

STYLES = (("real surface", VERMILLION, (0, (5, 2))), ("virtual wall", BLUE, "-"))


def figure_stiffness(real: Pressed, virtual: Pressed) -> Figure:
    """Both surfaces, loading and unloading, with their stiffness."""
    figure = Figure(figsize=(6.5, 4.5), layout="constrained")
    plot_stiffness(real, virtual, ax=figure.subplots())
    return figure


def plot_stiffness(real: Pressed, virtual: Pressed, *, ax: Axes | None = None) -> Axes:
    """Force (N) over depth (mm)."""
    ax = axes_or_new(ax)
    for (name, colour, dashes), one in zip(STYLES, (real, virtual), strict=True):
        label = f"{name}: {one.stiffness_n_per_mm:.3g} N/mm"
        ax.plot(one.depth_mm, one.force_n, color=colour, ls=dashes, lw=1.8, label=label)
    ax.set_xlabel("depth (mm)")
    ax.set_ylabel("force, commanded (N)")
    ax.set_ylim(bottom=0)
    ax.legend(loc="upper left", frameon=False)
    stamp_if_simulated(ax, real.simulated or virtual.simulated)
    return ax
