"""How close models are at recorded conditions and between them, where a hand mostly is.

Truths in closed form are known anywhere; for recordings, conditions are left out and predicted
from the others.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence, Set
from itertools import pairwise
from typing import Protocol

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from tactileq.analysis.columns import CONDITIONS, ESTIMATOR, TEXTURE
from tactileq.analysis.textures.results import TextureResult
from tactileq.modeling import GridError, Recording, Spectrum, TextureModel, similarity
from tactileq.modeling.arrays import Floats
from tactileq.modeling.estimation.likelihood import is_silent
from tactileq.modeling.files.columns import Column
from tactileq.modeling.fitting.autoregressive import fit_ar_spectra
from tactileq.modeling.fitting.conditions import spectra_by_condition
from tactileq.modeling.fitting.spectral_field import fit_field_to_spectra
from tactileq.modeling.fitting.texture import fit_spectra
from tactileq.modeling.models.grid import Condition, grid_axes
from tactileq.modeling.recordings.spectrum import SMOOTHING_HZ, mean_spectrum, smooth
from tactileq.modeling.similarity import SpectralFilter
from tactileq.stimuli.planted.textures import PlantedSurface

Measured = Sequence[tuple[Recording, Spectrum]]
# Of one condition: the filter that a model has there.
FilterAt = Callable[[float, float], SpectralFilter]
RIVAL_ORDER = 20
FIELD_OF_SPECTRA = "a field of spectra"
LEVEL, DISTANCE = "level_error_db", "log_spectral_distance_db"


class Truth(Protocol):
    """A surface whose spectrum is known at any speed and force."""

    def magnitude(self, frequency_hz: ArrayLike, *, speed_mm_s: float, force_n: float) -> Floats:
        """In g per unit noise at the model's rate, (n,)."""


def halfway(speeds_mm_s: Sequence[float], forces_n: Sequence[float]) -> list[Condition]:
    """The middles of a grid's cells; of an axis with one value that value."""
    speeds, forces = _middles(speeds_mm_s), _middles(forces_n)
    return [(speed, force) for speed in speeds for force in forces]


def _middles(axis: Sequence[float]) -> list[float]:
    if len(axis) == 1:
        return [float(axis[0])]
    return [(float(a) + float(b)) / 2 for a, b in pairwise(axis)]


def distances_to_truth(
    filter_at: FilterAt, truth: Truth, conditions: Iterable[Condition], *, frequency_hz: Floats
) -> pd.DataFrame:
    """Level error and log-spectral distance of a model's response to the true magnitude.

    Parameters
    ----------
    filter_at : callable
        `model.peq` of a texture model, `model.filter` of an AR model or a field of spectra.
    conditions : iterable of (speed, force)
    frequency_hz : (n,) ndarray
        Evenly spaced; over them powers are summed and logarithms compared, unsmoothed.

    Returns
    -------
    DataFrame
        speed_mm_s, force_n, level_error_db (model over truth), log_spectral_distance_db.
    """
    rows = []
    for speed, force in conditions:
        true = truth.magnitude(frequency_hz, speed_mm_s=speed, force_n=force)
        rows.append((speed, force, *_errors(filter_at(speed, force).response(frequency_hz), true)))
    return pd.DataFrame(rows, columns=["speed_mm_s", "force_n", LEVEL, DISTANCE])


def distances_to_recordings(filter_at: FilterAt, measured: Measured) -> pd.DataFrame:
    """The same against recordings, 10 Hz … 0.98 of the Nyquist frequency, smoothed with σ = 30 Hz.

    Parameters
    ----------
    measured : sequence of (Recording, Spectrum)
        From `fitting.conditions.recording_spectra`; repeats of a condition are averaged, silent
        recordings left out.
    """
    rows = []
    for (speed, force), found in spectra_by_condition(_heard(measured)).items():
        spectrum = mean_spectrum(found)
        frequency = spectrum.frequency_hz
        highest = similarity.HIGHEST_SHARE * spectrum.rate_hz / 2
        heard = (frequency >= similarity.LOWEST_HZ) & (frequency <= highest)
        heard &= spectrum.magnitude > 0
        response = filter_at(speed, force).response(frequency)
        smoothed = smooth(response, SMOOTHING_HZ, step_hz=float(frequency[1]))
        _, distance = _errors(smoothed[heard], spectrum.smoothed()[heard])
        # Of a Rayleigh-distributed magnitude of mean r the mean square is (4/π)r².
        power = 4 / np.pi * np.sum(response[heard] ** 2) / np.sum(spectrum.magnitude[heard] ** 2)
        rows.append((speed, force, 10 * float(np.log10(power)), distance))
    return pd.DataFrame(rows, columns=["speed_mm_s", "force_n", LEVEL, DISTANCE])


