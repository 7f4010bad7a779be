"""Simulated participants with a known truth: what they feel, rate and choose.

The truth is a stipulation that lets analyses be tested, not a model of people
(docs/method/protocols.md#simulated-participants).
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from math import expm1, hypot, isnan, log, log10, sqrt

import numpy as np

from tactileq.experiments.observers.percepts import Perception
from tactileq.experiments.observers.psychometrics import (
    EFFECTS,
    RATED_SCALES,
    Psychometrics,
    choice_shares,
    with_effect,
)
from tactileq.experiments.sessions.loop.people import (
    Choice,
    ChoiceTrial,
    Intake,
    RatedTrial,
    Rating,
)
from tactileq.experiments.sessions.loop.surfaces import Note, Surfaces
from tactileq.experiments.study.questions import Question
from tactileq.experiments.study.study import TASKS
from tactileq.experiments.tasks.oddity import OddityTrial
from tactileq.experiments.tasks.threshold import ThresholdTrial
from tactileq.modeling import InputError
from tactileq.modeling.participants.ratings import censored, lapsed_ratings
from tactileq.modeling.seeds import generator

MEDIAN_TIME_S = 20.0
DETECTION_SLOPE = 2.2  # Weibull's, of amplitudes
TIME_SD = 0.4  # of the logarithm of response times
LOOKS = 2.0  # comparisons beside those that every answer takes, on average
WAITING_S = 0.01


class SimulatedParticipant:
    """One simulated participant, with the same answers for the same seed.

    Parameters
    ----------
    psychometrics : Psychometrics
        The population that the participant is drawn from.
    seed : int
        Of the whole simulation.
    subject : int
        Fixes, with the seed, the participant's traits.
    occasion : tuple of int
        Distinguishes the sessions of a participant.
    """

    simulated = True

    def __init__(
        self,
        perception: Perception,
        psychometrics: Psychometrics,
        *,
        seed: int,
        subject: int,
        occasion: tuple[int, ...],
    ) -> None:
        self._perception = perception
        self._psychometrics = psychometrics
        self._own_rng = generator(seed, subject)
        self.person = psychometrics.draw(self._own_rng)
        felt = perception.felt(self.person.threshold_db)
        self._from_real = (self.person.sensitivity * felt.from_real).tolist()
        self._between = (self.person.sensitivity * felt.between).tolist()
        self._among = (self.person.sensitivity * felt.among).tolist()
        self._rng = generator(seed, subject, *occasion)

    def hear(self, note: Note, page: Callable[[str], None]) -> None:
        """Simulated participants have nothing to note, and see no pages."""

    def consents(self, version: str) -> bool:
        """Simulated participants always do."""
        return True

    def welcome(self, intake: Intake) -> Mapping[str, str | int]:
        """Answer each question at random; no answer to a trial hangs on it."""
        return {question.name: self._answer(question) for question in intake.questions}

    def _answer(self, question: Question) -> str | int:
        if question.levels:
            return question.levels[int(self._own_rng.integers(len(question.levels)))]
        assert question.least is not None
        assert question.most is not None
        return int(self._own_rng.integers(round(question.least), round(question.most) + 1))

    def announce(self, page: str, **values: object) -> None:
        """Simulated participants know the task."""

    def wait(self, until: Callable[[], bool]) -> None:
        """Wait for the experimenter."""
        while not until():
            time.sleep(WAITING_S)

    def rest(self) -> None:
        """Simulated participants do not tire."""

    def progress(self, done: int, of: int) -> None:
        """Simulated participants do not look at it."""

    def rate(self, trial: RatedTrial, surfaces: Surfaces) -> Rating:
        """Switch a few times, then rate by the distance to the real surface.

        The rating is a normal judgement, censored at the ends of the scale.
        """
        surfaces.start()
        for _ in range(1 + self._looks()):
            surfaces.toggle()
        if self._rng.random() < self.person.lapse_rate:
            given = lapsed_ratings(self._rng, (len(RATED_SCALES),))
        else:
            given = censored(self._rng.normal(self.judgements(trial), self._noise_sd(trial)))
        magnitude, frequency = (round(value, 2) for value in given.tolist())
        surfaces.note("slider", scale="magnitude", value=magnitude)
        surfaces.note("slider", scale="frequency", value=frequency)
        return Rating(
            magnitude_similarity=magnitude,
            frequency_similarity=frequency,
            response_time_s=self._response_time_s(),
        )

    def judgements(self, trial: RatedTrial) -> tuple[float, float]:
        """Means of the participant's judgements on the two scales in such a trial.

        They may lie beyond the ends of the scale, as no rating does.
        """
        if self.person.careless:
            return self.person.level, self.person.level
        magnitude, frequency = (self._felt(trial, scale) for scale in range(len(RATED_SCALES)))
        return magnitude + self.person.magnitude_bias, frequency + self.person.frequency_bias

    def _felt(self, trial: RatedTrial, scale: int) -> float:
        """Mean judgement on a scale, without the person's bias."""
        real, virtual = (
            self._perception.place[texture] for texture in (trial.texture, trial.virtual_texture)
        )
        model = self._perception.set_number[trial.model]
        effect = self.own_effect(trial.texture, RATED_SCALES[scale]) if real == virtual else None
        apart = self._from_real[scale][model if effect is None else 0][real][virtual]
        felt = self._psychometrics.felt_rating(apart)
        return felt + effect if effect is not None and model else felt

    def own_effect(self, texture: str, what: str) -> float | None:
        """A planted effect as this person feels it, in points: on average as it was planted.

        None where percepts decide.
        """
        points = self._psychometrics.effect(texture, what)
        if points is None:
            return None
        strength = self.person.sensitivity / self._psychometrics.sensitivity.mean
        return points * strength + self._deviation(texture, what)

    def _deviation(self, texture: str, what: str) -> float:
        """By how much this person's effect is larger; of identical models nobody's is."""
        if texture in self._perception.identical:
            return 0.0
        return self.person.deviations[EFFECTS.index(what)]

    def _noise_sd(self, trial: RatedTrial) -> float:
        """SD of the person's judgements in such a trial."""
        if self.person.careless:
            return self.person.level_sd
        noise_sd = self._psychometrics.noise_sd * self._unpractised(trial.trial)
        return noise_sd / sqrt(self.person.care)

    def choose(self, trial: ChoiceTrial, surfaces: Surfaces) -> Choice:
        """Feel all; choose what is most like the real one, the odd one out, or what was felt."""
        surfaces.start()
        for button in range(surfaces.count):
            surfaces.present_virtual(button)
        if isinstance(trial, ThresholdTrial):
            button = self._interval(trial) - 1
        elif trial.texture in trial.layout:
            for _ in range(1 + self._looks()):
                surfaces.toggle()
            button = self._drawn(self.shares(trial))
        else:
            for look in range(self._looks()):
                surfaces.present_virtual(look % surfaces.count)
            button = self._odd_one(trial)
        surfaces.choose(button)
        return Choice(button=button, response_time_s=self._response_time_s())

    def _interval(self, trial: ThresholdTrial) -> int:
        """The interval in which the tone was felt, by its level above the threshold; 1 or 2."""
        assert trial.amplitude_g is not None
        threshold_g = float(self._perception.threshold.held(trial.frequency_hz))
        above_db = 20 * log10(trial.amplitude_g / threshold_g) - self.person.threshold_db
        # Where no threshold is known nothing is felt.
        felt = 0.0 if isnan(above_db) else -expm1(-log(2) * 10 ** (DETECTION_SLOPE * above_db / 20))
        attentive = self._rng.random() >= self.person.blind_rate
        right = self._rng.random() < (0.5 + 0.5 * felt if attentive else 0.5)
        return trial.interval if right else 3 - trial.interval

    def shares(self, trial: ChoiceTrial) -> list[float]:
        """Probabilities of the buttons in such a trial of the relative task."""
        place, number = self._perception.place, self._perception.set_number[trial.model]
        effect = self.own_effect(trial.texture, "choice")
        model = number if effect is None else 0
        magnitude, frequency = (
            self._from_real[scale][model][place[trial.texture]] for scale in (0, 1)
        )
        temperature_db = self._temperature_db(trial)
        evidence = [
            -hypot(magnitude[place[other]], frequency[place[other]]) / temperature_db
            for other in trial.layout
        ]
        shares = choice_shares(evidence, self.person.blind_rate, self._liked(trial))
        if effect is None or self.person.careless:
            return shares
        right = trial.layout.index(trial.texture)
        reference, other = with_effect(shares, right, effect=effect / 100)
        return other if number else reference

    def _odd_one(self, trial: ChoiceTrial) -> int:
        """The button whose percept, with noise, is farthest from those of the other two.

        Without preferences and lapses its share of right answers is
        `tactileq.modeling.participants.choices.oddity_share` of the distance divided by the noise.
        """
        liked = self._liked(trial)
        if self._rng.random() < self.person.blind_rate:
            return self._drawn(choice_shares([0.0] * len(liked), 1.0, liked))
        percepts = self._rng.standard_normal(len(liked))
        if isinstance(trial, OddityTrial):
            odd = np.arange(1, percepts.size + 1) == trial.odd_position
        else:
            odd = np.array([name == trial.model for name in trial.layout])
        percepts[odd] += self.odd_distance_db(trial) / self._temperature_db(trial)
        others = (percepts.sum() - percepts) / (percepts.size - 1)
        return int(np.argmax(np.abs(percepts - others) + liked))

    def odd_distance_db(self, trial: ChoiceTrial) -> float:
        """How far the odd surface feels from the others; planted effects count as distances.

        In a catch trial it is another texture, of which no effect is planted.
        """
        if isinstance(trial, OddityTrial) and trial.is_catch:
            number = self._perception.set_number[trial.model]
            two = [self._perception.place[name] for name in (trial.texture, trial.odd_texture)]
            return hypot(*(scale[number][two[0]][two[1]] for scale in self._among))
        first, second = sorted({self._perception.set_number[name] for name in trial.layout})
        place = self._perception.place[trial.texture]
        apart = []
        for scale, name in enumerate(RATED_SCALES):
            points = None if first else self._psychometrics.effect(trial.texture, name)
            if points is None:
                apart.append(self._between[scale][first][second][place])
            else:
                own = points + self._deviation(trial.texture, name)
                as_db = self._psychometrics.as_distance_db(own)
                apart.append(self.person.sensitivity * as_db)
        return hypot(*apart)

    def _temperature_db(self, trial: ChoiceTrial) -> float:
        return self._psychometrics.temperature_db * self._unpractised(trial.trial)

    def _unpractised(self, trial: int) -> float:
        return self._psychometrics.unpractised(self.person, trial)

    def _liked(self, trial: ChoiceTrial) -> tuple[float, ...]:
        return self.person.preferences[: len(trial.layout)]

    def _drawn(self, shares: Sequence[float]) -> int:
        """An index drawn with these probabilities."""
        left = float(self._rng.random()) * sum(shares)
        for index, share in enumerate(shares):
            left -= share
            if left < 0:
                return index
        return len(shares) - 1  # by rounding alone

    def _looks(self) -> int:
        return int(self._rng.poisson(LOOKS * self.person.care))

    def _response_time_s(self) -> float:
        median_s = MEDIAN_TIME_S * self.person.care
        return round(float(self._rng.lognormal(log(median_s), TIME_SD)), 3)


def occasion_of(task: str, session: int) -> tuple[int, ...]:
    """What distinguishes the sessions of a participant in the seeds of the answers."""
    return (session, TASKS.index(task))


def require_plantable(perception: Perception, psychometrics: Psychometrics) -> None:
    """Refuse effects that no simulated participant could show.

    Raises
    ------
    InputError
        For effects on textures that are not in the study, or whose models are all equal.
    """
    for texture, effects in psychometrics.planted.items():
        if texture not in perception.place:
            raise InputError(
                f"expected effects on {', '.join(perception.textures)}, got one on {texture}; "
                "plant it on a texture of the study."
            )
        if texture in perception.identical and any(effects.values()):
            raise InputError(
                f"expected no effect on {texture}, whose models are equal, got one; plant it on a "
                "texture whose models differ."
            )
