"""Files of every kind, changed at random, load with finite values or end in one sentence."""

from __future__ import annotations

import gzip
import io
import json
import warnings
from collections.abc import Callable, Iterable
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import soundfile

from tactileq.analysis.answers.hand import load_hand
from tactileq.analysis.answers.imported import load_imported
from tactileq.analysis.answers.loading import load_responses
from tactileq.analysis.answers.table_map import parse_map
from tactileq.experiments.study.study import SHIPPED_STUDY, Study
from tactileq.experiments.tasks import plan_session
from tactileq.modeling import (
    ARModel,
    CompiledScene,
    InputError,
    Recording,
    RecordingSet,
    Renderer,
    Scene,
    Simplification,
    TextureModel,
    Threshold,
    Vibrator,
    compensation_for,
    compile_scene,
    regressed,
    simplify,
)
from tactileq.modeling.files.answer_tables import ANSWER_TABLES
from tactileq.modeling.fitting.conditions import recording_spectra
from tactileq.modeling.models.loading import AnyModel, load_model
from tactileq.modeling.recordings.trajectory import load_trajectory
from tactileq.modeling.scenes.compiled import load_compiled
from tactileq.modeling.scenes.hands import HandRange
from tactileq.modeling.scenes.places import places_of
from tactileq.rig.desk.parts import hand_settings
from tactileq.rig.devices.hand.scripted import ScriptedTrajectory
from tactileq.rig.devices.simulated.vibrator import SimulatedAccelerometer, SimulatedTransducers
from tactileq.rig.devices.sound.signals import stimuli_of_surfaces
from tactileq.rig.machines.recorder.evaluation import read_evaluation
from tactileq.rig.machines.recorder.recorder_file import SHIPPED_RECORDER_FILE, RecorderFile
from tactileq.rig.machines.recorder.store import RECORDER_COLUMNS, RecorderStore
from tactileq.rig.recording.capture.grid import StrokeGrid
from tactileq.rig.recording.capture.pieces import PieceStore, Plan
from tactileq.rig.recording.importing.files import import_csv, import_wav
from tactileq.rig.recording.importing.hatt_reader import load_hatt
from tactileq.rig.recording.importing.labels import Label, labels_from_table
from tactileq.rig.shared.setup.rig_file import SHIPPED_RIG_FILE, Figure, RigFile
from tactileq.stimuli.planted.textures import planted_texture
from tactileq.stimuli.planted.vibrators import planted_vibrator
from tactileq.stimuli.sets.recipe import Recipe
from tactileq.stimuli.sets.sources import load_sources
from tactileq.stimuli.sets.writing import write_set
from tests.mutating import mutated

FEW, MANY = 40, 400  # mutations of each kind; the answers of a study are five files
LONGEST_MESSAGE = 400

# --- a good file of each kind, and what is done with one that loads

Use = Callable[[Path], Iterable[object]]
NOISE = np.random.default_rng(5).normal(0, 0.1, 400)
GRID = {"speeds_mm_s": np.array([100.0, 300.0]), "forces_n": np.array([1.0, 3.0])}
TEXTURE = planted_texture("wall paper", **GRID)
LABEL = Label("oak", 100.0, 1.0)
FREQUENCY_HZ = np.linspace(0.0, 0.5, 20)


def use_model(path: Path) -> Iterable[object]:
    model: AnyModel = load_model(path)
    model.save(path.with_name("again.json"))
    assert load_model(path.with_name("again.json")) == model
    yield Renderer(model).render(200.0, 2.0, samples=100)
    if isinstance(model, ARModel):
        yield model.filter(200.0, 2.0).response(FREQUENCY_HZ * model.rate_hz)
        return
    yield model.peq(200.0, 2.0).response(FREQUENCY_HZ * model.rate_hz)
    if isinstance(model, TextureModel) and model.unit == "g":
        yield from verdicts(model, Threshold.named("codec"))


def verdicts(model: TextureModel, threshold: Threshold) -> Iterable[object]:
    result = simplify(model, threshold)
    yield result.model.gains
    # NaN: where no threshold is known.
    distances = np.array([layer.distance_db for layer in result.layers])
    yield distances[~np.isnan(distances)]


def use_wav(path: Path) -> Iterable[object]:
    return usable_samples(import_wav([path], [LABEL], g_per_fullscale=2.0))


