"""Studies of several sizes sampled side by side say what each of them says alone."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from tactileq.analysis.statistics.participants.design import PeopleData, first_people, side_by_side
from tactileq.analysis.statistics.participants.posterior import Effort
from tactileq.analysis.statistics.participants.verdict import PeopleJudged, judged_by_size
from tactileq.modeling.participants.ratings import RatingStudies

N, TEXTURES, SMALL = 14, 3, 9
NAMES = [f"t{number}" for number in range(TEXTURES)]
EFFORT = Effort(chains=24, warm_up=150, steps=240, every=3)


def rated(points: float, *, seed: int) -> RatingStudies:
    rng = np.random.default_rng(seed)
    level = rng.normal(60, 8, (1, N, 1, 1, 1))
    values = level + rng.normal(0, 5, (1, N, TEXTURES, 2, 2))
    values[..., 1, :] += points
    anchors = level[..., 0, 0] - 30 + rng.normal(0, 8, (1, N, 2))
    trends = np.zeros((2, *values.shape))
    trends[1] = rng.uniform(-0.5, 0.5, values.shape)
    return RatingStudies(values=values.clip(1, 99), anchors=anchors.clip(0, 100), trends=trends)


def alone(studies: RatingStudies, n: int) -> RatingStudies:
    """The first n people, without places for others."""
    cut = {
        name: values[:, :, :n] if name == "trends" else values[:, :n]
        for name, values in vars(studies).items()
    }
    return RatingStudies(**cut)


def close(one: PeopleJudged, other: PeopleJudged) -> None:
    """Alike within the Monte Carlo error of two thousand draws, many of them alike."""
    a, b, table = one.summary, other.summary, other.textures
    width = b.mean_high - b.mean_low
    assert a.mean == pytest.approx(b.mean, abs=0.2 * width)
    for name in ("mean_low", "mean_high", "mean90_low", "mean90_high"):
        assert getattr(a, name) == pytest.approx(getattr(b, name), abs=0.4 * width)
    width = float((table["ci_high"] - table["ci_low"]).mean())
    means = table["mean"].to_numpy()
    assert one.textures["mean"].to_numpy() == pytest.approx(means, abs=0.25 * width)


@pytest.mark.long("simulations of large studies")
def test_the_first_people_of_a_larger_study_say_what_they_say_alone():
    studies, rng = (rated(0.0, seed=1), rated(12.0, seed=2)), np.random.default_rng(5)

    def judged(studies: Sequence[RatingStudies], *sizes: int) -> list[list[PeopleJudged]]:
        data = [PeopleData(studies=one, people=[], textures=NAMES) for one in studies]
        return judged_by_size(data, (-7.5, 7.5), sizes=sizes, rng=rng, effort=EFFORT)

    together = judged(studies, SMALL, N)
    for of_study in together:
        assert all(list(found.textures["texture"]) == NAMES for found in of_study)
    # Each size and each study once: the first people of one, all of the other.
    for study, found, n in ((studies[0], together[0][0], SMALL), (studies[1], together[1][1], N)):
        ((single,),) = judged([alone(study, n)], n)
        close(found, single)
    (none, _), (large, _) = together
    assert abs(none.summary.mean) < abs(large.summary.mean)


def test_studies_stand_beside_each_other_in_their_order():
    first, second = rated(0.0, seed=1), rated(5.0, seed=2)
    both = side_by_side([first_people(one, [SMALL, N]) for one in (first, second)])
    assert both.values.shape == (4, N, TEXTURES, 2, 2)
    assert np.isnan(both.values[[0, 2], SMALL:]).all()
    np.testing.assert_array_equal(both.values[3], second.values[0])
    np.testing.assert_array_equal(both.trends[:, 2], second.trends[:, 0])
