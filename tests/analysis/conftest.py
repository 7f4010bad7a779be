"""Answers of a small study on disk, and two modelled textures with known truth."""

from __future__ import annotations

import json
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from tactileq.analysis.answers.plan import AnalysisPlan, Claim
from tactileq.analysis.answers.responses import Responses
from tactileq.analysis.chapters.chapter import Answered
from tactileq.analysis.labels import ALL_TEXTURES, SCALES
from tactileq.analysis.page.sections import Headline
from tactileq.analysis.statistics.claims import with_people
from tactileq.analysis.statistics.participants.posterior import Described, described
from tactileq.analysis.statistics.participants.verdict import PeopleFound, PeopleSummary
from tactileq.analysis.statistics.verdicts import ClaimFound, claims_found
from tactileq.analysis.textures.results import TextureResult
from tactileq.modeling import TextureModel, Threshold, fit_texture, simplify
from tactileq.stimuli.planted.textures import planted_texture, record_texture

TEXTURES = ("aluminum", "canvas", "leather", "MDF", "polyester", "PVC", "wall paper")
ABSOLUTE = (
    *("trial", "phase", "texture", "model", "tray", "first_surface", "magnitude_similarity"),
    *("frequency_similarity", "toggles", "response_time_s", "simulated"),
)
RELATIVE = (
    *("trial", "phase", "texture", "model", "tray", "layout", "answer", "correct", "presses"),
    *("response_time_s", "simulated"),
)
# What a table has besides, the same in all rows but the texture of the virtual surface.
USUAL = {"run": "1", "valid": "1", "repeats": "n/a", "pilot": "false"}
Rows = list[list[str]]
WriteTask = Callable[..., Path]


@pytest.fixture
def study_folder(tmp_path: Path) -> Path:
    """An empty data set of real people."""
    folder = tmp_path / "data"
    folder.mkdir()
    description = {"Name": "Seven surfaces", "BIDSVersion": "1.10.0", "Simulated": False}
    (folder / "dataset_description.json").write_text(json.dumps(description))
    (folder / "participants.tsv").write_text("participant_id\tsimulated\nsub-01\tfalse\n")
    return folder


@pytest.fixture
def absolute_rows() -> Rows:
    """One training trial and the fourteen main ones."""
    rows = [["1", "training", "canvas", "full", "B", "real", "40", "60", "2", "9.5", "false"]]
    for number, (texture, model) in enumerate(
        [(texture, model) for texture in TEXTURES for model in ("full", "simplified")], start=2
    ):
        ratings = [str(49 + number), str(101 - number)]
        rows.append(
            [str(number), "main", texture, model, "A", "virtual", *ratings, "4", "12.25", "false"]
        )
    return rows


@pytest.fixture
def relative_rows() -> Rows:
    """Seven main trials, every second one answered with the next texture."""
    rows = []
    for number, texture in enumerate(TEXTURES, start=1):
        answer = texture if number % 2 else TEXTURES[number % 7]
        cells = [str(number), "main", texture, "full", "A", "|".join(TEXTURES), answer]
        rows.append([*cells, str(int(answer == texture)), "5", "20.5", "false"])
    return rows


@pytest.fixture
def write_order(study_folder: Path) -> WriteTask:
    """Store the manifest of a session in which these rows are the answers to all trials."""

    def write(task: str, rows: Rows, *, participant: str = "sub-01") -> Path:
        trials = []
        for row in rows:
            cells = dict(zip(ABSOLUTE if task == "absolute" else RELATIVE, row, strict=False))
            shared = ("phase", "texture", "model", "tray", "first_surface")
            trial: dict[str, object] = {name: cells[name] for name in shared if name in cells}
            if "layout" in cells:
                trial["layout"] = cells["layout"].split("|")
            else:
                trial["virtual_texture"] = cells["texture"]
            trials.append({"trial": int(cells["trial"]), **trial})
        path = study_folder / "sourcedata" / participant / "ses-01"
        path.mkdir(parents=True, exist_ok=True)
        path /= f"{participant}_ses-01_task-{task}_manifest.json"
        number = int(participant.removeprefix("sub-"))
        order = {"task": task, "subject": number, "session": 1, "trials": trials}
        path.write_text(json.dumps(order))
        return path

    return write


@pytest.fixture
def write_task(study_folder: Path, write_order: WriteTask) -> WriteTask:
    """Write one session's file and its manifest; `tail` stands after its last whole line.

    Columns that every table has, and that are not given, are added at the end.
    """

    def write(
        task: str,
        rows: Rows,
        *,
        participant: str = "sub-01",
        columns: Sequence[str] | None = None,
        tail: str = "",
    ) -> Path:
        header = columns or (ABSOLUTE if task == "absolute" else RELATIVE)
        path = study_folder / participant / "ses-01" / "beh"
        path.mkdir(parents=True, exist_ok=True)
        path /= f"{participant}_ses-01_task-{task}_beh.tsv"
        added = {name: value for name, value in USUAL.items() if name not in header}
        if task == "absolute" and "virtual_texture" not in header:
            added["virtual_texture"] = ""
        texture = header.index("texture")
        lines = ["\t".join([*header, *added])]
        lines += ["\t".join([*row, *(v or row[texture] for v in added.values())]) for row in rows]
        path.write_bytes(("\n".join(lines) + "\n" + tail).encode())
        write_order(task, rows, participant=participant)
        return path

    return write