def use_csv(path: Path) -> Iterable[object]:
    return usable_samples(import_csv([path], [LABEL], axis="x"))


def use_labels(path: Path) -> Iterable[object]:
    for label in labels_from_table(path, [Path("a.wav"), Path("b.wav")], texture=None)[0]:
        yield Recording(NOISE, 5000.0, label.speed_mm_s, label.force_n, label.texture).samples


def use_set(path: Path) -> Iterable[object]:
    return usable_samples(RecordingSet.load(path.parent))


def usable_samples(records: RecordingSet) -> Iterable[object]:
    for record in records:
        yield record.samples
        yield record.duration_s
        yield [found.magnitude for _, found in recording_spectra(RecordingSet([record]))]


def use_hatt(path: Path) -> Iterable[object]:
    texture = load_hatt(path)
    yield texture.filter(160.0, 1.5).response(FREQUENCY_HZ * texture.rate_hz)
    yield from usable_samples(texture.recordings([160.0], [1.5], duration_s=0.1))


TOUCH = """
version = 1
[set]
name = "touch"
rate_hz = [5000]
format = "pcm24"
duration_s = 0.1
[level]
full_scale_g = 4.0
[[model]]
path = "model.json"
label = "full"
[[trajectory]]
speed_mm_s = 100
force_n = 1.0
"""


def use_recipe(path: Path) -> Iterable[object]:
    recipe = Recipe.load(path)
    (path.parent / "again.toml").write_text(recipe.to_toml(), encoding="utf-8")
    sources = load_sources(recipe)
    yield [trajectory.duration_s for trajectory in sources.trajectories]


def use_stimuli(path: Path) -> Iterable[object]:
    found = stimuli_of_surfaces(path.parent, label="full", textures=[TEXTURE.texture])
    for stimulus in found.values():
        yield from (stimulus.samples_g, stimulus.duration_s)


def use_scene(path: Path) -> Iterable[object]:
    scene = Scene.load(path)
    json.dumps(scene.to_dict(), allow_nan=False)
    yield (len(scene.sha256), len(scene.files))
    places = places_of(TEXTURE, scene.hand)
    yield from (places.share, places.speed_change_mm_s2, places.force_change_n_s)
    yield from (places.speed_range, places.force_range)


def use_compiled_scene(path: Path) -> Iterable[object]:
    for model in load_compiled(path.parent, {TEXTURE.texture: TEXTURE}).values():
        yield Renderer(model).render(200.0, 2.0, samples=100)


def use_rig_file(path: Path) -> Iterable[object]:
    rig = RigFile.load(path)
    json.dumps(rig.to_dict(), allow_nan=False)
    yield (len(rig.sha256), len(rig.files), rig.fullscale_per_g)
    yield list(vars(rig.safe_limits).values())
    yield [figure.value for figure in rig.figures().values() if isinstance(figure, Figure)]
    points = hand_settings(rig).pressure_points
    yield [] if points is None else points


def use_simulated_vibrator(path: Path) -> Iterable[object]:
    accelerometer = SimulatedAccelerometer(SimulatedTransducers.load(path), rate_hz=48_000.0)
    yield accelerometer.give(NOISE[:80])


def use_study(path: Path) -> Iterable[object]:
    study = Study.load(path)
    assert Study.from_dict(json.loads(json.dumps(study.to_dict()))) == study
    yield len(plan_session(study, task="relative", subject=1, session=1).trials)


def use_answers(path: Path) -> Iterable[object]:
    folder = next(parent for parent in path.parents if parent.name == "data")
    responses = load_responses(folder)
    yield responses.answers["absolute"]["trial"].to_numpy(float)
    yield len(responses.textures)


def use_hand(path: Path) -> Iterable[object]:
    folder = next(parent for parent in path.parents if parent.name == "data")
    hand = load_hand(folder, load_responses(folder).answers)
    yield hand["trials"].to_numpy(float)
    yield hand[["speed_mm_s", "force_n", "contact_s", "presentations"]].fillna(0.0).to_numpy(float)


def use_table(path: Path) -> Iterable[object]:
    imported = load_imported([path], parse_map("participant=who,correct=right,factor=size"))
    yield imported.answers["correct"].dropna().to_numpy(float)


