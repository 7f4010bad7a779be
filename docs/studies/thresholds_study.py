"""Layers dropped, by criterion, threshold table, and assumption above its end.

Simulated: random planted textures with six layers each, one per band from 20 Hz to 2 kHz.

Example: python docs/studies/thresholds_study.py writes thresholds_study.tsv and .png beside this
file and prints the table.
"""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from tactileq.analysis.page.drawing import (
    LAYER_COLOURS,
    LAYER_MARKERS,
    finish_axes,
    shared_legend,
)
from tactileq.analysis.page.drawing import stamp_if_simulated as stamp
from tactileq.modeling import CRITERIA, TextureModel, Threshold, simplify
from tactileq.modeling.perception.thresholds import SHIPPED

TEXTURES = 100
RATE_HZ = 5000.0
DURATION_S = 1.0
SPEEDS_MM_S = np.array([50.0, 150.0, 350.0])
FORCES_N = np.array([0.5, 1.5, 3.5])
EDGES_HZ = (20.0, 60.0, 120.0, 250.0, 500.0, 1000.0, 2000.0)
BANDS = tuple(f"{low:g}–{high:g}" for low, high in pairwise(EDGES_HZ))
LEVELS_DB = (-50.0, 0.0)  # of a layer's amplitude re 1 g (peak of equal power), loudest condition
RELATIVE_WIDTHS = (0.1, 0.4)
NOISE_GAIN = 1e-4


def planted(seed: int) -> TextureModel:
    """Six layers; levels grow as √speed and force^0.2, and are known as from a record of 1 s."""
    rng = np.random.default_rng([11, seed])
    frequency = np.exp(rng.uniform(np.log(EDGES_HZ[:-1]), np.log(EDGES_HZ[1:])))
    width = frequency * np.exp(rng.uniform(*np.log(RELATIVE_WIDTHS), frequency.size))
    k = np.tan(np.pi * width / RATE_HZ)
    amplitude = 10 ** (rng.uniform(*LEVELS_DB, frequency.size) / 20)
    gains = amplitude / np.sqrt(2 * k / (1 + k)) * rng.choice([-1.0, 1.0], frequency.size)
    growth = (SPEEDS_MM_S[:, None] / SPEEDS_MM_S[-1]) ** 0.5 * (FORCES_N / FORCES_N[-1]) ** 0.2
    shape = (*growth.shape, frequency.size)
    # The Cramér–Rao bound of a lone layer's level (docs/method/estimation.md#level-deviations).
    level_sd_db = 10 / np.log(10) / np.sqrt(np.pi * width * DURATION_S)
    return TextureModel(
        texture="planted",
        rate_hz=RATE_HZ,
        speeds_mm_s=SPEEDS_MM_S,
        forces_n=FORCES_N,
        noise_gains=np.full(growth.shape, NOISE_GAIN),
        frequencies_hz=np.broadcast_to(frequency, shape),
        bandwidths_hz=np.broadcast_to(width, shape),
        gains=gains * growth[..., None],
        level_sd_db=np.broadcast_to(level_sd_db, shape),
        estimator="planted",
        simulated=True,
    )


def study(textures: int) -> pd.DataFrame:
    """Share of layers dropped, by band, criterion, table and what is held above its end."""
    rows = []
    for seed in range(textures):
        model = planted(seed)
        for name in SHIPPED:
            for criterion in CRITERIA:
                for above in ("held", "unknown"):
                    done = simplify(
                        model,
                        Threshold.shipped(name),
                        criterion=criterion,
                        hold_above=above == "held",
                    )
                    rows += [
                        {
                            "threshold": name,
                            "criterion": criterion,
                            "above_its_end": above,
                            "band_hz": band,
                            "dropped": layer.verdict == "dropped",
                            "unknown": layer.reason.startswith("no threshold known"),
                        }
                        for band, layer in zip(BANDS, done.layers, strict=True)
                    ]
    by = ["threshold", "criterion", "above_its_end", "band_hz"]
    shares = pd.DataFrame(rows).groupby(by, sort=False)[["dropped", "unknown"]].mean()
    return shares.reset_index().assign(textures=textures, simulated=True)


def figure_of(table: pd.DataFrame) -> Figure:
    """Share dropped by band, one panel per table."""
    figure = Figure(figsize=(11, 4.2), layout="constrained")
    panels = figure.subplots(1, len(SHIPPED), sharey=True)
    for ax, name in zip(panels, SHIPPED, strict=True):
        for number, criterion in enumerate(CRITERIA):
            for above, line in (("held", "-"), ("unknown", ":")):
                here = table[
                    (table["threshold"] == name)
                    & (table["criterion"] == criterion)
                    & (table["above_its_end"] == above)
                ]
                label = {"held": ", last level held above", "unknown": ", unknown above"}[above]
                ax.plot(
                    here["band_hz"],
                    100 * here["dropped"],
                    line + LAYER_MARKERS[number],
                    color=LAYER_COLOURS[number],
                    fillstyle="full" if above == "held" else "none",
                    label=criterion + label,
                )
        ax.set_title(
            f"{name}, up to {Threshold.shipped(name).frequency_hz[-1]:g} Hz",
            loc="left",
            fontsize=10,
        )
        ax.tick_params(axis="x", rotation=40)
        ax.set_xlabel("layer's frequency (Hz)")
        ax.set_ylim(-4, 104)
        finish_axes(ax)
    panels[0].set_ylabel("layers dropped (%)")
    shared_legend(figure, panels[:1], ncols=3)
    stamp(panels[-1], simulated=True)
    return figure


def main() -> None:
    """Run the study and write its table and picture."""
    table = study(TEXTURES)
    target = Path(__file__).with_suffix(".tsv")
    table.to_csv(target, sep="\t", index=False, float_format="%.4g")
    figure_of(table).savefig(target.with_suffix(".png"), dpi=110)
    wide = table.pivot_table(
        index=["threshold", "criterion", "above_its_end"], columns="band_hz", values="dropped"
    )
    print((100 * wide[list(BANDS)]).round(0).to_string())


if __name__ == "__main__":
    main()
