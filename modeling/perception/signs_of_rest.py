"""Signs of the layers that stay (docs/method/perception.md#signs-of-the-rest)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tactileq.modeling.arrays import Floats
from tactileq.modeling.equalizer.bands import band_response
from tactileq.modeling.equalizer.signs import neighbouring_patterns
from tactileq.modeling.models.parameter_table import Parameters
from tactileq.modeling.models.texture_model import TextureModel
from tactileq.modeling.similarity import HIGHEST_SHARE, LOWEST_HZ

SIGN_POINTS = 120
TINY = 1e-100
SAME = 1 + 1e-12  # of two misfits, but for rounding
KEEP_THEIR_SIGNS = ("paper", "paper-consistent")


class SignsOfRest:
    """Chooses the signs of the layers that stay when others are dropped.

    Two neighbours left with equal signs would cut a notch between them
    (docs/method/equalizer.md#signs). Compared with the full response at all places, over 10 Hz …
    0.98 of the Nyquist frequency on a logarithmic scale, by Whittle's likelihood. Models by the
    paper's recipe keep their signs, which are all positive.

    Parameters
    ----------
    at : Parameters
        Of the full model at n places.
    estimator : str
        What made the model.
    """

    def __init__(self, at: Parameters, *, rate_hz: float, estimator: str = "") -> None:
        self._at, self._as_they_are = at, estimator in KEEP_THEIR_SIGNS
        frequency = np.geomspace(LOWEST_HZ, HIGHEST_SHARE * rate_hz / 2, SIGN_POINTS)
        n, m = at.gains.shape
        self._bands = band_response(
            frequency,
            centres_hz=at.frequencies_hz.ravel(),
            bandwidths_hz=at.bandwidths_hz.ravel(),
            rate_hz=rate_hz,
        ).reshape(n, m, SIGN_POINTS)
        self._full = self._responses(list(range(m)), at.gains[None])[0]
        self._chosen: dict[tuple[int, ...], Floats] = {}

    @staticmethod
    def of_model(model: TextureModel) -> SignsOfRest:
        """For a model, in all conditions of its grid."""
        return SignsOfRest(at_conditions(model), rate_hz=model.rate_hz, estimator=model.estimator)

    def gains(self, gains: Floats, keep: Sequence[int]) -> Floats:
        """Gains of the layers that stay, with their signs.

        Parameters
        ----------
        gains : (…, m) ndarray
            Of all layers, anywhere on the model's grid. Amplitudes stay.
        keep : sequence of int
            0-based.

        Returns
        -------
        (…, k) ndarray
            As they were where all layers stay.
        """
        kept = gains[..., list(keep)]
        if len(keep) in (0, gains.shape[-1]) or self._as_they_are:
            return kept
        signed: Floats = np.abs(kept) * self._signs(tuple(keep))
        return signed

    def without(self, gains: Floats, dropped: Sequence[int]) -> Floats:
        """Gains (…, m) of all layers, 0 for those that are dropped, the others as in `gains`."""
        keep = [layer for layer in range(gains.shape[-1]) if layer not in dropped]
        rest = np.zeros_like(gains)
        rest[..., keep] = self.gains(gains, keep)
        return rest

    def _signs(self, keep: tuple[int, ...]) -> Floats:
        """Of the layers that stay, (k,): one for all places."""
        if keep not in self._chosen:
            self._chosen[keep] = self._choose(list(keep))
        return self._chosen[keep]

    def _choose(self, keep: list[int]) -> Floats:
        gains = self._at.gains[:, keep]
        # A layer's sign is one for the whole texture, but where it is silent it has none.
        as_they_are = np.where(gains.sum(axis=0) < 0, -1.0, 1.0)
        centres = np.median(self._at.frequencies_hz[:, keep], axis=0)
        patterns = np.stack([as_they_are, *neighbouring_patterns(centres)])
        ratios = self._full / self._responses(keep, np.abs(gains) * patterns[:, None, :])
        squared = ratios**2
        misfits = np.sum(squared - 1 - np.log(squared), axis=(1, 2))
        chosen: Floats = patterns[int(np.argmax(misfits <= misfits.min() * SAME))]
        return chosen

    def _responses(self, layers: list[int], gains: Floats) -> Floats:
        """Coherent responses (k, n, points), never quite 0, of gains (k, n, layers)."""
        bands = np.moveaxis(gains, 0, 1) @ self._bands[:, layers]
        responses = np.abs(self._at.noise_gain[:, None, None] + bands)
        return np.maximum(np.moveaxis(responses, 1, 0), TINY)


def at_conditions(model: TextureModel) -> Parameters:
    """The model's parameters in all C conditions of its grid, in C order."""
    shape = model.noise_gains.size, model.n_layers
    layers = (model.frequencies_hz, model.bandwidths_hz, model.gains)
    return Parameters(model.noise_gains.ravel(), *(values.reshape(shape) for values in layers))


def with_signs_chosen_again(model: TextureModel, keep: Sequence[int]) -> TextureModel:
    """The model with only these layers (0-based), their signs chosen by `SignsOfRest`."""
    gains = SignsOfRest.of_model(model).gains(model.gains, keep)
    return replace(model.with_layers(list(keep)), gains=gains)