def use_matrix(path: Path) -> Iterable[object]:
    imported = load_imported([path], parse_map("factor=size"))
    yield imported.answers["count"].to_numpy(float)


def use_vibrator(path: Path) -> Iterable[object]:
    found = Vibrator.load(path)
    yield found.peq.response(FREQUENCY_HZ * found.rate_hz)
    yield compensation_for(found).settling_s


def use_simplification(path: Path) -> Iterable[object]:
    loaded = Simplification.load(path)
    yield from (loaded.model.gains, [layer.worst_force_n for layer in loaded.layers])


def use_threshold(path: Path) -> Iterable[object]:
    threshold = Threshold.load(path)
    yield threshold.at(threshold.valid_range_hz)
    yield from verdicts(TEXTURE, threshold)


def use_trajectory(path: Path) -> Iterable[object]:
    yield load_trajectory(path, name="hand").duration_s


def use_positions(path: Path) -> Iterable[object]:
    script = ScriptedTrajectory.load(path)
    yield [script.at(time_s) for time_s in (0.0, 0.3, 1e9)]


def use_stroke_grid(path: Path) -> Iterable[object]:
    grid = StrokeGrid.load(path)
    yield from grid.bounds()
    yield grid.cells([80.0, np.nan], [1.0, 1.0])


def use_pieces(path: Path) -> Iterable[object]:
    grid = StrokeGrid([80.0, 160.0], [1.0])
    store = PieceStore(path.parents[1], Plan("oak", grid, 5000.0, wanted_s=0.5))
    yield store.coverage.seconds


@cache
def compiled_scene() -> CompiledScene:
    """Once for all kinds of files."""
    hand = HandRange(speed_mm_s=(100.0, 250.0), force_n=(1.0, 2.5))
    return compile_scene(Scene(name="light touch", hand=hand), {TEXTURE.texture: TEXTURE})


def recorder_rows() -> bytes:
    names = [column.name for column in RECORDER_COLUMNS]
    row = ["oak", "50", "1", "1", *["0.5"] * 8, "1", "true", "49.9", "1.01"]
    return "\n".join(["\t".join(names), "\t".join(row), ""]).encode()


def use_recorder_file(path: Path) -> Iterable[object]:
    file = RecorderFile.load(path)
    yield np.hstack([np.ravel(value) for value in file.law().registers().values()])
    yield file.law().largest_force_n(1.0)


def use_recorder_store(path: Path) -> Iterable[object]:
    plan = Plan("oak", StrokeGrid([50.0, 100.0], [1.0, 2.0]), 1000.0, wanted_s=0.4)
    store = RecorderStore(path.parent, plan, radius_mm=40.0)
    yield len(store.missing)
    yield len(store.rows())


def use_evaluation(path: Path) -> Iterable[object]:
    yield read_evaluation(path, rate_hz=1000.0)


def ar_model() -> ARModel:
    return ARModel(
        texture="oak",
        rate_hz=5000.0,
        **GRID,
        line_spectral_frequencies=np.tile([0.4, 0.9, 1.7, 2.5], (2, 2, 1)),
        gains=np.full((2, 2), 0.1),
        level_sd_db=np.zeros((2, 2)),
    )


def wav_bytes() -> bytes:
    buffer = io.BytesIO()
    soundfile.write(buffer, NOISE, 5000, format="WAV", subtype="PCM_16")
    return buffer.getvalue()


def rig_bytes() -> bytes:
    """The shipped rig file with a vibrator and a calibration."""
    text = SHIPPED_RIG_FILE.read_text(encoding="utf-8")
    text = text.replace('# file = "vibrator.json"', 'file = "vibrator.json"')
    calibration = '[calibration]\ndate = 2026-11-22\nrig = "desk rig"\nserials = []\n'
    return (text + calibration).encode()


def csv_bytes() -> bytes:
    rows = (f"{n / 5000:.4f},{x:.6f},{x / 2:.6f}" for n, x in enumerate(NOISE[:100]))
    return "\n".join(["time (s),x (g),y (g)", *rows, ""]).encode()


TEXTURES = ("canvas", "MDF", "PVC", "oak")


