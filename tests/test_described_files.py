"""One sentence for whatever is wrong with a key, for each file that is declared.

What is refused and how it is called follows from the declarations; tests/described.py makes the
wrong files. Rules between keys are tested where they stand.
"""

from __future__ import annotations

import copy
import datetime
import json
import re
from pathlib import Path

import jsonschema
import pytest
import tomlkit

from tactileq.experiments.study.study import Study
from tactileq.modeling import InputError, Scene
from tactileq.modeling.files.describing import schema
from tactileq.modeling.scenes.scene import SceneFile
from tactileq.rig.machines.recorder.recorder_file import RecorderFile
from tactileq.rig.shared.setup.rig_file import RigFile
from tactileq.stimuli.planted.vibrators import planted_vibrator
from tactileq.stimuli.sets.recipe import Recipe
from tests import saved_files
from tests.described import Kind, Place, declared, mutations, places, toml_of

HAND = "time_s,speed_mm_s,force_n\n0,100,1\n1,200,2\n"
THRESHOLD = "frequency_hz\tacceleration_g\n10\t1\n500\t2\n"
_SCENE = {"name": "touch", "models": "models", "textures": ["canvas", "PVC"], "margin_db": 3.0}
SCENE = Kind(
    name="scene.toml",
    section=SceneFile,
    examples=(
        {
            "version": 1,
            "scene": {**_SCENE, "threshold": "own.tsv"},
            "hand": {"speed_mm_s": [50, 150], "force_n": [0.5, 1.0], "stroke_hz": 1.5},
            "actuator": {"band_hz": [40, 400], "rate_hz": 5000, "peak_g": 5, "rms_g": 2},
            "bound": {"gfc30": 0.9, "bands_db": 1.5, "level_db": 0.5},
            "budget": {"operations": 150, "bytes": 16384},
        },
        {
            "version": 1,
            "scene": {"name": "touch"},
            "hand": {"file": "hand.csv"},
            "budget": {"device": "stm32l432"},
        },
        {
            "version": 1,
            "scene": {"name": "touch"},
            "hand": {"place": [{"speed_mm_s": 100, "force_n": 1, "share": 3}]},
        },
    ),
    load=Scene.load,
    write=toml_of,
    beside={"own.tsv": THRESHOLD, "hand.csv": HAND},
)
_SET = {
    "name": "paper",
    "rate_hz": [5000, 48000],
    "seeds": [1, 2],
    "noise": "frozen",
    "duration_s": 2.0,
    "settling_s": 0.25,
    "vibrator": "vibrator.json",
}
RECIPE = Kind(
    name="set.toml",
    section=Recipe,
    examples=(
        {
            "version": 1,
            "set": {**_SET, "format": "pcm24"},
            "level": {
                "mode": "loudness",
                "threshold": "own.tsv",
                "sensation_level_db": 20.0,
                "full_scale_g": 4.0,
            },
            "model": [{"path": "models", "label": "full"}],
            "trajectory": [{"speed_mm_s": 150, "force_n": 1.5, "name": "slow"}],
        },
        {
            "version": 1,
            "set": {"name": "paper"},
            "level": {"mode": "rms", "rms_db": -20.0},
            "model": [{"scene": "light.toml"}],
            "trajectory": [{"file": "hand.csv"}],
        },
    ),
    load=Recipe.load,
    write=toml_of,
    beside={
        "own.tsv": THRESHOLD,
        "hand.csv": HAND,
        "light.toml": tomlkit.dumps(SCENE.examples[2]),
    },
    again=Recipe.to_toml,
)


def figure(value: float, unit: str) -> dict[str, object]:
    return {"value": value, "unit": unit, "assumed": True, "source": "a guess"}