def _heard(measured: Measured) -> Measured:
    """What a model can be fitted to."""
    return [pair for pair in measured if not is_silent(pair[1])]


def _errors(model: Floats, true: Floats) -> tuple[float, float]:
    level = 10 * float(np.log10(np.sum(model**2) / np.sum(true**2)))
    return level, similarity.log_spectral_distance_db(model, true)


Fit = Callable[[Measured], FilterAt]


def fit_like(model: TextureModel) -> Fit:
    """What `left_out_table` refits: a model as this one.

    By `joint` with its number of layers and their signs, which all recordings have decided; what
    is fitted again are their parameters.
    """
    like = model if model.estimator == "joint" else None

    def fit(measured: Measured) -> FilterAt:
        return fit_spectra(measured, estimator=model.estimator, like=like).peq

    return fit


def ar_fit(order: int) -> Fit:
    """The same by the rival, an autoregressive model of this order."""

    def fit(measured: Measured) -> FilterAt:
        return fit_ar_spectra(measured, order=order).filter

    return fit


def field_fit(measured: Measured) -> FilterAt:
    """The same by a smooth field of spectra, which knows nothing of layers."""
    return fit_field_to_spectra(measured).filter


def left_out_table(measured: Measured, fit: Fit) -> pd.DataFrame:
    """Conditions predicted by a model that was fitted without them.

    Twice, every second condition is left out like the squares of one colour on a chessboard
    (except the corners of the grid, to avoid extrapolation), and predicted from the others.

    Parameters
    ----------
    measured : sequence of (Recording, Spectrum)
        From `tactileq.modeling.fitting.conditions.recording_spectra`.
    fit : callable
        Makes a model of some of them.

    Returns
    -------
    DataFrame
        As `distances_to_recordings`, one row per condition that was left out; none where the grid
        is too small to leave any out.
    """
    measured = _heard(measured)
    tables = []
    for colour in (1, 0):
        out = chessboard({recording.condition for recording, _ in measured}, colour=colour)
        rest = [pair for pair in measured if pair[0].condition not in out]
        if not out or not rest:
            continue
        try:
            filter_at = fit(rest)
        except GridError:  # what is left lies on a line
            continue
        hidden = [pair for pair in measured if pair[0].condition in out]
        tables.append(distances_to_recordings(filter_at, hidden))
    empty = pd.DataFrame(columns=["speed_mm_s", "force_n", LEVEL, DISTANCE], dtype=float)
    table = pd.concat(tables, ignore_index=True) if tables else empty
    return table.sort_values(["speed_mm_s", "force_n"], ignore_index=True)


def chessboard(conditions: Set[Condition], *, colour: int) -> set[Condition]:
    """The conditions of one colour (0, 1), without the corners of the grid.

    In the order of speed and force, each has another colour than the nearest (in ln v, ln F) of
    those before it: on a lattice the squares of a chessboard, and elsewhere, too, what is left out
    has a neighbour that is not.
    """
    ordered = sorted(conditions)
    points = np.log(np.array(ordered))
    colours = [0]
    for place in range(1, len(ordered)):
        nearest = np.argmin(np.linalg.norm(points[:place] - points[place], axis=1))
        colours.append(1 - colours[nearest])
    speeds, forces = grid_axes(conditions)
    ends = {(v, f) for v in (speeds[0], speeds[-1]) for f in (forces[0], forces[-1])}
    return {one for one, own in zip(ordered, colours, strict=True) if own == colour} - ends


MEDIAN_AND_WORST_COLUMNS = (
    CONDITIONS,
    Column("median_level_error_db", "absolute level error, median", "dB"),
    Column("worst_level_error_db", "worst", "dB"),
    Column("worst_level_error_at", "at", is_name=True),
    Column("median_distance_db", "distance, median", "dB"),
    Column("worst_distance_db", "worst", "dB"),
    Column("worst_distance_at", "at", is_name=True),
)


def median_and_worst(table: pd.DataFrame) -> dict[str, object]:
    """Median and worst of level error (absolute) and distance, with the conditions' names."""
    if not len(table):
        return {}
    summary: dict[str, object] = {"conditions": len(table)}
    for column, short in ((LEVEL, "level_error"), (DISTANCE, "distance")):
        size = table[column].abs()
        worst = table.iloc[int(size.to_numpy().argmax())]
        summary[f"median_{short}_db"] = float(size.median())
        summary[f"worst_{short}_db"] = float(worst[column])
        summary[f"worst_{short}_at"] = f"{worst['speed_mm_s']:g} mm/s, {worst['force_n']:g} N"
    return summary