def answer_rows() -> str:
    cells = {column.name: "" for column in ANSWER_TABLES["absolute"].columns}
    rows = ["\t".join(cells)]
    for trial, texture in enumerate(TEXTURES, start=1):
        given = {"trial": str(trial), "phase": "main" if trial > 1 else "training"}
        given |= {"texture": texture, "model": "full", "tray": "A", "first_surface": "real"}
        given |= {"magnitude_similarity": "50", "frequency_similarity": "70", "toggles": "3"}
        given |= {"virtual_texture": texture, "run": "1", "pilot": "false"}
        given |= {"response_time_s": "12.5", "valid": "1", "repeats": "n/a", "simulated": "false"}
        rows.append("\t".join((cells | given).values()))
    return "\n".join([*rows, ""])


ANSWERS = "data/sub-01/ses-01/beh/sub-01_ses-01_task-absolute_beh"
DATA = {
    "data/dataset_description.json": json.dumps({"Name": "Seven surfaces", "Simulated": False}),
    "data/participants.tsv": "participant_id\tsimulated\nsub-01\tfalse\n",
    f"{ANSWERS}.tsv": answer_rows(),
    f"{ANSWERS}.json": json.dumps({"Simulated": False, "trial": {"Description": "Number"}}),
    "data/sourcedata/sub-01/ses-01/sub-01_ses-01_task-absolute_manifest.json": json.dumps(
        {
            "task": "absolute",
            "subject": 1,
            "session": 1,
            "trials": [
                {"trial": trial, "phase": "main" if trial > 1 else "training", "texture": texture}
                for trial, texture in enumerate(TEXTURES, start=1)
            ],
        }
    ),
}
HAND_STEM = ANSWERS.removesuffix("beh")
EVENTS = (
    "onset\tduration\ttrial_type\tsurface\trun\ttrial\n0\t1\tpresented\tvirtual\t1\t2\n"
    "1.5\tn/a\tpresented\treal\t1\t2\n4\t1\tpresented\tvirtual\t1\t3\n"
)
OF_HAND = ["speed_mm_s", "force_n", "surface", "force_assumed", "trial"]
READINGS = "".join(f"{90 + n}\t{n % 3}\t2\t0\t{2 + n // 10}\n" for n in range(30))
SAMPLED = {
    "Columns": OF_HAND,
    "SamplingFrequency": 250.0,
    "surface": {"Levels": {"0": "none", "1": "the real surface", "2": "a virtual surface"}},
}
TRIALS = "who;size;right\nP1;1;1\nP1;2;0\nP2;1;1\nP2;2;1\nP3;1;0\nP3;2;\n"
MATRIX = ",a,b,c\na,5,1,0\nb,2,4,1\nc,0,0,6\n"
RECIPE = b"""version = 1
[set]
name = "test"
rate_hz = [5000, 8000]
seeds = [1, 2]
duration_s = 0.25
vibrator = "vibrator.json"
[level]
mode = "loudness"
threshold = "pen-hold"
[[model]]
path = "model.json"
label = "full"
[[trajectory]]
speed_mm_s = 100
force_n = 1.5
[[trajectory]]
file = "hand.csv"
"""
SCENE = b"""version = 1
[scene]
name = "light touch"
textures = ["wall paper"]
threshold = "threshold.tsv"
margin_db = 1
[hand]
speed_mm_s = [100, 250]
force_n = [1, 2.5]
stroke_hz = 1.5
[actuator]
band_hz = [40, 400]
rate_hz = 8000
peak_g = 5
rms_g = 2
[bound]
gfc30 = 0.9
bands_db = 1.5
[budget]
operations = 500
bytes = 9999
"""
DISTRIBUTION = b"""version = 1
scene = {name = "two places"}
[[hand.place]]
speed_mm_s = 150
force_n = 1.5
share = 0.7
[[hand.place]]
speed_mm_s = 250
force_n = 2
share = 0.3
[budget]
device = "stm32l432"
"""
RECORDED = b"""version = 1
[scene]
name = "recorded"
[hand]
file = "hand.csv"
"""
SCENE_RECIPE = b"""version = 1
set = {name = "scene", rate_hz = 5000}
[[model]]
scene = "compiled"
[[model]]
path = "model.json"
label = "full"
[[trajectory]]
speed_mm_s = 100
force_n = 1.5
"""
HAND = b"time_s,speed_mm_s,force_n\n0,100,1\n0.5,150,1.5\n1,nan,2\n2,0,0\n"
POSITIONS = b"time_s\tx_mm\ty_mm\tforce_n\n0\t0\t0\t1\n0.5\t40\t-2.5\t1.5\n1\t10\t0\t0\n"
THRESHOLD = (
    b"# source: test\n# caveat: none\nfrequency_hz\tdisplacement_um\n10\t5\n100\t0.5\n600\t2\n"
)
LABELS = b"file\tspeed_mm_s\tforce_n\trepeat\na.wav\t50\t1.5\t1\nb.wav\t100\t1.5\t1\n"
STROKES = b"""speeds_mm_s = [80, 160.5]
forces_n = [1]
speed_tolerance = 0.2
[exploration]
seconds = 20.5
"""
PIECES = (
    b"file\ttexture\tspeed_mm_s\tforce_n\trepeat\trate_hz\tsamples\tmean_speed_mm_s\t"
    b"speed_sd_mm_s\tmean_force_n\tforce_sd_n\tsimulated\tforce_assumed\n"
    b"00001.wav\toak\t80.0\t1.0\t1\t5000.0\t1000\t81\t2\t1\t0.1\tfalse\tfalse\n"
    b"00002.wav\toak\t80.0\t1.0\t1\t5000.0\t900\t81\t2\t1\t0.1\ttrue\tfalse\n"
)
EVALUATION = b"Time(s),ax(g),ay(g),az(g)\n" + b"".join(
    b"%.6f,0.1,%.4f,%.4f\n" % (n / 1000, n / 50, -n / 40) for n in range(40)
)
RECORDER_PLAN = b"""{"texture": "oak", "conditions": [[50.0, 1.0], [100.0, 1.0], [100.0, 2.0]],
"rate_hz": 1000.0, "duration_s": 0.4, "repeat": 1, "radius_mm": 40.0, "simulated": false}
"""
KINDS: dict[str, tuple[str, Use]] = {
    "model": ("model.json", use_model),
    "regressed model": ("regressed.json", use_model),
    "autoregressive model": ("ar.json", use_model),
    "recording (WAV)": ("a.wav", use_wav),
    "recording (CSV)": ("run.csv", use_csv),
    "labels": ("labels.tsv", use_labels),
    "recording set": ("set/recordings.tsv", use_set),
    "samples of a set": ("set/0001.csv", use_set),
    "toolkit": ("Models_Planted.xml", use_hatt),
    "recipe": ("set.toml", use_recipe),
    "stimuli of a study": ("touch/manifest.tsv", use_stimuli),
    "scene": ("scene.toml", use_scene),
    "scene of a distribution": ("places.toml", use_scene),
    "scene of a recorded hand": ("recorded.toml", use_scene),
    "recipe of a scene": ("scene-set.toml", use_recipe),
    "compiled scene": ("compiled/scene.json", use_compiled_scene),
    "model of a compiled scene": ("compiled/wall-paper.json", use_compiled_scene),
    "trajectory": ("hand.csv", use_trajectory),
    "scripted hand": ("positions.tsv", use_positions),
    "study": ("study.toml", use_study),
    "rig file": ("rig.toml", use_rig_file),
    "simulated vibrator": ("in_silico.toml", use_simulated_vibrator),
    "grid of strokes": ("grid.toml", use_stroke_grid),
    "recorder file": ("recorder.toml", use_recorder_file),
    "plan of a recorder": ("held/recorder.json", use_recorder_store),
    "table of a recorder": ("held/recorder.tsv", use_recorder_store),
    "file of the evaluation tool": ("evaluation.csv", use_evaluation),
    "pieces of strokes": ("strokes/pieces/pieces.tsv", use_pieces),
    "vibrator": ("vibrator.json", use_vibrator),
    "simplification": ("x_simplification.json", use_simplification),
    "threshold": ("threshold.tsv", use_threshold),
    **{f"answers: {Path(name).name}": (name, use_answers) for name in DATA},
    "events of a session": (f"{HAND_STEM}events.tsv", use_hand),
    "readings of the hand": (f"{HAND_STEM}recording-start1_physio.tsv.gz", use_hand),
    "what the readings are": (f"{HAND_STEM}recording-start1_physio.json", use_hand),
    "table of another experiment": ("answers.csv", use_table),
    "confusion matrix": ("P1_small.csv", use_matrix),
}


