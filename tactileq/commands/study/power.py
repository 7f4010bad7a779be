"""tactileq power: how many participants a study needs for its claims."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tactileq.commands.study.chances import chances
from tactileq.commands.study.session import models_of_study
from tactileq.modeling.errors import shown
from tactileq.options import (
    Models,
    Out,
    SceneModels,
    Seed,
    Simplified,
    StudyArgument,
    ThresholdName,
)
from tactileq.printing import print_models, progress
from tactileq.results import FolderResults

if TYPE_CHECKING:
    import pandas as pd

    from tactileq.experiments.study.study import Study

PICTURE_DPI = 150


def power(
    study: StudyArgument,
    models: Models = None,
    simplified: Simplified = None,
    scene: SceneModels = None,
    subjects: Annotated[
        str,
        typer.Option(
            "--subjects",
            help="Numbers of participants: from,to,step (8,48,8), or a list in brackets ([8,20]).",
        ),
    ] = "8,48,8",
    simulations: Annotated[
        int, typer.Option(min=10, max=100_000, help="Number of simulations.")
    ] = 200,
    effect: Annotated[
        list[str] | None,
        typer.Option(
            metavar="[TEXTURE:]WHAT=POINTS",
            help="Plant a difference between the models instead of the one that the simulated "
            "percepts give, in all textures or in one; WHAT is magnitude_similarity, "
            "frequency_similarity or choice; repeatable.",
        ),
    ] = None,
    threshold: ThresholdName = "codec",
    seed: Seed = 0,
    jobs: Annotated[
        int | None, typer.Option(min=1, help="Processes at once; by default one per core.")
    ] = None,
    dask: Annotated[
        str | None,
        typer.Option(help="Address of a Dask scheduler whose workers run the simulations."),
    ] = None,
    out: Out = Path("power"),
) -> None:
    """Simulate a study with n participants many times: the chance of each verdict on its claims.

    Verdicts follow the rule that the study's plan names. The planted textures of the same names
    take the place of the real surfaces. Writes power.tsv, power.png and power.svg. A first estimate
    is printed within 20 s, or after two simulations if these take longer, with the time remaining.

    Example: tactileq power study.toml --subjects 12,48,12 --effect magnitude_similarity=0
    """
    from tactileq.benches.power.in_memory import people_of, planned_for
    from tactileq.experiments.study.study import Study
    from tactileq.modeling import Threshold

    results = FolderResults(out, "power")
    results.reads(study, Threshold.file_of(threshold))
    plan = Study.load(study)
    sizes = sizes_of(subjects)
    largest = planned_for(plan, sizes)
    planted = planted_effects(effect or (), plan.textures)
    people = people_of(
        largest,
        models_of_study(
            plan, study, models=models, simplified=simplified, scene=scene, reads=results.reads
        )[0],
        threshold=threshold,
        planted=planted,
    )
    print_models(people.models, plan.textures)

    def print_first(table: pd.DataFrame, left_s: float) -> None:
        done = int(table["simulations"].iloc[0])
        print(f"first estimate, from {done} of {simulations} simulated studies:")
        for line in _sentences(table, plan, out):
            print(f"  {line}")
        print(f"about {max(1, round(left_s / 60))} min left")

    with progress("Simulated studies", simulations) as advance:
        table = chances(
            people,
            sizes,
            simulations=simulations,
            seed=seed,
            jobs=jobs,
            dask=dask,
            advance=advance,
            first=print_first,
        )
    settings = {
        "study_sha256": plan.sha256,
        "models_sha256": people.models.sha256(plan.textures),
        "threshold": threshold,
        "subjects": list(sizes),
        "simulations": simulations,
        "planted": planted,
    }
    _write(table, plan, results, seed=seed, settings=settings)


def sizes_of(text: str) -> tuple[int, ...]:
    """Numbers of participants from `from,to,step`, or from a list in brackets.

    Raises
    ------
    ValueError
        For anything else.
    """
    listed = text.startswith("[") and text.endswith("]")
    try:
        numbers = [int(word) for word in text.strip("[]").split(",")]
    except ValueError:
        numbers = []
    if not listed and len(numbers) == 3 and numbers[2] > 0:
        numbers = list(range(numbers[0], numbers[1] + 1, numbers[2]))
    elif not listed and len(numbers) != 1:
        numbers = []
    if not numbers or min(numbers) < 2 or max(numbers) > 9999:
        raise ValueError(
            "expected participants from 2 to 9999 as from,to,step (8,48,8), one number, or a list "
            f"in brackets ([8,20,36]), got {shown(text)}; correct --subjects."
        )
    return tuple(sorted(set(numbers)))


def planted_effects(effects: Sequence[str], textures: Sequence[str]) -> dict[str, dict[str, float]]:
    """Points by texture and by what they are planted in, from `[TEXTURE:]WHAT=POINTS`.

    Raises
    ------
    ValueError
        For another form, or a texture that is not in the study.
    """
    from tactileq.experiments.observers.psychometrics import EFFECTS

    planted: dict[str, dict[str, float]] = {}
    for text in effects:
        place, _, points = text.rpartition("=")
        texture, _, what = place.rpartition(":")
        if what not in EFFECTS or not _is_number(points) or texture not in ("", *textures):
            raise ValueError(
                f"expected [TEXTURE:]WHAT=POINTS for --effect, with a texture of the study "
                f"({', '.join(textures)}) and one of {', '.join(EFFECTS)}, got {shown(text)}; "
                "correct it."
            )
        for one in [texture] if texture else textures:
            planted.setdefault(one, {})[what] = float(points)
    return planted


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _write(
    table: pd.DataFrame,
    plan: Study,
    results: FolderResults,
    *,
    seed: int,
    settings: dict[str, object],
) -> None:
    from tactileq.analysis.columns import tsv_text
    from tactileq.analysis.page.saving import save_figure, svg_of
    from tactileq.analysis.power.figure import figure_power
    from tactileq.modeling.files.writing import write_text

    marked = table.assign(simulated="true")
    figure = figure_power(table)
    with results.folder(results.provenance(settings, seed=seed)) as fresh:
        write_text(fresh / "power.tsv", tsv_text(marked))
        save_figure(figure, fresh / "power.png", dpi=PICTURE_DPI)
        (fresh / "power.svg").write_bytes(svg_of(figure)[0])
    for line in _sentences(table, plan, results.out):
        print(line)
    print(f"simulated: {results.out / 'power.png'}")


def _sentences(table: pd.DataFrame, plan: Study, out: Path) -> list[str]:
    from tactileq.analysis.answers.plan import plan_from
    from tactileq.analysis.power.power import power_sentences

    return power_sentences(table, claims=plan_from(plan.plan.to_dict(), path=out).claims)