DAY = datetime.date(2026, 11, 22)
RIG = Kind(
    name="rig.toml",
    section=RigFile,
    examples=(
        {
            "version": 1,
            "rig": {"name": "desk rig", "serials": ["V1", "C1"]},
            "sound": {
                "device": "USB",
                "rate_hz": 48000,
                "block": 64,
                "channels": 4,
                "vibration_channel": 2,
                "masking_channel": 3,
                "masking_level": 0.25,
                "fullscale_v": figure(4, "V"),
                "simulated": True,
            },
            "vibrator": {
                "file": "vibrator.json",
                "g_per_volt": figure(1.5, "g/V"),
                "measured_on": DAY,
            },
            "limits": {
                "peak_g": figure(3, "g"),
                "rms_g": figure(1, "g"),
                "rms_window_s": figure(1, "s"),
                "duration_s": figure(60, "s"),
                "pause_s": figure(0.1, "s"),
                "exposure_m_s2": figure(2.5, "m/s²"),
            },
            "hand": {
                "kind": "mouse",
                "device": "/dev/input/event7",
                "counts_per_mm": figure(40, "counts/mm"),
                "filter_delay_s": figure(0.01, "s"),
                "assumed_force_n": figure(1, "N"),
                "pressure_curve": {
                    "points": [[0, 0], [1, 4.5]],
                    "unit": "N",
                    "assumed": False,
                    "source": "weights",
                },
                "contact_n": figure(0, "N"),
                "baud": 9600,
                "grab": True,
                "script": "hold",
            },
            "force": {
                "library": "/opt/libdhd.so",
                "serial": 12,
                "rate_hz": 2000,
                "damping": figure(1, "N·s/m"),
                "delay_ms": figure(0.5, "ms"),
                "most_n": figure(6, "N"),
                "most_n_per_s": figure(1000, "N/s"),
                "most_w": figure(3, "W"),
                "most_mm_s": figure(800, "mm/s"),
                "late_ms": figure(5, "ms"),
                "frozen_ms": figure(200, "ms"),
                "release_ms": figure(40, "ms"),
                "low_mm": [-50, -60, -70],
                "high_mm": [50, 60, 70],
                "homed_on": DAY,
            },
            "device": {
                "address": "/dev/ttyACM0",
                "baud": 500_000,
                "simulated": True,
                "renders": True,
                "volts_per_g": figure(1, "V/g"),
            },
            "pose": {
                "origin_mm": [1.5, 0, -2],
                "x": [0, 1, 0],
                "z": [0, 0, 1],
                "measured_on": DAY,
            },
            "accelerometer": {
                "device": "USB",
                "channel": 2,
                "rate_hz": 44100,
                "g_per_fullscale": figure(50, "g"),
                "noise_floor_g": figure(0.002, "g"),
            },
            "latency": {
                "median_ms": figure(12, "ms"),
                "p95_ms": figure(15, "ms"),
                "measured_on": DAY,
                "rests_on": ["sound.block = 128"],
            },
            "calibration": {
                "date": DAY,
                "rig": "desk rig",
                "serials": ["V1"],
                "rests_on": ["sound.fullscale_v = 4 V"],
            },
            "real_surface": {
                "hand_measured": True,
                "offset_mm": figure(80, "mm"),
                "stiffness": figure(0.8, "N/mm"),
            },
        },
    ),
    load=RigFile.load,
    write=toml_of,
    beside={"vibrator.json": planted_vibrator().to_json()},
)
RECORDER = Kind(
    name="recorder.toml",
    section=RecorderFile,
    examples=(
        {
            "version": 1,
            "recorder": {
                "name": "player",
                "address": "/dev/ttyACM0",
                "baud": 500_000,
                "simulated": False,
            },
            "sample": {
                "radius": figure(41, "mm"),
                "inner": figure(14, "mm"),
                "outer": figure(59, "mm"),
                "safety": figure(2, "mm"),
                "run_in_s": 0.5,
            },
            "motors": {
                "n_m_per_a": figure(0.03, "N·m/A"),
                "nominal": figure(4, "A"),
                "most": figure(5, "A"),
                "heat": figure(50, "A²·s"),
                "counts": 8192,
            },
            "turntable": {
                "inertia": figure(3e-4, "kg·m²"),
                "cut_off": figure(50, "rad/s"),
                "fastest": figure(15, "rad/s"),
            },
            "contactor": {
                "inertia": figure(2e-5, "kg·m²"),
                "cut_off": figure(300, "rad/s"),
                "friction": figure(2e-4, "N·m"),
                "gravity": figure(-0.001, "N·m"),
                "lever": figure(31, "mm"),
                "stiffness": figure(4, "N/mm"),
            },
            "sensor": {"files": "adcm", "axis": "x", "wait_s": 20.0, "rate_hz": 220704},
        },
        {
            "version": 1,
            "recorder": {"name": "player", "address": "/dev/ttyACM0"},
            "sensor": {"device": "USB", "channel": 2, "g_per_fullscale": figure(40, "g")},
        },
    ),
    load=RecorderFile.load,
    write=toml_of,
    beside={},
)
_TEXTURES = {"textures": ["canvas", "PVC", "MDF"], "trays": {"canvas": "A", "PVC": "B", "MDF": "C"}}
_CLAIM = {"name": "alike", "models": ["full", "simplified"], "test": "equivalence"}
STUDY = Kind(
    name="study.toml",
    section=Study,
    examples=(
        {
            "name": "three surfaces",
            "seed": 7,
            **_TEXTURES,
            "models": {"full": "models", "simplified": "simplified"},
            "languages": ["en", "ja"],
            "texts": {"ja": "ja.toml"},
            "longest_gap_min": 20,
            "masking": "pink noise",
            "surface_visible": "no",
            "data_license": "CC0",
            "calibration_days": 30,
            "measured_force": True,
            "consent": {"version": "2026-11"},
            "wall": {
                "height_mm": 5,
                "stiffness_n_per_mm": 0.5,
                "damping_n_s_per_m": 0.1,
                "width_mm": 80,
                "length_mm": 60,
                "under": [
                    {
                        "texture": "canvas",
                        "height_mm": 4,
                        "stiffness_n_per_mm": 0.4,
                        "damping_n_s_per_m": 0,
                    }
                ],
            },
            "publication": {
                "description": "Ratings of three surfaces.",
                "license": "CC-BY-4.0",
                "ethics": "Board 7, 2026-12",
                "funding": ["Grant 1"],
                "keywords": ["haptics"],
                "doi": "10.1000/182",
                "model_licenses": {"full": "CC0-1.0"},
                "authors": [
                    {
                        "family": "Carberry",
                        "given": "Josiah",
                        "orcid": "0000-0002-1825-0097",
                        "affiliation": "Brown University",
                    }
                ],
            },
            "questions": [
                {
                    "name": "craft",
                    "levels": ["no", "yes"],
                    "text": {"en": "Any craft?", "ja": "手仕事は?"},
                    "levels_text": {"ja": ["いいえ", "はい"]},
                },
            ],
            "plan": {
                "exclusions": ["Who slept."],
                "highest_share_at_ends": 0.3,
                "rule": "model",
                "few": 0.2,
                "claims": [
                    {**_CLAIM, "task": "oddity", "measure": "correct", "bounds": [-0.1, 0.2]}
                ],
            },
            "absolute": {
                "participants": 9,
                "schedule": "interleaved",
                "anchors": {"canvas": "PVC"},
            },
            "oddity": {
                "participants": 8,
                "schedule": "interleaved",
                "repeats": 6,
                "models": ["full", "simplified"],
                "training_trials": 2,
                "most_training_trials": 4,
                "break_after": 20,
                "feel_all": True,
                "catch": {"MDF": "PVC"},
                "catch_trials": 4,
            },
        },
        {
            "name": "least",
            "seed": 0,
            **_TEXTURES,
            "questions": [{"name": "age", "least": 18, "most": 99}],
        },
    ),
    load=Study.load,
    write=toml_of,
    beside={},
    again=Study.to_tables,
)
KINDS = [SCENE, RECIPE, RIG, RECORDER, STUDY, *saved_files.KINDS]


