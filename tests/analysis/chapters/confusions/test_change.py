"""Models swapped within participants, on planted answers."""

import numpy as np
from scipy import stats

from tactileq.analysis.chapters.confusions.change import confusion_change_p
from tactileq.modeling import InputError
from tests.refusals import refused

SHARES = np.array([[0.6, 0.3, 0.1], [0.2, 0.6, 0.2], [0.1, 0.3, 0.6]])
OTHER = np.array([[0.6, 0.1, 0.3], [0.3, 0.6, 0.1], [0.3, 0.1, 0.6]])


def answers(rng, n, shares):
    return rng.multinomial(4, shares, size=(n, 3))


def test_type_one_error():
    rng = np.random.default_rng(1)
    found = [
        confusion_change_p(answers(rng, 7, SHARES), answers(rng, 7, SHARES), rng=rng)
        for _ in range(200)
    ]
    assert np.sum(np.array(found) <= 0.05) <= stats.binom.ppf(0.999, 200, 0.05)


def test_other_confusions_at_the_same_rate_right_are_found():
    rng = np.random.default_rng(2)
    p = confusion_change_p(answers(rng, 13, SHARES), answers(rng, 13, OTHER), rng=rng)
    assert p < 0.05


def test_equal_matrices_and_one_person_tell_nothing():
    rng = np.random.default_rng(3)
    same = answers(rng, 5, SHARES)
    assert confusion_change_p(same, same, rng=rng) == 1.0
    assert confusion_change_p(same[:1], same[1:2], rng=rng) == 1.0


def test_different_people_are_refused():
    with refused(InputError, expected="participants", got=["(2, 3, 3)", "(3, 3, 3)"]):
        confusion_change_p(np.ones((2, 3, 3)), np.ones((3, 3, 3)), rng=np.random.default_rng(4))
