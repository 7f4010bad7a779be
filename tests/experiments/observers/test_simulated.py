"""Simulated participants against the closed form of what they were told to be."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy import stats

from tactileq.experiments.observers.percepts import Perception, distance, sensation_levels
from tactileq.experiments.observers.psychometrics import (
    RATED_SCALES,
    Psychometrics,
    Trait,
    choice_shares,
)
from tactileq.experiments.observers.simulated import SimulatedParticipant, require_plantable
from tactileq.experiments.sessions.loop.people import Intake
from tactileq.experiments.sessions.loop.surfaces import Surfaces
from tactileq.experiments.study.models import ModelSets
from tactileq.experiments.study.questions import Question
from tactileq.experiments.study.study import Study
from tactileq.experiments.tasks.absolute import AbsoluteTrial
from tactileq.experiments.tasks.oddity import OddityTrial
from tactileq.experiments.tasks.relative import RelativeTrial
from tactileq.experiments.tasks.threshold import ThresholdTrial
from tactileq.modeling import InputError, TextureModel, Threshold
from tactileq.modeling.participants.choices import oddity_share
from tactileq.modeling.participants.ratings import AT_END
from tactileq.rig.desk.twin import SimulatedRig
from tactileq.rig.shared.interface import ToneBurst
from tests.refusals import refused

EXACT = Psychometrics(
    threshold_db=Trait(0.0),
    sensitivity=Trait(1.0),
    magnitude_bias=Trait(0.0),
    frequency_bias=Trait(0.0),
    lapse_rate=Trait(0.0),
    learning=Trait(0.0),
    care=Trait(1.0),
    preference_sd=0.0,
    noise_sd=0.0,
)
LAYOUT = ("PVC", "canvas", "MDF")
MakeSurfaces = Callable[..., Surfaces]


def two_bursts() -> Surfaces:
    bursts = [ToneBurst(frequency_hz=250.0, amplitude_g=0.0, duration_s=0.01)] * 2
    return Surfaces(
        SimulatedRig(),
        texture="n/a",
        models=bursts,
        begin=lambda of: None,
        note=lambda event, **fields: None,
    )


@pytest.fixture
def perception(
    study: Study, truths: dict[str, TextureModel], models: ModelSets, threshold: Threshold
) -> Perception:
    # A reference that is 6 dB too strong, so that it does not feel like the real surface.
    louder = {
        name: replace(model, gains=2 * model.gains, noise_gains=2 * model.noise_gains)
        for name, model in truths.items()
    }
    sets = ModelSets(sets={"full": louder, "simplified": models.sets["simplified"]})
    return Perception(study, real=truths, models=sets, threshold=threshold)


@pytest.fixture
def surfaces(models: ModelSets, rig: Any) -> MakeSurfaces:
    def make(count: int = 1, note: Any = lambda event, **fields: None) -> Surfaces:
        shown = [models.of("MDF", "full")] * count
        begin = Surfaces.present_real if count != 3 else Surfaces.present_virtual
        return Surfaces(rig, texture="MDF", models=shown, begin=begin, note=note)

    return make


def somebody(perception: Perception, population: Psychometrics, subject: int = 1, **of: Any) -> Any:
    who = {"seed": 5, "occasion": (1,), **of}
    return SimulatedParticipant(perception, population, subject=subject, **who)


def absolute(model: str, texture: str = "MDF", trial: int = 1, virtual: str = "") -> AbsoluteTrial:
    return AbsoluteTrial(
        trial=trial,
        phase="main",
        texture=texture,
        model=model,
        tray="A",
        virtual_texture=virtual or texture,
        first_surface="real",
    )


def relative(model: str, texture: str = "MDF") -> RelativeTrial:
    place = {"trial": 1, "phase": "main", "tray": "A"}
    return RelativeTrial(texture=texture, model=model, layout=LAYOUT, **place)


def oddity(odd: str = "simplified", position: int = 2, texture: str = "MDF") -> OddityTrial:
    same = {"simplified": "full", "full": "simplified"}[odd]
    layout = tuple(odd if button == position else same for button in (1, 2, 3))
    place = {"trial": 1, "phase": "main", "tray": "A", "texture": texture, "model": odd}
    return OddityTrial(layout=layout, odd_position=position, **place)


def catch(model: str, position: int, texture: str, odd_texture: str) -> OddityTrial:
    return OddityTrial(
        trial=1,
        phase="main",
        tray="A",
        texture=texture,
        odd_texture=odd_texture,
        model=model,
        layout=(model,) * 3,
        odd_position=position,
    )


def tone(frequency_hz: float, amplitude_g: float) -> ThresholdTrial:
    return ThresholdTrial(
        trial=1,
        phase="main",
        texture="n/a",
        model="n/a",
        tray="",
        frequency_hz=frequency_hz,
        interval=2,
        amplitude_g=amplitude_g,
    )


def rated(person: Any, trial: AbsoluteTrial, surfaces: MakeSurfaces) -> tuple[float, float]:
    rating = person.rate(trial, surfaces())
    return rating.magnitude_similarity, rating.frequency_similarity


# --- Ratings --------------------------------------------------------------------------------


def test_ratings_of_the_exact_follow_distances(
    perception: Perception, surfaces: MakeSurfaces
) -> None:
    for model in ("full", "simplified"):
        apart = perception.distance("MDF", model, "MDF")
        expected = [EXACT.felt_rating(apart.magnitude_db), EXACT.felt_rating(apart.frequency_db)]
        found = rated(somebody(perception, EXACT), absolute(model), surfaces)
        np.testing.assert_allclose(found, expected, atol=0.005)
    assert perception.distance("MDF", "full", "MDF").magnitude_db > 1.0


@pytest.mark.parametrize("effect", [-12.0, 0.0, 9.0])
def test_a_planted_effect_is_anybodys_by_their_sensitivity(
    perception: Perception, effect: float
) -> None:
    population = Psychometrics(planted={"MDF": {"magnitude_similarity": effect}})
    for subject in range(1, 101):
        person = somebody(perception, population, subject)
        full, simplified = (person.judgements(absolute(m)) for m in ("full", "simplified"))
        apart = simplified[0] - full[0]
        assert apart == pytest.approx(effect * person.person.sensitivity, abs=1e-9)
        # What is not planted follows percepts.
        assert simplified[1] != full[1]


@pytest.mark.parametrize("effect", [-12.0, 0.0, 9.0])
def test_what_is_planted_in_ratings_comes_back(
    perception: Perception, surfaces: MakeSurfaces, effect: float
) -> None:
    """Judgements far from the ends: their difference less what lapses hide of it."""
    scales = ("magnitude_similarity", "frequency_similarity")
    population = Psychometrics(
        lapse_rate=Trait(0.1, 0.02), planted={"MDF": dict.fromkeys(scales, effect)}
    )
    differences = []
    for subject in range(1, 1201):
        person = somebody(perception, population, subject)
        full, simplified = (rated(person, absolute(m), surfaces) for m in ("full", "simplified"))
        differences.append(np.subtract(simplified, full))
    error = np.std(differences, axis=0) / np.sqrt(len(differences))
    assert (np.abs(np.mean(differences, axis=0) - 0.9 * effect) < 4 * error).all()
    assert (error < 0.8).all()


def test_ratings_have_the_mean_and_noise_that_they_were_given(
    perception: Perception, surfaces: MakeSurfaces
) -> None:
    """At the middle of the scale: noise_sd·(1 + learning)/√care in the first trial."""
    apart = perception.distance("MDF", "full", "MDF").magnitude_db
    to_middle = 50.0 - EXACT.felt_rating(apart)
    population = replace(
        EXACT,
        noise_sd=16.0,
        learning=Trait(0.5),
        care=Trait(4.0),
        magnitude_bias=Trait(to_middle),
    )
    person = somebody(perception, population)
    one = surfaces()
    ratings = [person.rate(absolute("full"), one).magnitude_similarity for _ in range(3000)]
    sd = 16.0 * 1.5 / 2
    assert abs(np.mean(ratings) - 50.0) < 4 * sd / np.sqrt(3000)
    assert np.std(ratings) == pytest.approx(sd, rel=0.06)
    late = [person.rate(absolute("full", trial=500), one).magnitude_similarity for _ in range(3000)]
    assert np.std(late) == pytest.approx(8.0, rel=0.06)


def test_lapsed_ratings_are_anywhere(perception: Perception, surfaces: MakeSurfaces) -> None:
    population = replace(EXACT, lapse_rate=Trait(0.5))
    person, one = somebody(perception, population), surfaces()
    attentive = EXACT.felt_rating(perception.distance("MDF", "full", "MDF").magnitude_db)
    ratings = np.array(
        [person.rate(absolute("full"), one).magnitude_similarity for _ in range(4000)]
    )
    lapsed = ratings[np.abs(ratings - attentive) > 0.01]
    assert stats.binomtest(len(lapsed), len(ratings), 0.5).pvalue > 1e-4
    for end in (0.0, 100.0):  # 2 % each, and the same everywhere between them
        at_end = int((lapsed == end).sum())
        assert stats.binomtest(at_end, len(lapsed), AT_END).pvalue > 1e-4
    between = lapsed[(lapsed > 0.0) & (lapsed < 100.0)]
    assert stats.kstest(between / 100, "uniform").pvalue > 1e-4


def test_ratings_at_100_are_the_tail_of_the_judgements(
    study: Study, truths: dict[str, TextureModel], models: ModelSets, surfaces: Any, threshold: Any
) -> None:
    """Where the virtual surface is the real one: at 80 points, +15 planted."""
    alike = Perception(study, real=truths, models=models, threshold=threshold)
    population = replace(EXACT, noise_sd=10.0, planted={"MDF": {"magnitude_similarity": 15.0}})
    person, one = somebody(alike, population), surfaces()
    for model, mean in (("full", 80.0), ("simplified", 95.0)):
        assert person.judgements(absolute(model))[0] == pytest.approx(mean)
        given = [person.rate(absolute(model), one).magnitude_similarity for _ in range(3000)]
        ratings = np.array(given)
        at_end = stats.norm.sf(100.0, mean, 10.0)
        assert stats.binomtest(int((ratings == 100.0).sum()), 3000, at_end).pvalue > 1e-3
        below = ratings[ratings < 100.0]
        assert (
            stats.kstest(below, stats.truncnorm(-10.0, (100 - mean) / 10, mean, 10).cdf).pvalue
            > 1e-3
        )
    away = somebody(alike, replace(EXACT, noise_sd=10.0, magnitude_bias=Trait(-75.0)))
    given = [away.rate(absolute("full"), one).magnitude_similarity for _ in range(3000)]
    share = stats.norm.cdf(0.0, 5.0, 10.0)
    assert stats.binomtest(given.count(0.0), 3000, share).pvalue > 1e-3
    assert min(given) == 0.0


def test_an_anchor_is_rated_as_another_texture(
    perception: Perception, surfaces: MakeSurfaces
) -> None:
    planted = replace(EXACT, planted={"MDF": {"magnitude_similarity": 0.0}})
    found = rated(somebody(perception, planted), absolute("full", virtual="PVC"), surfaces)
    apart = perception.distance("MDF", "full", "PVC")
    expected = [EXACT.felt_rating(apart.magnitude_db), EXACT.felt_rating(apart.frequency_db)]
    np.testing.assert_allclose(found, expected, atol=0.005)


def test_a_subject_keeps_traits_and_not_the_noise(
    perception: Perception, surfaces: MakeSurfaces
) -> None:
    def magnitude(noise_sd: float, **who: Any) -> float:
        population = replace(EXACT, magnitude_bias=Trait(0.0, 3.0), noise_sd=noise_sd)
        return rated(somebody(perception, population, **who), absolute("full"), surfaces)[0]

    steady = magnitude(0.0, subject=1, occasion=(1,))
    assert steady == magnitude(0.0, subject=1, occasion=(2,))
    assert steady != magnitude(0.0, subject=2, occasion=(1,))
    assert steady != magnitude(0.0, subject=1, seed=6)
    assert magnitude(5.0, subject=1, occasion=(1,)) == magnitude(5.0, subject=1, occasion=(1,))
    assert magnitude(5.0, subject=1, occasion=(1,)) != magnitude(5.0, subject=1, occasion=(2,))


def test_whoever_cares_more_switches_more_and_takes_longer(
    perception: Perception, surfaces: MakeSurfaces
) -> None:
    switches, times = {}, {}
    for care in (0.5, 2.0):
        person = somebody(perception, replace(EXACT, care=Trait(care)))
        counts, took = [], []
        for _ in range(1000):
            one = surfaces()
            took.append(person.rate(absolute("full"), one).response_time_s)
            counts.append(one.switches)
        switches[care], times[care] = np.mean(counts), np.median(took)
    assert switches[0.5] == pytest.approx(1 + 2 * 0.5, abs=4 * np.sqrt(1.0 / 1000))
    assert switches[2.0] == pytest.approx(1 + 2 * 2.0, abs=4 * np.sqrt(4.0 / 1000))
    assert times[2.0] / times[0.5] == pytest.approx(4.0, rel=0.1)


# --- Choices --------------------------------------------------------------------------------


def test_many_choices_agree_with_luces_rule(perception: Perception, surfaces: MakeSurfaces) -> None:
    population = replace(EXACT, temperature_db=4.0, lapse_rate=Trait(0.1), preference_sd=0.5)
    person = somebody(perception, population)
    trial, counts, one = relative("full"), np.zeros(3), surfaces(3)
    for _ in range(3000):
        counts[person.choose(trial, one).button] += 1
    apart = [perception.distance("MDF", "full", other).total_db for other in LAYOUT]
    liked = person.person.preferences[:3]
    expected = choice_shares([-d / 4.0 for d in apart], 0.1, liked)
    assert stats.chisquare(counts, 3000 * np.array(expected)).pvalue > 0.001
    assert len(set(liked)) == 3


@pytest.mark.parametrize("effect", [-12.0, 0.0])
def test_what_is_planted_in_choices_comes_back(perception: Perception, effect: float) -> None:
    population = Psychometrics(planted={"MDF": {"choice": effect}}, temperature_db=4.0)
    right = LAYOUT.index("MDF")
    differences = []
    for subject in range(1, 1201):
        person = somebody(perception, population, subject)
        full, simplified = (person.shares(relative(m)) for m in ("full", "simplified"))
        planted = effect / 100 * person.person.sensitivity
        assert simplified[right] - full[right] == pytest.approx(planted, abs=1e-9)
        assert min(*full, *simplified) >= -1e-12
        differences.append(simplified[right] - full[right])
    error = np.std(differences) / np.sqrt(len(differences))
    assert abs(100 * np.mean(differences) - effect) <= 400 * error + 1e-9


def test_every_surface_is_felt_before_a_choice(
    perception: Perception, surfaces: MakeSurfaces
) -> None:
    for trial in (relative("full"), oddity()):
        one = surfaces(3)
        choice = somebody(perception, Psychometrics()).choose(trial, one)
        assert one.felt == {0, 1, 2}
        assert one.chosen == choice.button


@pytest.mark.parametrize("odd", ["full", "simplified"])
def test_odd_ones_are_found_as_in_a_triangle_test(
    perception: Perception, surfaces: MakeSurfaces, odd: str
) -> None:
    population = replace(EXACT, temperature_db=3.0, lapse_rate=Trait(0.1))
    person, one = somebody(perception, population), surfaces(3)
    apart = float(np.hypot(*perception.felt().between[:, 0, 1, 1]))
    assert person.odd_distance_db(oddity(odd)) == pytest.approx(apart)
    found = [person.choose(oddity(odd, 1 + n % 3), one).button == n % 3 for n in range(3000)]
    expected = 0.9 * float(oddity_share(apart / 3.0)) + 0.1 / 3
    assert 0.4 < expected < 0.95
    assert stats.binomtest(sum(found), len(found), expected).pvalue > 1e-3


@pytest.mark.parametrize("d_prime", [0.0, 0.5, 1.0, 2.0, 3.5])
def test_the_odd_one_is_found_as_often_as_the_shared_definition_says(
    perception: Perception, surfaces: MakeSurfaces, d_prime: float
) -> None:
    """Without preferences and lapses, within 3 standard errors of 4000 trials."""
    apart = float(np.hypot(*perception.felt().between[:, 0, 1, 1]))
    planted = {} if d_prime else {"MDF": dict.fromkeys(RATED_SCALES, 0.0)}
    temperature_db = apart / d_prime if d_prime else 1.0
    population = replace(EXACT, temperature_db=temperature_db, planted=planted)
    person, one = somebody(perception, population), surfaces(3)
    found = np.mean(
        [person.choose(oddity("full", 1 + n % 3), one).button == n % 3 for n in range(4000)]
    )
    share = float(oddity_share(d_prime))
    assert abs(found - share) < 3 * np.sqrt(share * (1 - share) / 4000)


@pytest.mark.parametrize("model", ["full", "simplified"])
def test_catch_trials_are_found_by_how_far_two_textures_feel(
    perception: Perception, surfaces: MakeSurfaces, model: str
) -> None:
    population = replace(
        EXACT,
        temperature_db=3.0,
        lapse_rate=Trait(0.1),
        planted={"canvas": {"magnitude_similarity": 0.0, "frequency_similarity": 0.0}},
    )
    person, one = somebody(perception, population), surfaces(3)
    number, place = perception.set_number[model], perception.place
    among = perception.felt().among[:, number]
    apart = float(np.hypot(*among[:, place["canvas"], place["PVC"]]))
    np.testing.assert_allclose(among, among.transpose(0, 2, 1))
    assert not among[:, range(3), range(3)].any()

    for pair in (("canvas", "PVC"), ("PVC", "canvas")):
        trials = [catch(model, position, *pair) for position in (1, 2, 3)]
        assert person.odd_distance_db(trials[0]) == pytest.approx(apart)
        found = [person.choose(trials[n % 3], one).button == n % 3 for n in range(1500)]
        expected = 0.9 * float(oddity_share(apart / 3.0)) + 0.1 / 3
        assert 0.4 < expected < 0.95
        assert stats.binomtest(sum(found), len(found), expected).pvalue > 1e-3


def test_the_distance_of_two_textures_is_that_of_their_percepts(
    perception: Perception, models: ModelSets
) -> None:
    percepts = [
        sensation_levels(models.of(name, "simplified"), perception.threshold)
        for name in ("canvas", "PVC")
    ]
    wanted = distance(*percepts)
    one, two = (perception.place[name] for name in ("canvas", "PVC"))
    found = perception.felt().among[:, perception.set_number["simplified"], one, two]
    np.testing.assert_allclose(found, [wanted.magnitude_db, wanted.frequency_db])


def test_without_a_difference_the_odd_one_is_found_by_chance(
    perception: Perception, surfaces: MakeSurfaces
) -> None:
    scales = ("magnitude_similarity", "frequency_similarity")
    population = Psychometrics(planted={"MDF": dict.fromkeys(scales, 0.0)})
    one = surfaces(3)
    right = 0
    for subject in range(1, 301):
        person = somebody(perception, population, subject)
        assert person.odd_distance_db(oddity()) == 0.0
        right += sum(person.choose(oddity("full", p), one).button == p - 1 for p in (1, 2, 3) * 5)
    assert stats.binomtest(right, 4500, 1 / 3).pvalue > 1e-3


def test_what_is_planted_in_ratings_is_felt_as_a_distance_by_whoever_seeks_the_odd_one(
    perception: Perception,
) -> None:
    """−12 points on both scales: each as far as what lowers the best rating, 80, to 68."""
    scales = ("magnitude_similarity", "frequency_similarity")
    population = replace(EXACT, planted={"MDF": dict.fromkeys(scales, -12.0)})
    apart = somebody(perception, population).odd_distance_db(oddity())
    assert apart == pytest.approx(np.sqrt(2) * 12.0 * np.log(80 / 68))


# --- Careless people, and people who differ ------------------------------------------------


CARELESS = replace(EXACT, careless=1.0, noise_sd=8.0, preference_sd=0.5)


def test_careless_people_rate_near_a_level_of_their_own_whatever_is_presented(
    perception: Perception, surfaces: MakeSurfaces
) -> None:
    """Neither models nor anchors matter, nor what is planted, nor practice."""
    population = replace(CARELESS, planted={"MDF": {"magnitude_similarity": -30.0}})
    trials = [absolute(m) for m in ("full", "simplified")]
    trials += [absolute("full", trial=99), absolute("full", virtual="PVC")]
    for subject in range(1, 21):
        person = somebody(perception, population, subject)
        level, sd = person.person.level, person.person.level_sd
        assert {person.judgements(trial) for trial in trials} == {(level, level)}
        given = np.array([[rated(person, trial, surfaces) for trial in trials] for _ in range(50)])
        inside = stats.norm.cdf(100.0, level, sd) - stats.norm.cdf(0.0, level, sd)
        between = given[(given > 0.0) & (given < 100.0)]
        assert stats.binomtest(between.size, given.size, inside).pvalue > 1e-4
        if between.size > 20:
            ends = (0.0 - level) / sd, (100.0 - level) / sd
            assert stats.kstest(between, stats.truncnorm(*ends, level, sd).cdf).pvalue > 1e-4
        middle = np.median(given[:, :, 0], axis=0)
        assert np.ptp(middle) < 8 * 1.25 * sd / np.sqrt(50) + 0.01


def test_careless_people_guess_whatever_they_choose(
    perception: Perception, surfaces: MakeSurfaces
) -> None:
    """In 7AFC, at odd ones, at catch trials, and at tones, however plain."""
    population = replace(CARELESS, temperature_db=0.01, planted={"MDF": {"choice": -30.0}})
    person, one = somebody(perception, population), surfaces(3)
    blind = choice_shares([0.0] * 3, 1.0, person.person.preferences[:3])
    for model in ("full", "simplified"):
        np.testing.assert_allclose(person.shares(relative(model)), blind)
    for trials in (
        [oddity("full", position) for position in (1, 2, 3)],
        [catch("full", position, "canvas", "PVC") for position in (1, 2, 3)],
    ):
        assert person.odd_distance_db(trials[0]) > 0.1
        right = sum(person.choose(trials[n % 3], one).button == n % 3 for n in range(2400))
        assert stats.binomtest(right, 2400, 1 / 3).pvalue > 1e-3
    heard = sum(person.choose(tone(250.0, 10.0), two_bursts()).button == 1 for _ in range(1000))
    assert stats.binomtest(heard, 1000, 0.5).pvalue > 1e-3


def test_people_differ_in_planted_effects_as_much_as_they_were_told_to(
    perception: Perception,
) -> None:
    """Between people alone: an effect is the same on every texture and at every time."""
    effects = {"magnitude_similarity": -6.0, "frequency_similarity": 0.0, "choice": -10.0}
    textures = {"MDF": effects, "PVC": effects}
    population = replace(EXACT, effect_sd=4.0, planted=textures, temperature_db=12.0)
    found = []
    for subject in range(1, 1501):
        person = somebody(perception, population, subject)
        full, other = (person.judgements(absolute(m)) for m in ("full", "simplified"))
        right = [person.shares(relative(m))[2] for m in ("full", "simplified")]
        found.append([*np.subtract(other, full), 100 * (right[1] - right[0])])
        for scale in RATED_SCALES:
            assert person.own_effect("PVC", scale) == person.own_effect("MDF", scale)
    error = 4.0 / np.sqrt(len(found))
    np.testing.assert_allclose(np.mean(found, axis=0), list(effects.values()), atol=4 * error)
    np.testing.assert_allclose(np.std(found, axis=0), 4.0, rtol=0.08)
    assert somebody(perception, population).own_effect("canvas", "choice") is None
    # Whoever feels more of a difference finds the odd one more easily.
    two = [somebody(perception, population, subject) for subject in (1, 2)]
    distances = [person.odd_distance_db(oddity()) for person in two]
    wanted = [
        np.hypot(
            *(population.as_distance_db(person.own_effect("MDF", scale)) for scale in RATED_SCALES)
        )
        for person in two
    ]
    np.testing.assert_allclose(distances, wanted)
    assert distances[0] != distances[1]


def test_nobody_feels_a_difference_between_equal_models(
    study: Study, truths: dict[str, TextureModel], models: ModelSets, threshold: Threshold
) -> None:
    sets = {"full": truths, "simplified": {**models.sets["simplified"], "PVC": truths["PVC"]}}
    perception = Perception(study, real=truths, models=ModelSets(sets=sets), threshold=threshold)
    zero = dict.fromkeys((*RATED_SCALES, "choice"), 0.0)
    person = somebody(perception, replace(EXACT, effect_sd=9.0, planted={"PVC": zero, "MDF": zero}))
    assert person.own_effect("PVC", "choice") == person.odd_distance_db(oddity(texture="PVC")) == 0
    assert person.own_effect("MDF", "choice") != 0
    assert person.odd_distance_db(oddity()) > 0


@pytest.mark.parametrize("subject", [1, 2, 3])
def test_the_careless_and_those_who_differ_come_back_by_their_seed(
    perception: Perception, surfaces: MakeSurfaces, subject: int
) -> None:
    population = Psychometrics(
        careless=0.5, effect_sd=5.0, planted={"MDF": {"magnitude_similarity": 0.0}}
    )
    first, again = (somebody(perception, population, subject) for _ in range(2))
    assert first.person == again.person
    assert first.person == somebody(perception, population, subject, occasion=(2,)).person
    assert first.person != somebody(perception, population, subject, seed=6).person
    assert rated(first, absolute("full"), surfaces) == rated(again, absolute("full"), surfaces)


# --- Beside trials --------------------------------------------------------------------------


def test_the_first_surface_is_presented_and_the_sliders_are_noted(
    perception: Perception, surfaces: MakeSurfaces
) -> None:
    notes: list[tuple[str, dict[str, object]]] = []
    one = surfaces(1, lambda event, **fields: notes.append((event, fields)))
    rating = somebody(perception, Psychometrics()).rate(absolute("full"), one)
    assert one.started
    sliders = {fields["scale"]: fields["value"] for event, fields in notes if event == "slider"}
    assert sliders == {
        "magnitude": rating.magnitude_similarity,
        "frequency": rating.frequency_similarity,
    }


def test_questions_are_answered_and_the_experimenter_is_waited_for(perception: Perception) -> None:
    age = Question(name="age", least=18, most=20)
    sex = Question(name="sex", levels=("female", "male"))
    intake = Intake(consent="1", code="SIM-001", known=False, questions=(age, sex))
    people = [somebody(perception, Psychometrics(), n).welcome(intake) for n in range(1, 101)]
    assert {answers["age"] for answers in people} == {18, 19, 20}
    assert {answers["sex"] for answers in people} == {"female", "male"}
    asked = iter([False, False, True, True])
    somebody(perception, Psychometrics()).wait(lambda: next(asked))
    assert list(asked) == [True]


def test_effects_are_planted_on_textures_whose_models_differ(
    study: Study, truths: dict[str, TextureModel], models: ModelSets, threshold: Threshold
) -> None:
    sets = {"full": truths, "simplified": {**models.sets["simplified"], "PVC": truths["PVC"]}}
    perception = Perception(study, real=truths, models=ModelSets(sets=sets), threshold=threshold)
    require_plantable(perception, Psychometrics(planted={"PVC": {"choice": 0.0}}))
    with refused(InputError, expected=["effect", "PVC"]):
        require_plantable(perception, Psychometrics(planted={"PVC": {"choice": -5.0}}))
    with refused(InputError, expected=["canvas", "MDF", "PVC"], got="cork"):
        require_plantable(perception, Psychometrics(planted={"cork": {"choice": 0.0}}))


# --- Thresholds -----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("above_db", "lapse_rate", "share"),
    [(0.0, 0.0, 0.75), (40.0, 0.0, 1.0), (-60.0, 0.0, 0.5), (40.0, 0.2, 0.9), (None, 0.0, 0.5)],
)
def test_a_tone_is_found_as_its_level_above_the_threshold_says(
    perception: Perception,
    threshold: Threshold,
    above_db: float | None,
    lapse_rate: float,
    share: float,
) -> None:
    """Three quarters at the threshold of this person, which is 3 dB above the study's."""
    population = replace(EXACT, threshold_db=Trait(3.0), lapse_rate=Trait(lapse_rate))
    person = somebody(perception, population)
    frequency_hz = 250.0 if above_db is not None else threshold.valid_range_hz[0] / 2
    level_db = 20 * np.log10(threshold.at(250.0)) + 3.0 + (above_db or 0.0)
    trial = tone(frequency_hz, float(10 ** (level_db / 20)))
    right = 0
    for _ in range(400):
        surfaces = two_bursts()
        right += person.choose(trial, surfaces).button == 1
        assert surfaces.felt == {0, 1}
    assert abs(right / 400 - share) <= 4 * np.sqrt(share * (1 - share) / 400)