def write_good_files(folder: Path, hatt_xml: str) -> None:
    """One good file of each kind, and what it rests on."""
    TEXTURE.save(folder / "model.json")
    regressed(TEXTURE).save(folder / "regressed.json")
    ar_model().save(folder / "ar.json")
    planted_vibrator().save(folder / "vibrator.json")
    simplify(TEXTURE, Threshold.shipped("codec")).save(folder / "x_simplification.json")
    RecordingSet(Recording(NOISE[:80], 5000.0, v, 1.0, "oak") for v in (50, 100)).save(
        folder / "set"
    )
    RecordingSet(Recording(NOISE, 1000.0, v, 1.0, "oak") for v in (50, 100)).save(folder / "held")
    contents = {
        "a.wav": wav_bytes(),
        "run.csv": csv_bytes(),
        "labels.tsv": LABELS,
        "Models_Planted.xml": hatt_xml.encode(),
        "set.toml": RECIPE,
        "scene.toml": SCENE,
        "scene-set.toml": SCENE_RECIPE,
        "places.toml": DISTRIBUTION,
        "recorded.toml": RECORDED,
        "hand.csv": HAND,
        "positions.tsv": POSITIONS,
        "study.toml": SHIPPED_STUDY.read_bytes(),
        "rig.toml": rig_bytes(),
        "in_silico.toml": b"frequency_hz = 90.0\nheight = 3.5\nhum_g = 0.01\nseed = 4\n",
        "grid.toml": STROKES,
        "strokes/pieces/pieces.tsv": PIECES,
        "recorder.toml": SHIPPED_RECORDER_FILE.read_bytes(),
        "held/recorder.json": RECORDER_PLAN,
        "held/recorder.tsv": recorder_rows(),
        "evaluation.csv": EVALUATION,
        "threshold.tsv": THRESHOLD,
        **{name: text.encode() for name, text in DATA.items()},
        f"{HAND_STEM}events.tsv": EVENTS.encode(),
        f"{HAND_STEM}recording-start1_physio.tsv.gz": gzip.compress(READINGS.encode(), mtime=0),
        f"{HAND_STEM}recording-start1_physio.json": json.dumps(SAMPLED).encode(),
        "answers.csv": TRIALS.encode(),
        "P1_small.csv": MATRIX.encode(),
    }
    for name, data in contents.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(data)
    compiled_scene().save(folder / "compiled")
    (folder / "touch.toml").write_text(TOUCH)
    write_set(folder / "touch", Recipe.load(folder / "touch.toml"))