def choice_table(
    rng: np.random.Generator, *, people: int = 16, repeats: int = 3, rate: float = 0.5
) -> pd.DataFrame:
    """Answers of a forced choice in which the right one is known with probability `rate`."""
    rows = []
    for person in range(1, people + 1):
        for model in ("full", "simplified"):
            for texture in TEXTURES:
                for _ in range(repeats):
                    knows = rng.random() < rate
                    answer = texture if knows else TEXTURES[rng.integers(7)]
                    rows.append(
                        {
                            "participant_id": f"sub-{person:02d}",
                            "texture": texture,
                            "model": model,
                            "layout": "|".join(TEXTURES),
                            "answer": answer,
                            "correct": float(answer == texture),
                        }
                    )
    return _as_presented(rows)


def rating_table(
    rng: np.random.Generator, *, people: int = 16, effect: float = 0.0
) -> pd.DataFrame:
    """Ratings in which the simplified PVC scores lower by `effect` on both scales."""
    rows = []
    for person in range(1, people + 1):
        for texture in TEXTURES:
            for model in ("full", "simplified"):
                lower = effect * (model == "simplified" and texture == "PVC")
                ratings = np.clip(60 - lower + rng.normal(0, 8, 2), 0, 100)
                rows.append(
                    {
                        "participant_id": f"sub-{person:02d}",
                        "texture": texture,
                        "model": model,
                        "magnitude_similarity": ratings[0],
                        "frequency_similarity": ratings[1],
                    }
                )
    return _as_presented(rows)


def _as_presented(rows: Rows) -> pd.DataFrame:
    """The trials of each participant in an order and with times of their own."""
    draws = np.random.default_rng(11)
    answers = pd.DataFrame(rows).assign(response_time_s=draws.lognormal(2.3, 0.4, len(rows)))
    mixed = answers.iloc[draws.permutation(len(rows))]
    mixed = mixed.sort_values("participant_id", kind="stable", ignore_index=True)
    trial = mixed.groupby("participant_id").cumcount() + 1
    return mixed.assign(session="ses-01", trial=trial)


def claim(
    measure: str, *, bounds: tuple[float, float] | None = (-7.5, 7.5), planned: bool = True
) -> Claim:
    """A claim about full and simplified models."""
    return Claim(
        name=f"{measure} is the same",
        task="relative" if measure == "correct" else "absolute",
        measure=measure,
        models=("full", "simplified"),
        bounds=bounds,
        test="equivalence",
        planned=planned,
    )


def people_summary(
    *,
    mean: tuple[float, float, float] = (0.0, -1.0, 1.0),
    sd: tuple[float, float, float] = (2.0, 0.1, 5.4),
    careless: float = 0.03,
    converged: bool = True,
) -> PeopleSummary:
    """Mean and SD with their 95 % intervals; the 90 % interval of the mean is as wide."""
    return PeopleSummary(
        mean=mean[0],
        mean_low=mean[1],
        mean_high=mean[2],
        mean90_low=mean[1],
        mean90_high=mean[2],
        sd=sd[0],
        sd_low=sd[1],
        sd_high=sd[2],
        careless=careless,
        careless_low=0.5 * careless,
        careless_high=2 * careless,
        lapses=0.01,
        converged=converged,
    )


def people_table(effects: Sequence[float], *, careless: Collection[int] = ()) -> pd.DataFrame:
    """Participants with these effects, and the places of the careless."""
    places = range(len(effects))
    return pd.DataFrame(
        {
            "participant_id": [f"sub-{place + 1:02d}" for place in places],
            "effect": effects,
            "ci_low": np.array(effects) - 4.0,
            "ci_high": np.array(effects) + 4.0,
            "careless": [0.8 if place in careless else 0.05 for place in places],
        }
    )