def written(kind: Kind, folder: Path, values: dict[str, object] | str) -> Path:
    for name, text in kind.beside.items():
        (folder / name).write_text(text, encoding="utf-8")
    path = folder / kind.name
    text = values if isinstance(values, str) else kind.write(values)
    path.write_text(text, encoding="utf-8")
    return path


def refusal(kind: Kind, folder: Path, values: dict[str, object] | str, *, what: str) -> str:
    """The sentence about a wrong file, which has the form of all."""
    path = written(kind, folder, values)
    try:
        kind.load(path)
    except InputError as error:
        sentence = str(error)
    else:
        raise AssertionError(f"expected a refusal of what is {what}, got none")
    assert str(path) in sentence, what
    assert re.fullmatch(r"[^\n]*expected [^\n]*, got [^\n]*; [^\n]*\.", sentence), (what, sentence)
    return sentence.replace(str(folder), "")


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)
def test_examples_load_and_have_every_declared_key(kind: Kind, tmp_path: Path) -> None:
    for example in kind.examples:
        loaded = kind.load(written(kind, tmp_path, example))
        if kind.again is not None:
            again = kind.load(written(kind, tmp_path, kind.again(loaded)))
            assert again == loaded
    assert {str(place) for place in places(kind)} == set(declared(kind.section))


