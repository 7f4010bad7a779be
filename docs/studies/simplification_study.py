"""How far a verdict on a layer can be trusted, by record length and distance to threshold.

Simulated: textures whose layers are known are recorded twice and fitted by the default estimator;
one layer of each is followed through the rules of docs/method/perception.md#simplification. The
threshold is flat and laid so that the layer's true level has the wanted distance, in the amplitude
of each criterion.

Example: python docs/studies/simplification_study.py writes simplification_study.tsv and .png
beside this file.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from joblib import Parallel, delayed
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray
from rich.progress import track

from analysis.figures.drawing import (
    GREY,
    LAYER_COLOURS,
    LAYER_MARKERS,
    finish_axes,
    shared_legend,
)
from modeling import CRITERIA, RecordingSet, TextureModel, Threshold, fit_texture, simplify
from modeling.perception.simplification import layer_amplitudes_g
from stimuli.planted.textures import record_texture

DURATIONS_S = (0.25, 0.5, 1.0, 2.0, 5.0, 10.0)
DISTANCES_DB = tuple(float(d) for d in range(-6, 7))
TEXTURES = 100
RATE_HZ = 5000.0
SPEEDS_MM_S = np.array([100.0, 200.0])
FORCES_N = np.array([1.0, 2.0])
NOISE_GAIN = 0.01
# Followed is layer 0. Layer 1 is always louder, so that "the last layer stays" never decides.
FOLLOWED = 0
LOUDER_DB = 12.0
NEAREST_HZ = 10.0
PANELS = {
    "dropped_plain": "dropped (%)\npaper's rule alone",
    "dropped": "dropped (%)\nall rules, P(flip) < 5 %",
    "flipped_plain": "verdict differs in 2nd\nrecording (%), paper's rule",
    "flipped": "verdict differs in 2nd\nrecording (%), all rules",
    "contradicted": "dropped by all rules, above\nthreshold in other recording (%)",
}


def planted(rng: np.random.Generator) -> TextureModel:
    """A texture of two layers, or three, drawn at random on a 2 × 2 grid.

    The followed layer: 180–400 Hz, 10–50 Hz wide, 6–20 dB above the noise. The louder one: 60 Hz,
    15 Hz wide. In every second texture a third one, 80–150 Hz from the followed one and up to 6 dB
    weaker. All levels grow as √speed and force^0.2, signs are drawn.
    """
    frequency = [rng.uniform(180, 400), 60.0]
    bandwidth = [np.exp(rng.uniform(np.log(10), np.log(50))), 15.0]
    level_db = [rng.uniform(6, 20)]
    level_db.append(level_db[0] + LOUDER_DB)
    if rng.random() < 0.5:
        frequency.append(frequency[0] + rng.uniform(80, 150))
        bandwidth.append(bandwidth[0])
        level_db.append(level_db[0] - rng.uniform(0, 6))
    signs = rng.choice([-1.0, 1.0], len(frequency))
    growth = (SPEEDS_MM_S[:, None] / SPEEDS_MM_S[-1]) ** 0.5 * (FORCES_N / FORCES_N[-1]) ** 0.2
    gains = signs * NOISE_GAIN * 10 ** (np.array(level_db) / 20) * growth[..., None]
    return TextureModel(
        texture="planted",
        rate_hz=RATE_HZ,
        speeds_mm_s=SPEEDS_MM_S,
        forces_n=FORCES_N,
        noise_gains=np.full(growth.shape, NOISE_GAIN),
        frequencies_hz=np.broadcast_to(frequency, gains.shape),
        bandwidths_hz=np.broadcast_to(bandwidth, gains.shape),
        gains=gains,
        level_sd_db=np.zeros(gains.shape),
        estimator="planted",
        simulated=True,
    )


def matching_layer(model: TextureModel, truth: TextureModel) -> int | None:
    """The layer nearest to the followed one in the loudest condition; None where none is near."""
    centre_hz = truth.frequencies_hz[-1, -1, FOLLOWED]
    reach_hz = max(truth.bandwidths_hz[-1, -1, FOLLOWED] / 2, NEAREST_HZ)
    offset_hz = np.abs(model.frequencies_hz[-1, -1] - centre_hz)
    if offset_hz.size == 0 or offset_hz.min() > reach_hz:
        return None
    return int(np.argmin(offset_hz))


def outcomes(
    records: RecordingSet, truth: TextureModel, distances_db: Sequence[float]
) -> NDArray[np.float64]:
    """(criteria, distances, 3): gone by the paper's plain rule, gone by all rules, P(flip).

    NaN throughout where the estimator did not find the followed layer.
    """
    found = np.full((len(CRITERIA), len(distances_db), 3), np.nan)
    model = fit_texture(records)
    layer = matching_layer(model, truth)
    if layer is None:
        return found
    for row, criterion in enumerate(CRITERIA):
        amplitude_g = layer_amplitudes_g(truth, criterion=criterion)[..., FOLLOWED].max()
        for column, distance_db in enumerate(distances_db):
            level_g = np.full(2, amplitude_g * 10 ** (-distance_db / 20))
            threshold = Threshold("flat", np.array([1.0, 2450.0]), level_g, "study", "flat")
            verdict = simplify(model, threshold, criterion=criterion).layers[layer]
            found[row, column] = (
                verdict.distance_db < 0,
                verdict.verdict == "dropped",
                verdict.flip_probability,
            )
    return found


def record_twice(
    seed: int, duration_s: float, *, distances_db: Sequence[float]
) -> NDArray[np.float64]:
    """`outcomes` of two independent recordings of one texture, (2, criteria, distances, 3)."""
    truth = planted(np.random.default_rng(seed))
    # The same textures at every length, in noise of their own.
    noise_seed = seed * 1000 + round(duration_s * 4)
    recordings = [
        record_texture(truth, rate_hz=RATE_HZ, duration_s=duration_s, seed=2 * noise_seed + repeat)
        for repeat in (0, 1)
    ]
    return np.stack([outcomes(records, truth, distances_db) for records in recordings])


def summary(
    results: NDArray[np.float64], duration_s: float, distances_db: Sequence[float]
) -> list[dict[str, object]]:
    """Shares over the textures, one row per criterion and distance.

    From (textures, 2, criteria, distances, 3) outcomes of one record length. `contradicted` is what
    P(flip) is to keep rare: dropped by all rules, yet above threshold in the other recording.
    """
    found = ~np.isnan(results[..., 0])
    in_both = found.all(axis=1)
    rows: list[dict[str, object]] = []
    for c, criterion in enumerate(CRITERIA):
        for d, distance_db in enumerate(distances_db):
            here, both = found[:, :, c, d], in_both[:, c, d]
            once, pairs = results[:, :, c, d][here], results[:, :, c, d][both]
            turned = pairs[:, 0, :2] != pairs[:, 1, :2]
            contradicted = (pairs[:, :, 1] == 1) & (pairs[:, ::-1, 0] == 0)
            rows.append(
                {
                    "criterion": criterion,
                    "duration_s": duration_s,
                    "true_distance_db": distance_db,
                    "recordings": here.size,
                    "not_found": 1 - here.mean(),
                    "dropped_plain": once[:, 0].mean(),
                    "dropped": once[:, 1].mean(),
                    "flipped_plain": turned[:, 0].mean(),
                    "flipped": turned[:, 1].mean(),
                    "contradicted": contradicted.mean(),
                    "mean_flip_probability": once[:, 2].mean(),
                }
            )
    return rows


def run_study(
    *,
    textures: int = TEXTURES,
    durations_s: Sequence[float] = DURATIONS_S,
    distances_db: Sequence[float] = DISTANCES_DB,
) -> pd.DataFrame:
    """The study's table: all shares are of simulated recordings in which the layer was found."""
    rows = []
    for duration_s in durations_s:
        jobs = (
            delayed(record_twice)(seed, duration_s, distances_db=distances_db)
            for seed in range(textures)
        )
        done = Parallel(n_jobs=-1, return_as="generator")(jobs)
        results = list(track(done, f"{duration_s:g} s records", total=textures))
        rows += summary(np.stack(results), duration_s, distances_db)
    return pd.DataFrame(rows)


