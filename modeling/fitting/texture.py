"""From the recordings of one texture to its model over the grid (docs/method/fitting.md)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactileq.modeling.checks import is_whole
from tactileq.modeling.errors import InputError, shown
from tactileq.modeling.estimation.layers import EstimatorName, check_estimator
from tactileq.modeling.estimation.likelihood import is_silent
from tactileq.modeling.fitting.conditions import only_unit, recording_spectra, spectra_by_condition
from tactileq.modeling.fitting.joint_grid import GridFit, fit_grid_jointly, refit_grid_jointly
from tactileq.modeling.fitting.layer_search import MOST_LAYERS
from tactileq.modeling.fitting.paper_naming import paper_arrays
from tactileq.modeling.models.grid import Condition, check_spanned, grid_axes
from tactileq.modeling.models.texture_model import TextureModel
from tactileq.modeling.recordings.recording import Recording
from tactileq.modeling.recordings.recording_set import RecordingSet
from tactileq.modeling.recordings.spectrum import Spectrum, mean_spectrum


def fit_texture(
    recordings: RecordingSet | Iterable[Recording],
    *,
    estimator: str = "joint",
    layers: int | None = None,
) -> TextureModel:
    """Model one texture over its grid of speeds and forces.

    Repeats of a condition are averaged; silent recordings count as not made. Conditions of the
    rectangular grid without a recording are interpolated from their neighbours and marked in
    `interpolated`.
    Recordings at force 0 are taken as the sensor's floor and subtracted in power.

    Parameters
    ----------
    recordings : RecordingSet or iterable of Recording
        One texture, one unit; any rates. One speed or one force suffices; then the model says
        nothing about others.
    estimator : {"joint", "paper", "paper-consistent"}
    layers : int, optional
        Number of layers, 1 … 12, with `joint` only; by default `joint` chooses it.

    Returns
    -------
    TextureModel
        At 5 kHz, or at the lowest rate among the recordings where that is lower.

    Raises
    ------
    GridError
        If the recordings lie on a line across the grid.
    InputError
        If they mix textures or units, or have contact without speed; for a number of layers out
        of range or with another estimator.
    """
    records = recordings if isinstance(recordings, RecordingSet) else RecordingSet(recordings)
    check_estimator(estimator)
    only_unit(records)
    return fit_spectra(recording_spectra(records), estimator=estimator, layers=layers)


def fit_spectra(
    measured: Sequence[tuple[Recording, Spectrum]],
    *,
    estimator: str = "joint",
    layers: int | None = None,
    like: TextureModel | None = None,
) -> TextureModel:
    """Model one texture from spectra that `recording_spectra` has prepared; see `fit_texture`.

    Parameters
    ----------
    measured : sequence of (Recording, Spectrum)
        With contact; the same texture, unit and rate in all.
    estimator : {"joint", "paper", "paper-consistent"}
    layers : int, optional
        As in `fit_texture`.
    like : TextureModel, optional
        With `joint`: number, signs and start of the layers as in this model of more recordings of
        the texture, in a third of the time.
    """
    chosen = check_estimator(estimator)
    _check_layers(layers, chosen)
    first, spectrum_of_first = measured[0]
    repeats = spectra_by_condition(measured)
    heard = {c: [s for s in found if not is_silent(s)] for c, found in repeats.items()}
    spectra = {condition: mean_spectrum(found) for condition, found in heard.items() if found}
    if not spectra:
        raise InputError(
            f"{first.texture}: expected a recording with vibration, got silence in all of "
            f"{len(repeats)} conditions; check the sensor, or leave its floor out."
        )
    check_spanned(spectra, first.texture)
    if chosen == "joint":
        found = (
            fit_grid_jointly(spectra, count=layers)
            if like is None
            else refit_grid_jointly(spectra, like)
        )
        arrays = _joint_arrays(found)
    else:
        arrays = paper_arrays(spectra, chosen, texture=first.texture)
    return TextureModel(
        texture=first.texture,
        rate_hz=spectrum_of_first.rate_hz,
        estimator=chosen,
        unit=first.unit,
        simulated=any(r.simulated for r, _ in measured),
        **arrays,
    )


def _check_layers(layers: object, estimator: EstimatorName) -> None:
    if layers is None:
        return
    if estimator != "joint" or not (is_whole(layers) and 1 <= layers <= MOST_LAYERS):
        raise InputError(
            f"expected 1 to {MOST_LAYERS} layers with the estimator joint, got {shown(layers)} "
            f"with {estimator}; leave the number out, or give another."
        )


def _joint_arrays(found: GridFit) -> dict[str, Any]:
    """The model's arrays by `joint`; holes are what their neighbours predict."""
    speeds, forces = grid_axes(found.layers)
    grid = [(speed, force) for speed in speeds for force in forces]
    shape = (len(speeds), len(forces))

    def table(name: str) -> NDArray[Any]:
        return np.array([getattr(found.layers[c], name) for c in grid]).reshape(*shape, -1)

    recorded = np.array([found.recorded[c] for c in grid]).reshape(shape)
    inherited = np.array([found.inherited[c] for c in grid]).reshape(*shape, -1)
    names = ("frequencies_hz", "bandwidths_hz", "gains", "level_sd_db", "unresolved")
    return {
        "speeds_mm_s": np.array(speeds),
        "forces_n": np.array(forces),
        "noise_gains": table("noise_gain")[:, :, 0],
        **{name: table(name) for name in names},
        "inherited": inherited & recorded[:, :, None],
        "interpolated": ~recorded,
        "blending": "logarithmic",
        "fit": found.summary,
    }


def missing_conditions(model: TextureModel) -> list[Condition]:
    """(speed, force) of the conditions that were interpolated because there is no recording."""
    return [
        (float(model.speeds_mm_s[i]), float(model.forces_n[j]))
        for i, j in np.argwhere(model.interpolated)
    ]