def by_model(
    found: ClaimFound,
    summary: PeopleSummary,
    *,
    doubled: PeopleSummary | None = None,
    people: pd.DataFrame | None = None,
    decides: bool = True,
) -> ClaimFound:
    """A claim as if the model of the participants had found this; textures as the mean."""
    textures = found.tests["texture"][found.tests["texture"] != ALL_TEXTURES]
    outside = found.claim.bounds is not None and not summary.inside(found.claim.bounds)
    table = people_table([0.0] * 16) if people is None else people
    ratings = np.random.default_rng(1).normal(60.0, 8.0, (20, len(table), 4, 2, 2))
    rated = described(np.clip(ratings, 0.0, 100.0))
    told = PeopleFound(
        summary=summary,
        doubled=doubled or summary,
        people=table,
        textures=pd.DataFrame(
            {
                "texture": textures,
                "mean": summary.mean,
                "ci_low": summary.mean_low,
                "ci_high": summary.mean_high,
                "p_difference": 0.001 if outside else 0.5,
                "p_equivalence": 0.5 if outside else 0.001,
            }
        ),
        given=Described(**{name: values[:1] for name, values in vars(rated).items()}),
        replicated=rated,
    )
    tests = with_people(found.tests, told, found.claim, caveats=found.caveats, decides=decides)
    return replace(found, tests=tests, people=told, by_model=decides)


PLAN = AnalysisPlan(
    claims=(
        claim("magnitude_similarity"),
        claim("frequency_similarity"),
        claim("correct", bounds=(-0.1, 0.1)),
    ),
    exclusions=("Trials in which the rig failed are repeated.",),
    sha256=("0a" * 32,),
)


@pytest.fixture(scope="session")
def plan() -> AnalysisPlan:
    """Three claims of equivalence with bounds."""
    return PLAN


@pytest.fixture(scope="session")
def anchors(ratings: pd.DataFrame) -> dict[str, pd.DataFrame]:
    """Canvas beside PVC's model, which everybody rates 30 points lower than beside its own."""
    own = ratings[(ratings["texture"] == "canvas") & (ratings["model"] == "full")]
    lower = {scale: own[scale] - 30.0 for scale in SCALES}
    return {"absolute": own.assign(virtual_texture="PVC", **lower)}


@pytest.fixture(scope="session")
def found(
    ratings: pd.DataFrame, choices: pd.DataFrame, anchors: dict[str, pd.DataFrame]
) -> list[ClaimFound]:
    """The claims of the plan about the answers of sixteen people, who tell surfaces apart."""
    responses = Responses(
        {"absolute": ratings, "relative": choices},
        simulated_participants=True,
        simulated_rig=True,
        anchors=anchors,
        plan=PLAN,
    )
    return claims_found(responses, rng=np.random.default_rng(5))


@pytest.fixture(scope="session")
def choices() -> pd.DataFrame:
    return choice_table(np.random.default_rng(1))


@pytest.fixture(scope="session")
def ratings() -> pd.DataFrame:
    return rating_table(np.random.default_rng(2), effect=30.0)


def _small_truth(name: str, texture: str) -> TextureModel:
    truth = planted_texture(
        name, speeds_mm_s=np.array([200.0, 350.0]), forces_n=np.array([1.0, 3.0])
    )
    return replace(truth, texture=texture)


def _result(name: str, texture: str) -> TextureResult:
    truth = _small_truth(name, texture)
    recordings = record_texture(truth, duration_s=0.5, seed=3)
    full = fit_texture(recordings)
    return TextureResult(
        recordings=recordings,
        model=full,
        simplification=simplify(full, Threshold.shipped("codec")),
        truth=truth,
        other_estimates=(fit_texture(recordings, estimator="paper"),),
    )


@pytest.fixture(scope="session")
def results(once_per_run: Callable[..., Any]) -> tuple[TextureResult, ...]:
    """Two textures over 2 × 2 conditions, one of them named like a piece of HTML."""
    named = (("leather", "leather"), ("PVC", "<b>bold</b> & co"))
    made: tuple[TextureResult, ...] = once_per_run(
        "results", lambda folder: tuple(_result(*names) for names in named)
    )
    return made


@pytest.fixture(scope="session")
def truth() -> TextureModel:
    """Four planted layers over 2 × 2 conditions."""
    return _small_truth("canvas", "canvas")


@pytest.fixture(scope="module")
def few_draws() -> Iterator[None]:
    """No test of a report hangs on p values of more than a thousand draws."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("tactileq.analysis.chapters.confusions.similarity_choice.SIMULATIONS", 19)
        patch.setattr("tactileq.analysis.statistics.paired.RESAMPLES", 999)
        patch.setattr("tactileq.analysis.statistics.rates.BOOTSTRAP_RESAMPLES", 500)
        yield


def words_of(headline: Headline | None) -> str:
    """The answer of a report, with its points."""
    return " ".join([headline.subject, *headline.points]) if headline else ""


def answered_of(
    responses: Responses,
    *,
    found: Sequence[ClaimFound] | None = None,
    planted: Mapping[str, Mapping[str, float]] | None = None,
    seed: int = 1,
) -> Answered:
    """What chapters get; the claims are those of the answers if not given."""
    rng = np.random.default_rng(seed)
    found = claims_found(responses, rng=rng) if found is None else found
    return Answered(responses=responses, found=found, rng=rng, seed=seed, planted=planted)
