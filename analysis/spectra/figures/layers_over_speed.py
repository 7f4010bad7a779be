"""Figure of the layers' frequencies over speed (PAPER fig. 5)."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tactileq.analysis.page.drawing import (
    BLACK,
    axes_or_new,
    finish_axes,
    series_style,
    shared_legend,
    stamp_if_simulated,
)
from tactileq.analysis.spectra.layers_over_grid import LayersOverSpeed
from tactileq.modeling.arrays import Floats


def figure_layers_over_speed(courses: Sequence[LayersOverSpeed]) -> Figure:
    """Frequency and amplitude of each layer over speed at one force.

    Parameters
    ----------
    courses : sequence of LayersOverSpeed
        The first is drawn with markers, a second one (such as the planted truth) as thin lines.
    """
    figure = Figure(figsize=(10.5, 4.2), layout="constrained")
    axes = figure.subplots(1, 2)
    plot_layers_over_speed(courses, quantity="frequency_hz", ax=axes[0])
    plot_layers_over_speed(courses, quantity="amplitude", ax=axes[1])
    shared_legend(figure, axes[:1], loc="outside right center", ncols=1)
    figure.suptitle(f"{courses[0].texture}, {courses[0].force_n:g} N")
    return figure


def plot_layers_over_speed(
    courses: Sequence[LayersOverSpeed], *, quantity: str, ax: Axes | None = None
) -> Axes:
    """One quantity (frequency_hz or amplitude) of each layer over speed."""
    ax = axes_or_new(ax)
    for course, solid in zip(courses, (True, False), strict=False):
        values: Floats = getattr(course, quantity)
        for layer in range(values.shape[1]):
            colour, marker = series_style(layer)
            ax.plot(
                course.speeds_mm_s,
                values[:, layer],
                color=colour if solid else BLACK,
                marker=marker if solid else "",
                ls="-" if solid else "--",
                lw=1.6 if solid else 0.9,
                label=f"{course.label}, layer {layer + 1}" if solid or layer == 0 else None,
            )
            if not solid and layer == 0:
                ax.lines[-1].set_label(course.label)
    frequency = quantity == "frequency_hz"
    unit = courses[0].unit if courses[0].unit == "arbitrary" else "g peak"
    ax.set_ylabel("frequency (Hz)" if frequency else f"amplitude, sinusoid of equal power ({unit})")
    ax.set_xlabel("speed (mm/s)")
    ax.set_ylim(bottom=0)
    finish_axes(ax)
    stamp_if_simulated(ax, any(course.simulated for course in courses))
    return ax