def key_numbers(table: pd.DataFrame) -> str:
    """The numbers that simplification.md quotes, as a Markdown table, in percent.

    Pairs are the paper's rule alone → all rules.
    """
    names = ["dropped_plain", "dropped", "flipped_plain", "flipped", "contradicted"]
    lines = [
        "| criterion | record | not found | wrongly dropped at +1 dB | dropped at −2 dB "
        "| differs at 0 dB | contradicted, at most |",
        "|---|---|---|---|---|---|---|",
    ]
    told_apart = table[table["criterion"] != "paper-fft"]  # as `paper-gain`
    for (criterion, duration_s), rows in told_apart.groupby(["criterion", "duration_s"]):
        percent = 100 * rows.set_index("true_distance_db")[names]
        wrong, right, near = (percent.loc[distance_db] for distance_db in (1.0, -2.0, 0.0))
        lines.append(
            f"| {criterion} | {duration_s:g} s | {rows['not_found'].iloc[0]:.0%} "
            f"| {wrong['dropped_plain']:.0f} → {wrong['dropped']:.0f} "
            f"| {right['dropped_plain']:.0f} → {right['dropped']:.0f} "
            f"| {near['flipped_plain']:.0f} → {near['flipped']:.0f} "
            f"| {percent['contradicted'].max():.0f} |"
        )
    return "\n".join(lines)