@pytest.mark.parametrize(
    ("kind", "place"),
    [
        pytest.param(kind, place, id=f"{kind.name} {place}")
        for kind in KINDS
        for place in places(kind)
    ],
)
def test_a_wrong_key_is_refused_by_name(kind: Kind, place: Place, tmp_path: Path) -> None:
    example = kind.examples[place.example]
    for what, values in mutations(place, example):
        sentence = refusal(kind, tmp_path, values, what=what)
        assert re.search(rf"\b{place.key.name}\b", sentence.replace("_misspelt", "")), what
        assert place.where in sentence, (what, sentence)


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)
def test_a_key_that_lacks_a_letter_is_recognised(kind: Kind, tmp_path: Path) -> None:
    """Whatever file it is in; not one of three letters or less."""
    for place in places(kind):
        name = place.key.name
        if len(name) >= 4:
            values = copy.deepcopy(kind.examples[place.example])
            table = place.table(values)
            table[name[:1] + name[2:]] = table.pop(name)
            sentence = refusal(kind, tmp_path, values, what=f"{name} without a letter")
            assert f"mean {name}?" in sentence


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)
def test_a_doubled_key_is_refused(kind: Kind, tmp_path: Path) -> None:
    for example in kind.examples:
        write = tomlkit.dumps if kind.write is toml_of else kind.write  # a key a line
        lines = write(example).splitlines()
        for number, line in enumerate(lines):
            if re.match(r"\s*\"?\w+\"? ?[=:]", line):
                comma = "" if " = " in line or line.endswith(",") else ","
                text = "\n".join([*lines[:number], line + comma, *lines[number:]])
                refusal(kind, tmp_path, text, what=f"doubled: {line}")


def _as_json(value: object) -> object:
    """Values as an editor hands them to a schema: dates are text."""
    return json.loads(json.dumps(value, default=str))


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)
def test_an_editor_finds_what_is_refused(kind: Kind) -> None:
    """The schema holds for the examples, and finds wrong types, ranges and names of keys."""
    validator = jsonschema.Draft202012Validator(schema(kind.section))
    for example in kind.examples:
        validator.validate(_as_json(example))
    for place in places(kind):
        for what, values in mutations(place, kind.examples[place.example]):
            same = _as_json(values) == _as_json(kind.examples[place.example])  # a date in quotes
            if not same and "nan" not in what and "inf" not in what:  # which JSON does not have
                assert not validator.is_valid(_as_json(values)), (str(place), what)
