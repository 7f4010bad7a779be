"""Steps of the mixture of people's effects."""

from __future__ import annotations

import numpy as np

from tactileq.analysis.statistics.participants.mixture import MixtureOfEffects
from tactileq.modeling.participants.effects import EffectPriors


def test_people_without_answers_are_placed_by_the_weights_of_the_same_draw() -> None:
    """E w[place] = E Σ w² of somebody about whom nothing is known."""
    studies = 500
    estimates = np.tile([-3.0, -1.0, -2.0, 14.0, -8.0, 13.0, 0.0], (studies, 1))
    who = np.ones(estimates.shape, dtype=bool)
    who[:, -1] = False
    priors = EffectPriors(mean_sd=25.0, spread=1.9, weight=0.5)
    mixture = MixtureOfEffects(priors, studies, rng=np.random.default_rng(3))
    differences = []
    for _ in range(300):
        mixture.draw(estimates, np.full(estimates.shape, 30.0), who)
        own = np.take_along_axis(mixture.weights, mixture.places[:, -1:], axis=1)[:, 0]
        differences.append(own - (mixture.weights**2).sum(axis=1))
    means = np.mean(differences[50:], axis=0)  # of each study, independent
    assert abs(means.mean()) < 4 * means.std(ddof=1) / np.sqrt(studies)
    assert means.std(ddof=1) / np.sqrt(studies) < 0.002