def sentence(table: pd.DataFrame) -> str:
    """`median_and_worst` in words."""
    found = median_and_worst(table)
    if not found:
        return "the grid is too small to leave conditions out"
    return (
        f"log-spectral distance {found['median_distance_db']:.2f} dB, at worst "
        f"{found['worst_distance_db']:.2f} dB ({found['worst_distance_at']}); level within "
        f"{found['median_level_error_db']:.2f} dB, at worst "
        f"{found['worst_level_error_db']:+.2f} dB ({found['worst_level_error_at']})"
    )


def worth_recording(left_out: pd.DataFrame, *, most: int = 3) -> list[Condition]:
    """Conditions near which the model is poorest, the worst predicted first.

    Those left out that are predicted more than twice as badly as the median of all.

    Parameters
    ----------
    left_out : DataFrame
        From `left_out_table`.
    """
    if not len(left_out):
        return []
    poor = left_out[left_out[DISTANCE] > 2 * left_out[DISTANCE].median()]
    worst = poor.sort_values(DISTANCE, ascending=False).head(most)
    return list(zip(worst["speed_mm_s"].tolist(), worst["force_n"].tolist(), strict=True))


def truth_summary(
    filter_at: FilterAt, truth: Truth, conditions: Iterable[Condition], *, frequency_hz: Floats
) -> tuple[float, float, float]:
    """RMS distance over all conditions, median and worst absolute level error, in dB."""
    table = distances_to_truth(filter_at, truth, conditions, frequency_hz=frequency_hz)
    level = table[LEVEL].abs()
    rms = float(np.sqrt((table[DISTANCE] ** 2).mean()))
    return rms, float(level.median()), float(level.max())


def left_out_by_model(measured: Measured, model: TextureModel) -> dict[str, pd.DataFrame]:
    """Left-out conditions of one texture, predicted as its model was made, and by the rivals.

    Parameters
    ----------
    measured : sequence of (Recording, Spectrum)
    model : TextureModel
        Its estimator and, by `joint`, the number and signs of its layers are used again.
    """
    return {
        model.estimator: left_out_table(measured, fit_like(model)),
        f"AR({RIVAL_ORDER})": left_out_table(measured, ar_fit(RIVAL_ORDER)),
        FIELD_OF_SPECTRA: left_out_table(measured, field_fit),
    }


LEFT_OUT_COLUMNS = (
    TEXTURE,
    Column("foretold_by", "predicted by", is_name=True),
    *MEDIAN_AND_WORST_COLUMNS,
)


def left_out_summary(results: Sequence[TextureResult]) -> pd.DataFrame:
    """Per texture and model: how well left-out conditions are predicted.

    Returns
    -------
    DataFrame
        texture, foretold_by, and the columns of `median_and_worst`; textures whose grid is too
        small have none.
    """
    rows = [
        {"texture": result.texture, "foretold_by": name, **median_and_worst(table)}
        for result in results
        for name, table in result.left_out.items()
        if len(table)
    ]
    return pd.DataFrame(rows)


PLANTED_BETWEEN_COLUMNS = (
    TEXTURE,
    ESTIMATOR,
    Column("distance_at_db", "distance at conditions", "dB"),
    Column("distance_between_db", "distance between conditions", "dB"),
    Column("median_level_error_between_db", "absolute level error between, median", "dB"),
    Column("worst_level_error_between_db", "worst", "dB"),
)


def planted_between_table(results: Sequence[TextureResult]) -> pd.DataFrame:
    """Models of planted textures against the truth at the conditions and half-way between them.

    Returns
    -------
    DataFrame
        One row per texture and estimator: texture, estimator, distance_at_db, distance_between_db
        (RMS over the conditions, 15 Hz … 0.96 of the Nyquist frequency, unsmoothed),
        median_level_error_between_db and worst_level_error_between_db (absolute).
    """
    rows = []
    for result in results:
        truth = PlantedSurface(result.texture)
        for model in (result.model, *result.other_estimates):
            speeds, forces = model.speeds_mm_s.tolist(), model.forces_n.tolist()
            frequency = np.arange(15.0, 0.96 * model.rate_hz / 2, 3.0)
            at = [(v, f) for v in speeds for f in forces]
            here, _, _ = truth_summary(model.peq, truth, at, frequency_hz=frequency)
            there, median, worst = truth_summary(
                model.peq, truth, halfway(speeds, forces), frequency_hz=frequency
            )
            rows.append(
                {
                    "texture": result.texture,
                    "estimator": model.estimator,
                    "distance_at_db": here,
                    "distance_between_db": there,
                    "median_level_error_between_db": median,
                    "worst_level_error_between_db": worst,
                }
            )
    return pd.DataFrame(rows)
