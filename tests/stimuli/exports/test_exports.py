"""Exports: the C header renders what the program renders, and JSON and WAV tell the same."""

from __future__ import annotations

import json
import re
import subprocess
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.io import wavfile
from scipy.signal import freqz, lfilter

from tactileq.modeling import (
    ARModel,
    InputError,
    Limits,
    RegressedModel,
    Renderer,
    TextureModel,
    compensation_for,
    regressed,
)
from tactileq.modeling.engines import SWITCH
from tactileq.modeling.errors import shown
from tactileq.stimuli.exports.c_header import c_identifier, write_c_header
from tactileq.stimuli.exports.peq_json import write_peq_json
from tactileq.stimuli.exports.wav import write_wav
from tactileq.stimuli.planted.textures import planted_texture
from tactileq.stimuli.planted.vibrators import planted_vibrator
from tactileq.stimuli.sets.recipe import ModelEntry, Recipe, TrajectoryEntry
from tactileq.stimuli.sets.writing import write_set
from tests.refusals import refused

ROOT = Path(__file__).parents[3]
SEED = 7
STRICT = ["-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Werror"]
PRECISIONS = ("double", "float")
RATES_HZ = (5000.0, 48_000.0)

# Renders the texture of this number, in blocks of this size, for a stroke of n speeds and n forces
# on standard input; to standard output: n samples, then the counters in their order.
PROGRAM = """
{includes}
#include <stdio.h>
#include <stdlib.h>
enum {{ LONGEST = 20000, MOST_MEMORY = 2000 }};
static double hand[2 * LONGEST], result[LONGEST + 7];
static tq_real speed[LONGEST], force[LONGEST], out[LONGEST], memory[MOST_MEMORY];
int main(int argc, char **argv)
{{
    const tq_texture *const textures[] = {{ {textures} }};
    const uint64_t keys[] = {{ {keys} }};
    const int reals[] = {{ {memories} }};
    size_t which = argc > 2 ? (size_t)atoi(argv[1]) : 0;
    size_t block = argc > 2 ? (size_t)atoi(argv[2]) : 1;
    size_t count = fread(hand, sizeof(double), 2 * LONGEST, stdin) / 2, done = 0, n;
    tq_state state;
    if (reals[which] > MOST_MEMORY)
        return 1;
    for (n = 0; n < count; n++)
        speed[n] = (tq_real)hand[n], force[n] = (tq_real)hand[count + n];
    tq_start(textures[which], &state, memory, keys[which]);
    for (; done < count; done += block) {{
        size_t next = count - done < block ? count - done : block;
        tq_render(textures[which], &state, speed + done, force + done, out + done, next);
    }}
    for (n = 0; n < count; n++)
        result[n] = (double)out[n];
    result[count] = (double)state.counters.lift_offs;
    result[count + 1] = (double)state.counters.above_grid;
    result[count + 2] = (double)state.counters.below_grid;
    result[count + 3] = (double)state.counters.clamped;
    result[count + 4] = (double)state.counters.peak;
    result[count + 5] = (double)state.counters.rms;
    result[count + 6] = (double)state.counters.duration;
    return fwrite(result, sizeof(double), count + 7, stdout) != count + 7;
}}
"""


def renamed(model: Any, texture: str) -> Any:
    return replace(model, texture=texture)


def regression_beyond_its_bounds() -> RegressedModel:
    """Straight lines by which noise gain and widths fall below 0 at 200 mm/s."""
    model = regressed(planted_texture("canvas"))
    noise_gain = np.array([0.1, -0.0005, 0.0, 0.0])
    bandwidths = np.zeros_like(model.bandwidths_hz)
    bandwidths[:2] = [[50.0], [-0.25]]
    return replace(model, texture="beyond", noise_gain=noise_gain, bandwidths_hz=bandwidths)