def plot_share(table: pd.DataFrame, *, column: str, ax: Axes) -> Axes:
    """One share against the distance to threshold, a line per record length."""
    styles = zip(LAYER_COLOURS, LAYER_MARKERS, strict=True)
    for (colour, marker), (duration_s, rows) in zip(
        styles, table.groupby("duration_s"), strict=False
    ):
        label = f"{duration_s:g} s (not found: {rows['not_found'].iloc[0]:.0%})"
        ax.plot(
            rows["true_distance_db"],
            100 * rows[column],
            color=colour,
            marker=marker,
            markersize=4,
            linewidth=1.2,
            label=label,
        )
    ax.axvline(0, color=GREY, linewidth=0.8, linestyle=":")
    ax.set_ylim(-3, 103)
    finish_axes(ax)
    return ax


def figure_of(table: pd.DataFrame, *, estimator: str) -> Figure:
    """Shares dropped and shares flipped, by the plain rule and by all rules.

    `paper-fft` and `paper-gain` share a column: both are the gain, times a constant, and so are
    their true distances.
    """
    figure = Figure(figsize=(8.5, 13), layout="constrained")
    axes = figure.subplots(len(PANELS), 2, sharex=True, sharey=True)
    for row, (column, label) in zip(axes, PANELS.items(), strict=True):
        for ax, criterion in zip(row, ("energy", "paper-gain"), strict=True):
            plot_share(table[table["criterion"] == criterion], column=column, ax=ax)
        row[0].set_ylabel(label)
    axes[0, 0].set_title("criterion: energy", fontsize=10)
    axes[0, 1].set_title("criteria: paper-fft and paper-gain (alike)", fontsize=10)
    for ax in axes[-1]:
        ax.set_xlabel("true distance to threshold (dB)")
    shared_legend(figure, axes[0, :1], loc="outside lower center", ncols=3)
    figure.suptitle(
        f"Simulated: verdicts on one planted layer, estimator {estimator}, 2 × 2 conditions\n"
        "Dropped right of 0 dB is wrong; not dropped left of it is what caution costs",
        fontsize=11,
    )
    return figure


def main() -> None:
    """Run the study and write its table and its figure beside this file."""
    target = Path(__file__).with_suffix("")
    truth = planted(np.random.default_rng(0))
    estimator = fit_texture(record_texture(truth, rate_hz=RATE_HZ)).estimator
    table = run_study()
    table.insert(0, "estimator", estimator)
    table.insert(1, "simulated", True)
    table.to_csv(target.with_suffix(".tsv"), sep="\t", index=False, float_format="%.4g")
    figure_of(table, estimator=estimator).savefig(target.with_suffix(".png"), dpi=110)
    print(key_numbers(table))


if __name__ == "__main__":
    main()
