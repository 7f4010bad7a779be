"""The spectral centroid over speed (PAPER fig. 5); draws what it is given and computes nothing."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tactileq.analysis.page.drawing import (
    GREY,
    axes_or_new,
    finish_axes,
    series_style,
    shared_legend,
    stamp_if_simulated,
)
from tactileq.analysis.textures.regressions import CentroidOverSpeed


def figure_centroid(courses: Sequence[CentroidOverSpeed]) -> Figure:
    """Spectral centroid over speed, one line per texture, with its regression (PAPER fig. 5)."""
    figure = Figure(figsize=(8.6, 5), layout="constrained")
    ax = figure.subplots()
    plot_centroid(courses, ax=ax)
    shared_legend(figure, [ax], loc="outside right center", ncols=1)
    figure.supxlabel(
        "mean ± standard deviation over the forces; thin dashed lines: regression on speed alone",
        fontsize=9,
        color=GREY,
    )
    return figure


def plot_centroid(courses: Sequence[CentroidOverSpeed], *, ax: Axes | None = None) -> Axes:
    """Mean over the forces with its standard deviation, and the regression on speed."""
    ax = axes_or_new(ax)
    for number, course in enumerate(courses):
        colour, marker = series_style(number)
        ax.errorbar(
            course.speeds_mm_s,
            course.mean_hz,
            course.sd_hz,
            color=colour,
            marker=marker,
            lw=1.6,
            elinewidth=0.9,
            capsize=3,
            label=course.texture,
        )
        ax.plot(course.speeds_mm_s, course.regression_hz, color=colour, ls="--", lw=0.9)
    ax.set_xlabel("probing speed (mm/s)")
    ax.set_ylabel("spectral centroid SC (Hz)")
    ax.set_ylim(bottom=0)
    finish_axes(ax)
    stamp_if_simulated(ax, any(course.simulated for course in courses))
    return ax