MODELS: dict[str, TextureModel | RegressedModel] = {
    "canvas": planted_texture("canvas"),
    "MDF": planted_texture("MDF"),
    "wall paper": planted_texture("wall paper"),
    "no layers": renamed(planted_texture("PVC").with_layers([]), "no layers"),
    '7*/ #error "\\ /*': renamed(planted_texture("leather"), '7*/ #error "\\ /*'),
    "regressed": renamed(regressed(planted_texture("canvas")), "regressed"),
    "centroid": renamed(regressed(planted_texture("MDF"), by="centroid"), "centroid"),
    "beyond": regression_beyond_its_bounds(),
    "compensated": renamed(planted_texture("MDF"), "compensated"),
    "limited": renamed(planted_texture("canvas"), "limited"),
    "limited in RMS": renamed(planted_texture("canvas"), "limited in RMS"),
}
VIBRATOR = planted_vibrator()
LIMITS = {
    "limited": Limits(peak=0.3, duration_s=0.15, pause_s=0.005),
    "limited in RMS": Limits(peak=0.3, rms=0.1, rms_window_s=0.05, duration_s=0.15, pause_s=0.005),
}


def restraints(texture: str, rate_hz: float) -> dict[str, Any]:
    """Limits and compensation with which a model is rendered; on most there are none."""
    if texture not in ("compensated", *LIMITS):
        return {}
    compensation = compensation_for(VIBRATOR, rate_hz=rate_hz)
    return {"compensation": compensation, "limits": LIMITS.get(texture)}


def stroke(rate_hz: float) -> tuple[np.ndarray, np.ndarray]:
    """A third of a second: reversals, out of the grid, steps, lift-off by force, NaN and inf.

    Its numbers are exact in single precision.
    """
    time_s = np.arange(round(0.35 * rate_hz)) / rate_hz
    speed = 420 * np.sin(2 * np.pi * 6 * time_s)
    force = 2 + 2.4 * np.sin(2 * np.pi * 5 * time_s)
    share = time_s / time_s[-1]
    speed[(share > 0.4) & (share < 0.5)] = 180
    force[(share > 0.45) & (share < 0.6)] = 1.25
    speed[(share > 0.7) & (share < 0.72)] = np.nan
    force[(share > 0.8) & (share < 0.81)] = np.inf
    speed[(share > 0.9) & (share < 0.91)] = 1e-310
    return speed.astype(np.float32).astype(float), force.astype(np.float32).astype(float)