def complaint(use: Use, path: Path) -> str:
    """What is wrong with how a file is taken; empty where it is used or refused as it should."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            finite = all(np.isfinite(np.asarray(found)).all() for found in use(path))
        except InputError as error:
            return wrong_with(str(error).replace(str(path.parent), ""))
        except Exception as error:  # any other is what this test is to find
            return f"{type(error).__name__}: {error}"
    return "" if finite else "values that are not finite"


def wrong_with(message: str) -> str:
    plain = "\n" not in message and "np." not in message and "numpy" not in message
    short = len(message) < LONGEST_MESSAGE
    return "" if plain and short and message.endswith(".") else f"the message {message[:600]!r}"


def complaints(name: str, folder: Path, seeds: Iterable[int]) -> list[str]:
    """What goes wrong with the mutations of one kind of file under these seeds."""
    file, use = KINDS[name]
    path = folder / file
    good = path.read_bytes()
    list(use(path))  # the good one is used, not refused
    found = []
    for seed in seeds:
        path.write_bytes(mutated(good, seed))
        if wrong := complaint(use, path):
            found.append(f"seed {seed}: {wrong}")
    path.write_bytes(good)
    return found


@pytest.mark.parametrize("name", KINDS)
@pytest.mark.parametrize(
    "seeds",
    [
        pytest.param(range(FEW), id="few"),
        pytest.param(
            range(FEW, MANY), id="many", marks=pytest.mark.long("mutations by the hundred")
        ),
    ],
)
def test_a_mutated_file_is_used_or_refused_in_one_sentence(
    name: str, seeds: range, tmp_path: Path, hatt_xml: Callable[..., str]
) -> None:
    write_good_files(tmp_path, hatt_xml())
    some = seeds[:: len(DATA)] if name.startswith("answers") else seeds
    assert complaints(name, tmp_path, some) == []
