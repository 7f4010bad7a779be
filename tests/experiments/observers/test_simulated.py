"""Simulated participants against the closed form of what they were told to be."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy import integrate, stats

from experiments.observers.percepts import Perception, distance, sensation_levels
from experiments.observers.psychometrics import Psychometrics, Trait, choice_shares
from experiments.observers.simulated import SimulatedParticipant, require_plantable
from experiments.sessions.surfaces import Intake, Surfaces
from experiments.study.models import ModelSets
from experiments.study.questions import Question
from experiments.study.study import Study
from experiments.tasks.absolute import AbsoluteTrial
from experiments.tasks.oddity import OddityTrial
from experiments.tasks.relative import RelativeTrial
from experiments.tasks.threshold import ThresholdTrial
from modeling import InputError, TextureModel, Threshold
from rig.interface import ToneBurst
from rig.twin import SimulatedRig
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
        full, simplified = (person.mean_ratings(absolute(m)) for m in ("full", "simplified"))
        attentive = (simplified[0] - full[0]) * (1 - person.person.lapse_rate)
        assert attentive == pytest.approx(effect * person.person.sensitivity, abs=1e-9)
        # What is not planted follows percepts.
        assert simplified[1] != full[1]


@pytest.mark.parametrize("effect", [-12.0, 0.0, 9.0])
def test_what_is_planted_in_ratings_comes_back(
    perception: Perception, surfaces: MakeSurfaces, effect: float
) -> None:
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
    assert (np.abs(np.mean(differences, axis=0) - effect) < 4 * error).all()
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
    assert stats.kstest(lapsed / 100, "uniform").pvalue > 1e-4


def test_hardly_any_rating_is_at_100(
    study: Study, truths: dict[str, TextureModel], models: ModelSets, surfaces: Any, threshold: Any
) -> None:
    """Even where the virtual surface is the real one, and effects are planted upwards."""
    alike = Perception(study, real=truths, models=models, threshold=threshold)
    population = Psychometrics(planted={"MDF": {"magnitude_similarity": 10.0}})
    ratings = np.array(
        [
            rated(somebody(alike, population, n), absolute(model, trial=9), surfaces)
            for n in range(1, 1001)
            for model in ("full", "simplified")
        ]
    )
    assert np.mean(ratings >= 99.5) < 0.05
    assert 0.0 <= ratings.min() < ratings.max() <= 100.0
    assert ratings.mean() > 70.0


def test_an_anchor_is_rated_as_another_texture(
    perception: Perception, surfaces: MakeSurfaces
) -> None:
    planted = replace(EXACT, planted={"MDF": {"magnitude_similarity": 0.0}})
    found = rated(somebody(perception, planted), absolute("full", virtual="PVC"), surfaces)
    apart = perception.distance("MDF", "full", "PVC")
    expected = [EXACT.felt_rating(apart.magnitude_db), EXACT.felt_rating(apart.frequency_db)]
    np.testing.assert_allclose(found, np.maximum(expected, 3.0), atol=0.005)


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


def triangle(sensitivity: float) -> float:
    """Share of right answers in a triangle test (Bradley 1963, Biometrics 19:385), by d′."""

    def density(u: float) -> float:
        shift = sensitivity * np.sqrt(2 / 3)
        tails = stats.norm.cdf([-u * np.sqrt(3) + shift, -u * np.sqrt(3) - shift])
        return float(2 * tails.sum() * stats.norm.pdf(u))

    return integrate.quad(density, 0, np.inf)[0]


def test_the_closed_form_of_the_triangle_test_is_the_published_one() -> None:
    """Ennis 1993 (Journal of Sensory Studies 8:353), table of the triangular method."""
    assert triangle(0.0) == pytest.approx(1 / 3)
    assert triangle(1.0) == pytest.approx(0.418, abs=5e-4)
    assert triangle(2.0) == pytest.approx(0.605, abs=5e-4)


@pytest.mark.parametrize("odd", ["full", "simplified"])
def test_odd_ones_are_found_as_in_a_triangle_test(
    perception: Perception, surfaces: MakeSurfaces, odd: str
) -> None:
    population = replace(EXACT, temperature_db=3.0, lapse_rate=Trait(0.1))
    person, one = somebody(perception, population), surfaces(3)
    apart = float(np.hypot(*perception.felt().between[:, 0, 1, 1]))
    assert person.odd_distance_db(oddity(odd)) == pytest.approx(apart)
    found = [person.choose(oddity(odd, 1 + n % 3), one).button == n % 3 for n in range(3000)]
    expected = 0.9 * triangle(apart / 3.0) + 0.1 / 3
    assert 0.4 < expected < 0.95
    assert stats.binomtest(sum(found), len(found), expected).pvalue > 1e-3


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

    def caught(position: int, *textures: str) -> OddityTrial:
        return OddityTrial(
            trial=1,
            phase="main",
            tray="A",
            texture=textures[0],
            odd_texture=textures[1],
            model=model,
            layout=(model,) * 3,
            odd_position=position,
        )

    for pair in (("canvas", "PVC"), ("PVC", "canvas")):
        assert person.odd_distance_db(caught(1, *pair)) == pytest.approx(apart)
        found = [person.choose(caught(1 + n % 3, *pair), one).button == n % 3 for n in range(1500)]
        expected = 0.9 * triangle(apart / 3.0) + 0.1 / 3
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
    trial = ThresholdTrial(
        trial=1,
        phase="main",
        texture="n/a",
        model="n/a",
        tray="",
        frequency_hz=frequency_hz,
        interval=2,
        amplitude_g=float(10 ** (level_db / 20)),
    )
    bursts = [ToneBurst(frequency_hz=250.0, amplitude_g=0.0, duration_s=0.01)] * 2
    right = 0
    for _ in range(400):
        surfaces = Surfaces(
            SimulatedRig(),
            texture="n/a",
            models=bursts,
            begin=lambda of: None,
            note=lambda event, **fields: None,
        )
        right += person.choose(trial, surfaces).button == 1
        assert surfaces.felt == {0, 1}
    assert abs(right / 400 - share) <= 4 * np.sqrt(share * (1 - share) / 400)