def compiled(source: str, folder: Path, arguments: list[str]) -> Path:
    """The program of this C text, compiled beside the headers of `folder`."""
    (folder / "program.c").write_text(source, encoding="utf-8")
    command = ["gcc", "-std=c99", "-O2", "-ffp-contract=off", *arguments]
    command += ["program.c", "-o", "program", "-lm"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return folder / "program"


@dataclass(frozen=True)
class Program:
    """One program with all models in it, at one rate in one precision."""

    path: Path
    rate_hz: float

    def render(self, texture: str, block: int) -> tuple[np.ndarray, list[float]]:
        """The stroke in blocks of this size; the samples and the counters."""
        number = list(MODELS).index(texture)
        speed, force = stroke(self.rate_hz)
        done = subprocess.run(
            [self.path, str(number), str(block)],
            input=speed.tobytes() + force.tobytes(),
            capture_output=True,
            check=True,
        )
        values = np.frombuffer(done.stdout)
        return values[:-7], values[-7:].tolist()


@pytest.fixture(scope="module", params=[(p, r) for p in PRECISIONS for r in RATES_HZ], ids=str)
def program(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> tuple[str, Program]:
    precision, rate_hz = request.param
    folder = tmp_path_factory.mktemp("exported")
    headers = [f"model{number}.h" for number in range(len(MODELS))]
    names = [
        write_c_header(
            folder / header,
            model,
            rate_hz=rate_hz,
            seed=SEED,
            single=precision == "float",
            **restraints(texture, rate_hz),
        )
        for header, (texture, model) in zip(headers, MODELS.items(), strict=True)
    ]
    source = PROGRAM.format(
        includes="\n".join(f'#include "{header}"' for header in [*headers, headers[0]]),
        textures=", ".join(f"&{name}" for name in names),
        keys=", ".join(f"{name}_key" for name in names),
        memories=", ".join(f"{name}_memory" for name in names),
    )
    return precision, Program(compiled(source, folder, STRICT), rate_hz)


@pytest.mark.parametrize("texture", MODELS)
def test_the_header_renders_what_python_renders(
    program: tuple[str, Program], texture: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In double precision bit for bit; in single precision to 1e-5 of the largest sample."""
    precision, exported = program
    speed, force = stroke(exported.rate_hz)
    monkeypatch.setenv(SWITCH, "1")  # in Python alone: nothing of the kernel on this side
    options = restraints(texture, exported.rate_hz)
    renderer = Renderer(MODELS[texture], rate_hz=exported.rate_hz, seed=SEED, **options)
    expected = renderer.render(speed, force)
    samples, counters = exported.render(texture, speed.size)
    assert counters[0] == renderer.counters.lift_offs > 0
    if precision == "double":
        assert np.array_equal(samples, expected)
        assert counters == list(vars(renderer.counters).values())
        assert min(counters[1:3]) > 0
        assert (counters[3] > 0) == (texture == "beyond")
        limited = [texture in LIMITS, texture == "limited in RMS", texture in LIMITS]
        assert [count > 0 for count in counters[4:]] == limited
    elif texture == "limited in RMS":
        # The root of a small difference is not the same sample in single precision, but no louder.
        rounding = 2.4e-7 * 0.05 * exported.rate_hz  # by which the limit's square is set lower
        assert 0.1 * (1 - 1e-5 - rounding) < running_rms(samples, exported.rate_hz).max() <= 0.1
    else:
        error = np.abs(samples - expected).max() / np.abs(expected).max()
        assert 0 < error < 1e-5
    if precision == "float":
        monkeypatch.delenv(SWITCH)
        single = Renderer(
            MODELS[texture], rate_hz=exported.rate_hz, seed=SEED, single=True, **options
        )
        assert np.array_equal(samples, single.render(speed, force))
        assert counters == list(vars(single.counters).values())
    for block in (1, 7, 256):
        assert np.array_equal(exported.render(texture, block)[0], samples)


def running_rms(samples: np.ndarray, rate_hz: float) -> np.ndarray:
    """Weighted by exp(−age/50 ms)."""
    share = -np.expm1(-1 / (0.05 * rate_hz))
    return np.sqrt(lfilter([share], [1, share - 1], samples**2))


def test_the_program_in_the_comment_runs(tmp_path: Path) -> None:
    model = MODELS["wall paper"]
    write_c_header(tmp_path / "it's 1.h", model, seed=3)
    text = (tmp_path / "it's 1.h").read_text(encoding="utf-8")
    example = re.search(r"^ {7}#include <stdio.h>\n.*?^ {7}\}\n", text, re.DOTALL | re.MULTILINE)
    assert example is not None
    program = compiled(example[0], tmp_path, STRICT)
    printed = subprocess.run([program], capture_output=True, text=True, check=True).stdout.split()
    expected = Renderer(model, seed=3).render(50.0, 0.5, samples=500)
    assert np.array(printed, dtype=float) == pytest.approx(expected, rel=1e-8)


def test_a_header_says_what_it_is(tmp_path: Path) -> None:
    write_c_header(tmp_path / "a.h", MODELS["canvas"], rate_hz=48_000.0, seed=3)
    comment = (tmp_path / "a.h").read_text(encoding="utf-8").split("*/")[0]
    for words in ('"canvas", simulated', "48000 Hz, seed 3", "4 layers", "GPL-3.0-or-later"):
        assert words in comment
    assert f"SHA-256 {MODELS['canvas'].sha256}" in comment
    write_c_header(tmp_path / "b.h", replace(planted_texture("canvas"), simulated=False))
    assert "simulated" not in (tmp_path / "b.h").read_text(encoding="utf-8")
    assert "Not compensated for a vibrator. Limits: none." in comment
    write_c_header(tmp_path / "c.h", MODELS["canvas"], **restraints("limited in RMS", 5000.0))
    comment = (tmp_path / "c.h").read_text(encoding="utf-8").split("*/")[0]
    assert "resonance at 80 Hz. Limits: peak 0.3 g, RMS 0.1 g, duration 0.15 s." in comment


def test_a_header_states_its_licence(tmp_path: Path) -> None:
    """That of the kernel in it, which states the same."""
    write_c_header(tmp_path / "c.h", MODELS["canvas"])
    first, kernel, *_ = (tmp_path / "c.h").read_text(encoding="utf-8").split("*/")
    licence, holder = "SPDX-License-Identifier: GPL-3.0-or-later", "the tactileq authors"
    assert first.startswith(f"/* {licence}\n   Copyright (C) 2026 {holder}\n")
    words = " ".join(first.split())
    assert "a program that includes this header" in words
    assert "The numbers of the texture are data of those whose model it is" in words
    assert licence in kernel
    assert f"Copyright (C) 2026 {holder}." in kernel
    assert 'license = "GPL-3.0-or-later"' in (ROOT / "pyproject.toml").read_text()


def test_two_exports_of_one_name_are_not_confused(tmp_path: Path) -> None:
    """The compiler refuses a second, different one, instead of leaving it out in silence."""
    for header, seed in (("a.h", 1), ("b.h", 2)):
        write_c_header(tmp_path / header, MODELS["canvas"], seed=seed)
    both = '#include "a.h"\n#include "b.h"\nint main(void) { return 0; }\n'
    with pytest.raises(AssertionError, match="redefinition of .texture_canvas"):
        compiled(both, tmp_path, [])


def test_two_headers_of_one_texture_have_names_of_their_own(tmp_path: Path) -> None:
    """As the full and the simplified model."""
    full = MODELS["canvas"]
    assert write_c_header(tmp_path / "a.h", full) == "texture_canvas"
    fewer = full.with_layers([0])
    assert write_c_header(tmp_path / "b.h", fewer, name="canvas, few") == "texture_canvas__few"
    both = (
        '#include "a.h"\n#include "b.h"\n'
        "int main(void) { return texture_canvas.layers == texture_canvas__few.layers; }\n"
    )
    assert subprocess.run([compiled(both, tmp_path, [])], check=False).returncode == 0
    for name in ("", "  ", "two\nlines"):
        with refused(InputError, expected="name", got=shown(name)):
            write_c_header(tmp_path / "c.h", full, name=name)


def test_a_header_says_where_its_grid_comes_from(tmp_path: Path) -> None:
    full = MODELS["canvas"]
    write_c_header(tmp_path / "a.h", full)
    comment = (tmp_path / "a.h").read_text(encoding="utf-8").split("*/")[0]
    stored = full.table.speeds_mm_s.size, full.table.forces_n.size
    assert stored != (full.speeds_mm_s.size, full.forces_n.size)
    assert f"stored at {stored[0]} x {stored[1]} places" in comment
    assert f"at {full.speeds_mm_s.size} x {full.forces_n.size} conditions" in comment
    linear = replace(full, blending="linear")
    write_c_header(tmp_path / "b.h", linear)
    assert "stored at" not in (tmp_path / "b.h").read_text(encoding="utf-8").split("*/")[0]


@given(st.text())
def test_any_texture_has_an_identifier(texture: str) -> None:
    assert re.fullmatch("texture_[A-Za-z0-9_]*", c_identifier(texture))


def autoregressive() -> ARModel:
    return ARModel(
        texture="oak",
        rate_hz=5000.0,
        speeds_mm_s=[100.0, 200.0],
        forces_n=[1.0, 2.0],
        line_spectral_frequencies=np.full((2, 2, 2), [1.0, 2.0]),
        gains=np.ones((2, 2)),
        level_sd_db=np.zeros((2, 2)),
    )


def loud(factor: float) -> TextureModel:
    model = planted_texture("canvas")
    return replace(model, gains=model.gains * factor)


CANVAS = planted_texture("canvas")
CLOSE = planted_texture("PVC", speeds_mm_s=np.array([100.0, 100.0 + 1e-9]))
RESAMPLED = {"rate_hz": 48_000.0, "compensation": compensation_for(VIBRATOR, rate_hz=5000.0)}
C_REFUSED = [
    (autoregressive(), {}, "layers", ["autoregressive", "oak"]),
    (CANVAS, {"rate_hz": 4000.0}, "5000 Hz", 4000),
    (CANVAS, {"rate_hz": np.nan}, "5000 Hz", "nan"),
    (CANVAS, {"rate_hz": 1e12}, "768000 Hz", "1e+12"),
    (CANVAS, {"rate_hz": np.inf}, "768000 Hz", "inf"),
    (CANVAS, RESAMPLED, ["compensation", "48000 Hz"], "5000 Hz"),
    (CANVAS, {"seed": -1}, "seed", -1),
    (CANVAS, {"limits": Limits(rms=1e-30), "single": True}, "single", "mean_square"),
    (loud(1e40), {"single": True}, "single", "values"),
    (CLOSE, {"single": True}, "single", "speed_mm_s"),
    (loud(1e38), {"single": True}, ["gains", "3e+36 g", "single"], "1.77e+38 g"),
    (
        loud(1e18),
        {"limits": Limits(rms=1.0), "single": True},
        ["gains", "2e+17 g", "single"],
        "1.77e+18 g",
    ),
    (loud(1e307), {}, ["gains", "2e+306 g", "double"], "1.77e+307 g"),
]
GRID = ["canvas", "0…350 mm/s", "0…3.5 N"]
JSON_REFUSED = [
    (autoregressive(), {}, "layers", ["autoregressive", "oak"]),
    (CANVAS, {"speed_mm_s": 1.0}, ["speed", "force"], ["1.0 mm/s", "None N"]),
    (CANVAS, {"speed_mm_s": 351.0, "force_n": 1.0}, GRID, ["351 mm/s", "1 N"]),
    (CANVAS, {"speed_mm_s": 1.0, "force_n": -1.0}, GRID, ["1 mm/s", "-1 N"]),
    (CANVAS, {"speed_mm_s": np.nan, "force_n": 1.0}, GRID, ["nan mm/s", "1 N"]),
]


@pytest.mark.parametrize(("model", "options", "expected", "got"), C_REFUSED)
def test_what_has_no_header_is_refused(
    tmp_path: Path, model: Any, options: dict[str, Any], expected: object, got: object
) -> None:
    with refused(InputError, expected=expected, got=got):
        write_c_header(tmp_path / "a.h", model, **options)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(("model", "options", "expected", "got"), JSON_REFUSED)
def test_what_has_no_json_is_refused(
    tmp_path: Path, model: Any, options: dict[str, Any], expected: object, got: object
) -> None:
    with refused(InputError, expected=expected, got=got):
        write_peq_json(tmp_path / "a.json", model, **options)
    assert not list(tmp_path.iterdir())


def response(condition: Mapping[str, Any], frequency_hz: np.ndarray, rate_hz: float) -> np.ndarray:
    """What another program makes of an exported condition."""
    total = np.full(frequency_hz.size, condition["noise_gain"], dtype=complex)
    for layer in condition["layers"]:
        total += layer["gain"] * freqz(layer["b"], layer["a"], frequency_hz, fs=rate_hz)[1]
    return total


@pytest.mark.parametrize("texture", ["canvas", "MDF", "no layers", "regressed", "beyond"])
def test_json_holds_every_condition_of_the_grid(tmp_path: Path, texture: str) -> None:
    model, frequency_hz = MODELS[texture], np.linspace(0, 2500, 400)
    count = write_peq_json(tmp_path / "a.json", model)
    exported = json.loads((tmp_path / "a.json").read_text(encoding="utf-8"))
    assert count == len(exported["conditions"])
    grid = [(v, f) for v in model.speeds_mm_s for f in model.forces_n]
    assert [(c["speed_mm_s"], c["force_n"]) for c in exported["conditions"]] == grid
    assert exported["rate_hz"] == 5000.0
    assert exported["model_sha256"] == model.sha256
    assert (exported["texture"], exported["unit"], exported["simulated"]) == (texture, "g", True)
    for condition in exported["conditions"]:
        peq = model.peq(condition["speed_mm_s"], condition["force_n"])
        found = response(condition, frequency_hz, exported["rate_hz"])
        assert found == pytest.approx(peq.complex_response(frequency_hz), rel=1e-9, abs=1e-9)
        for name, values in (("frequency_hz", peq.frequencies_hz), ("gain", peq.gains)):
            assert [layer[name] for layer in condition["layers"]] == values.tolist()


def test_json_of_one_condition_is_interpolated(tmp_path: Path) -> None:
    def exported(model: TextureModel) -> Any:
        at = {"speed_mm_s": float(np.sqrt(50.0 * 100.0)), "force_n": 0.25}
        assert write_peq_json(tmp_path / "a.json", model, **at) == 1
        (condition,) = json.loads((tmp_path / "a.json").read_text(encoding="utf-8"))["conditions"]
        return condition

    # Between two speeds, and half of the level below the lowest force.
    share = np.sqrt(2) - 1
    linear = exported(replace(CANVAS, blending="linear"))
    low, high = CANVAS.gains[:2, 0]
    expected = ((1 - share) * low + share * high) / 2
    assert [layer["gain"] for layer in linear["layers"]] == pytest.approx(expected)
    low, high = CANVAS.frequencies_hz[:2, 0]
    expected = (1 - share) * low + share * high
    assert [layer["frequency_hz"] for layer in linear["layers"]] == pytest.approx(expected)
    # In logarithms the geometric mean, to what the finer table leaves of it
    # (docs/method/rendering.md#parameter-table).
    near = {"rel": 10 ** (0.13 / 20) - 1}
    logarithmic = exported(CANVAS)
    expected = np.sign(CANVAS.gains[0, 0]) * np.sqrt(np.prod(CANVAS.gains[:2, 0], axis=0)) / 2
    assert [layer["gain"] for layer in logarithmic["layers"]] == pytest.approx(expected, **near)
    expected = np.sqrt(low * high)
    found = [layer["frequency_hz"] for layer in logarithmic["layers"]]
    assert found == pytest.approx(expected, **near)


def recipe(model: Path, **changes: Any) -> Recipe:
    entry = TrajectoryEntry.constant(150.0, 1.0)
    options = {"rates_hz": (48_000,), "seeds": (4,), "duration_s": 0.5, **changes}
    return Recipe(name="x", models=(ModelEntry(model, "m"),), trajectories=(entry,), **options)


@pytest.mark.parametrize("compensated", [False, True])
def test_a_wav_is_that_of_a_stimulus_set(tmp_path: Path, compensated: bool) -> None:
    CANVAS.save(tmp_path / "canvas.json")
    VIBRATOR.save(tmp_path / "pen.json")
    made = recipe(tmp_path / "canvas.json", vibrator=tmp_path / "pen.json" if compensated else None)
    told = write_wav(tmp_path / "a.wav", made)
    (stimulus,) = write_set(tmp_path / "set", made)
    assert told == stimulus
    assert (tmp_path / "a.wav").read_bytes() == (tmp_path / "set" / stimulus.file).read_bytes()
    rate_hz, samples = wavfile.read(tmp_path / "a.wav")
    assert (rate_hz, samples.dtype, samples.size) == (48_000, np.float32, 24_000)
    assert told.peak == pytest.approx(np.abs(samples).max(), rel=1e-6)
    steady = samples[480:-480].astype(float)  # the fades take 10 ms
    level_db = 10 * np.log10(np.mean(steady**2))
    if compensated:  # the level is that at the hand, the file weaker by the resonance
        assert told.level_db > level_db + 0.5
    else:
        assert told.level_db == pytest.approx(level_db, abs=1e-4)


def test_a_recipe_of_several_stimuli_is_no_wav(tmp_path: Path) -> None:
    CANVAS.save(tmp_path / "canvas.json")
    with refused(InputError, expected=["recipe", "one"], got=2):
        write_wav(tmp_path / "a.wav", recipe(tmp_path / "canvas.json", seeds=(1, 2)))
    with refused(InputError, expected=["5000 Hz", "canvas"], got="4000 Hz"):
        write_wav(tmp_path / "a.wav", recipe(tmp_path / "canvas.json", rates_hz=(4000,)))
    assert [path.name for path in tmp_path.iterdir()] == ["canvas.json"]


def test_samples_that_a_wav_cannot_hold_are_refused(tmp_path: Path) -> None:
    loud(1e40).save(tmp_path / "canvas.json")
    made = recipe(tmp_path / "canvas.json")
    with refused(
        InputError, expected=["3.4e+38", "canvas_m_150mms_1N.wav", "float32"], got="3.5e+38"
    ):
        write_wav(tmp_path / "a.wav", made)
    with refused(
        InputError, expected=["3.4e+38", "canvas_m_150mms_1N.wav", "float32"], got="3.5e+38"
    ):
        write_set(tmp_path / "set", made)
    assert [path.name for path in tmp_path.iterdir()] == ["canvas.json"]
    loud(1e36).save(tmp_path / "canvas.json")
    write_wav(tmp_path / "a.wav", recipe(tmp_path / "canvas.json"))
    assert np.isfinite(wavfile.read(tmp_path / "a.wav")[1]).all()
