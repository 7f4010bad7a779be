"""tactileq demo --device: the whole study on simulated devices, in virtual time."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tactileq.commands.benches.demo_benches import reported
from tactileq.commands.benches.demo_parts import JOBS, demo_population, modelled, presented
from tactileq.commands.results.analyze import read_answers
from tactileq.commands.study.simulate import run_study
from tactileq.printing import progress, share_of
from tactileq.results import FolderResults
from tactileq.workers import mapping

if TYPE_CHECKING:
    from tactileq.analysis.textures.results import TextureResult
    from tactileq.experiments.study.study import Study
    from tactileq.modeling import TextureModel, Threshold

PARTICIPANTS = 4  # of each task; each of their hands takes minutes of virtual time


def demo_on_devices(out: Path, seed: int, study: Study | None = None) -> None:
    """Record on the recorder, model, simplify, ask hands on the cable device, analyze.

    Parameters
    ----------
    study : Study, optional
        Of planted textures; `device_study` without it.
    """
    import pandas as pd

    from tactileq.analysis.answers.hand import load_hand
    from tactileq.analysis.report.report import write_report
    from tactileq.benches.recorder.section import recorder_section
    from tactileq.benches.recorder.tables import near_table, records_of
    from tactileq.modeling import Threshold
    from tactileq.modeling.files.writing import file_stem
    from tactileq.modeling.threads import one_linear_algebra_thread
    from tactileq.rig.desk.device_twin import DeviceTwin
    from tactileq.stimuli.planted.textures import PlantedSurface

    written = FolderResults(out, "demo --device")
    provenance: dict[str, Any] = {}
    plan, threshold = study or device_study(), Threshold.named("mobile")
    textures = plan.textures
    print(
        "A study on simulated devices: simulated surfaces and participants, the real firmware and "
        "program."
    )
    with (
        written.folder(provenance) as fresh,
        mapping(jobs=JOBS) as mapped,
        one_linear_algebra_thread(),
    ):
        record = partial(recorded_texture, folder=fresh, threshold=threshold, seed=seed)
        with progress("Recording, modeling, simplifying", len(textures)) as advance:
            done = list(reported(mapped(record, textures), advance, lambda one: one[0].texture))
        made = [result for result, _ in done]
        models, real = presented(made)
        population = demo_population(textures)
        run_study(
            plan,
            real=real,
            models=models,
            data=fresh / "data",
            threshold=threshold,
            seed=seed,
            psychometrics=population,
            rig=DeviceTwin(real, seed=seed),
        )
        settings = {
            "estimator": made[0].model.estimator,
            "threshold": threshold.name,
            "threshold_sha256": threshold.sha256,
            "study_sha256": plan.sha256,
            "models_sha256": models.sha256(plan.textures),
            "study": plan.to_dict(),
            "planted": population.planted,
        }
        provenance |= written.provenance(settings, seed=seed)
        responses = read_answers({"": fresh / "data"}, ())
        hand = load_hand(fresh / "data", responses.answers)
        near = near_table(
            {result.texture: (result.model, direct) for result, direct in done},
            {name: PlantedSurface(name) for name in textures},
        )
        records = pd.concat(
            [records_of(fresh / "recordings" / file_stem(name)) for name in textures],
            ignore_index=True,
        )
        with share_of("Analyzing") as advance_share:
            write_report(
                fresh / "report.html",
                responses=responses,
                textures=made,
                hand=hand,
                benches=[recorder_section(records, near, hand)],
                provenance=provenance,
                planted=population.planted,
                seed=seed,
                progress=advance_share,
                mapped=mapped,
            )
    print((out / "report.html").resolve())


def device_study() -> Study:
    """The paper's study with few participants and one repeat."""
    from tactileq.experiments.study.study import Study

    tables = Study.load().to_tables()
    for task in ("absolute", "relative"):
        tables[task] |= {"participants": PARTICIPANTS, "repeats": 1}
    tables["plan"]["rule"] = "tests"  # too few for the model of the participants
    return Study.from_tables(tables)


def recorded_texture(
    name: str, folder: Path, *, threshold: Threshold, seed: int
) -> tuple[TextureResult, TextureModel]:
    """A planted texture from the simulated recorder, and a model of the direct route."""
    from tactileq.commands.recording.recorder import RecorderRecording, record_quietly
    from tactileq.modeling import fit_texture
    from tactileq.modeling.files.writing import file_stem
    from tactileq.stimuli.planted.textures import RECORDER_RATE_HZ, planted_texture, record_texture

    truth = planted_texture(name, rate_hz=RECORDER_RATE_HZ)
    options = RecorderRecording(name, 1.0, 1, seed=seed)
    record_quietly(folder / "recordings" / file_stem(name), options)
    result = modelled(name, folder, threshold=threshold, truth=truth)
    return result, fit_texture(record_texture(truth, seed=seed))
