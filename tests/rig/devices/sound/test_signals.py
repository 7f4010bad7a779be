"""Prepared signals: tone bursts in closed form, files of a stimulus set by name and by hash."""

from __future__ import annotations

import hashlib
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import soundfile
from hypothesis import given
from hypothesis import strategies as st

from tactileq.modeling import InputError, TextureModel, Threshold, simplify
from tactileq.modeling.errors import shown
from tactileq.modeling.files.stimulus_table import STIMULUS_COLUMNS
from tactileq.modeling.files.tables import read_table
from tactileq.modeling.rendering.limits import Limits
from tactileq.modeling.rendering.plan import RenderPlan, plan_for
from tactileq.modeling.vibrators.compensation import compensation_for
from tactileq.rig.devices.sound.output import SoundOutput
from tactileq.rig.devices.sound.signal_limits import check_signal, largest_factor
from tactileq.rig.devices.sound.signals import stimuli_of_surfaces, stimulus, tone_burst
from tactileq.rig.devices.sound.supervision import SoundLost
from tactileq.rig.shared.live.memory import Live
from tactileq.stimuli.planted.textures import planted_texture
from tactileq.stimuli.planted.vibrators import planted_vibrator
from tactileq.stimuli.sets.recipe import Recipe
from tactileq.stimuli.sets.writing import write_set
from tests.refusals import refused

RATE_HZ = 48000.0
VIBRATOR = planted_vibrator()


RECIPE = """
version = 1
[set]
name = "few"
rate_hz = [48000]
format = "{kind}"
duration_s = 0.5
{vibrator}
[level]
{level}
[[model]]
path = "canvas.json"
label = "full"
[[trajectory]]
speed_mm_s = 100
force_n = 1.0
"""


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Sets of one texture: as floats, in 24 bits, and compensated for a vibrator."""
    folder = tmp_path_factory.mktemp("sets")
    planted_texture("canvas").save(folder / "canvas.json")
    VIBRATOR.save(folder / "vibrator.json")
    for name, kind, vibrator in (
        ("float32", "float32", ""),
        ("pcm24", "pcm24", ""),
        ("driven", "float32", 'vibrator = "vibrator.json"'),
    ):
        level = "full_scale_g = 20.0" if kind == "pcm24" else ""
        text = RECIPE.format(kind=kind, level=level, vibrator=vibrator)
        (folder / f"{name}.toml").write_text(text)
        write_set(folder / name, Recipe.load(folder / f"{name}.toml"))
    return folder


SURFACES = """
version = 1
[set]
name = "surfaces"
rate_hz = [{rates}]
format = "float32"
seeds = [{seeds}]
duration_s = 0.2
[[model]]
path = "full"
label = "full"
{more}
[[trajectory]]
speed_mm_s = 100
force_n = 1.0
"""
SIMPLIFIED = '[[model]]\npath = "simplified"\nlabel = "simplified"'


@pytest.fixture(scope="module")
def surfaces(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Sets of two textures: of both models (MDF keeps every layer), of one, of several files."""
    folder = tmp_path_factory.mktemp("surfaces")
    for texture in ("canvas", "MDF"):
        full = planted_texture(texture)
        few = (
            simplify(full, Threshold.shipped("codec"), criterion="paper-fft").model
            if texture == "canvas"
            else full
        )
        for name, model in (("full", full), ("simplified", few)):
            (folder / name).mkdir(exist_ok=True)
            model.save(folder / name / f"{texture}.json")
    for name, rates, seeds, more in (
        ("both", "48000", "1", SIMPLIFIED),
        ("one", "48000", "1", ""),
        ("seeds", "48000", "1, 2", ""),
        ("rates", "48000, 44100", "1", ""),
    ):
        recipe = folder / f"{name}.toml"
        recipe.write_text(SURFACES.format(rates=rates, seeds=seeds, more=more))
        write_set(folder / name, Recipe.load(recipe))
    return folder


def test_files_that_stand_for_surfaces_are_found_by_their_label(surfaces: Path) -> None:
    both = surfaces / "both"
    full = stimuli_of_surfaces(both, label="full", textures=["canvas", "MDF", "PVC"])
    few = stimuli_of_surfaces(both, label="simplified", textures=["canvas", "MDF"])
    assert set(full) == {"canvas", "MDF"}
    samples, _ = soundfile.read(both / "canvas_full_100mms_1N.wav")
    np.testing.assert_array_equal(full["canvas"].samples_g, samples)
    assert full["canvas"].duration_s == pytest.approx(0.2)
    model = TextureModel.load(surfaces / "full" / "canvas.json")
    assert full["canvas"].model_sha256 == model.sha256
    assert full["canvas"].made_from == frozenset()
    assert few["canvas"].made_from == {model.sha256}
    assert (
        few["canvas"].sha256
        == hashlib.sha256((both / "canvas_simplified_100mms_1N.wav").read_bytes()).hexdigest()
    )


def test_stimuli_are_equal_where_one_model_was_rendered_alike(surfaces: Path) -> None:
    both = surfaces / "both"
    full = stimuli_of_surfaces(both, label="full", textures=["canvas", "MDF"])
    few = stimuli_of_surfaces(both, label="simplified", textures=["canvas", "MDF"])
    again = stimuli_of_surfaces(surfaces / "one", label="whatever", textures=["canvas"])
    assert few["MDF"] == full["MDF"]  # one model, other noise
    assert few["MDF"].sha256 != full["MDF"].sha256
    assert len({few["MDF"], full["MDF"]}) == 1
    assert few["canvas"] != full["canvas"]
    assert again["canvas"] == full["canvas"]
    assert full["canvas"] != "canvas"


@pytest.mark.parametrize(
    ("name", "label", "expected", "got"),
    [
        ("both", "paper", "'paper'", ["full", "simplified"]),
        ("seeds", "full", "canvas", [2, "canvas_full_100mms_1N_seed2.wav"]),
        ("rates", "full", "canvas", [2, "canvas_full_100mms_1N_44100Hz.wav"]),
    ],
)
def test_sets_that_do_not_say_which_file_are_refused(
    surfaces: Path, name: str, label: str, expected: object, got: object
) -> None:
    with refused(InputError, names=surfaces / name, expected=expected, got=got):
        stimuli_of_surfaces(surfaces / name, label=label, textures=["canvas"])


def test_a_stimulus_without_its_source_was_made_from_nothing_known(
    surfaces: Path, tmp_path: Path
) -> None:
    shutil.copytree(surfaces / "both", tmp_path / "set")
    shutil.rmtree(tmp_path / "set" / "sources")
    few = stimuli_of_surfaces(tmp_path / "set", label="simplified", textures=["canvas"])
    assert few["canvas"].made_from == frozenset()


def row_of(folder: Path) -> dict[str, Any]:
    (row,) = read_table(folder / "manifest.tsv", STIMULUS_COLUMNS)
    return row


def test_a_burst_is_a_sinusoid_between_its_ramps() -> None:
    made = tone_burst(250, 0.5, duration_s=0.2, rate_hz=RATE_HZ)
    assert made.samples_g.shape == (9600,)
    assert (made.rate_hz, made.vibrator_sha256, made.simulated) == (RATE_HZ, None, False)
    middle = made.samples_g[960:-960]
    n = np.arange(960, 9600 - 960)
    np.testing.assert_allclose(middle, 0.5 * np.sin(2 * np.pi * 250 / RATE_HZ * n), atol=1e-12)
    assert middle.std() == pytest.approx(0.5 / np.sqrt(2), rel=1e-6)
    assert made.samples_g[0] == 0
    assert abs(made.samples_g[-1]) < 1e-4
    # A crest and a trough, as far before as after the middle of the ramp: 0.5 (r + (1 - r)).
    assert made.samples_g[432] - made.samples_g[528] == pytest.approx(0.5, rel=1e-9)
    assert made.samples_g[432] == pytest.approx(0.5 * (0.5 - 0.5 * np.cos(0.45 * np.pi)))


def test_a_very_short_burst_is_ramps_only() -> None:
    made = tone_burst(1000, 1.0, duration_s=0.01, rate_hz=RATE_HZ)
    assert made.samples_g.size == 480
    assert np.abs(made.samples_g).max() < 1
    assert abs(made.samples_g[-1]) < 1e-3


@pytest.mark.parametrize(
    ("numbers", "expected", "got"),
    [
        ((0, 1, 1), ["frequency", 0, "48000 Hz"], 0),
        ((24000, 1, 1), ["frequency", 0, "48000 Hz"], 24000),
        ((np.nan, 1, 1), "frequency", "nan"),
        ((250, -1, 1), ["amplitude", "0 g"], -1),
        ((250, np.inf, 1), "amplitude", "inf"),
        ((250, 1, 0), "60 s", "0 s"),
        ((250, 1, 61), "60 s", "61 s"),
    ],
)
def test_bursts_out_of_range_are_refused(
    numbers: tuple[float, ...], expected: object, got: object
) -> None:
    frequency_hz, amplitude_g, duration_s = numbers
    with refused(InputError, expected=expected, got=got):
        tone_burst(frequency_hz, amplitude_g, duration_s=duration_s, rate_hz=RATE_HZ)


def test_a_stimulus_is_found_by_name_and_by_hash(made: Path) -> None:
    row = row_of(made / "float32")
    by_name = stimulus(made / "float32", row["file"])
    samples, rate_hz = soundfile.read(made / "float32" / row["file"])
    np.testing.assert_array_equal(by_name.samples_g, samples)
    assert by_name.rate_hz == rate_hz == RATE_HZ
    assert by_name.simulated
    assert by_name.vibrator_sha256 is None
    for digits in (row["sha256"], row["sha256"][:8]):
        found = stimulus(made / "float32", digits)
        np.testing.assert_array_equal(found.samples_g, by_name.samples_g)


def test_24_bits_are_read_in_g(made: Path) -> None:
    floats = stimulus(made / "float32", row_of(made / "float32")["file"])
    row = row_of(made / "pcm24")
    bits = stimulus(made / "pcm24", row["file"])
    np.testing.assert_allclose(bits.samples_g, floats.samples_g, atol=20.0 * 2**-23)
    assert np.abs(bits.samples_g).max() == pytest.approx(float(row["peak"]), abs=1e-5)


def test_a_drive_names_its_vibrator(made: Path) -> None:
    found = stimulus(made / "driven", row_of(made / "driven")["file"])
    content = (made / "vibrator.json").read_bytes()
    assert found.vibrator_sha256 == hashlib.sha256(content).hexdigest()


@pytest.mark.parametrize("which", ["another.wav", "0" * 64, "abc", ""])
def test_an_unknown_stimulus_is_refused(made: Path, which: str) -> None:
    with refused(
        InputError, expected=["SHA-256", made / "float32"], got=[shown(which), 0, "manifest.tsv"]
    ):
        stimulus(made / "float32", which)


def test_a_stimulus_that_has_changed_is_refused(made: Path, tmp_path: Path) -> None:
    shutil.copytree(made / "float32", tmp_path / "set")
    path = tmp_path / "set" / row_of(tmp_path / "set")["file"]
    data = bytearray(path.read_bytes())
    data[-1] ^= 1
    path.write_bytes(data)
    with refused(InputError, expected=["SHA-256", path], got=hashlib.sha256(data).hexdigest()[:8]):
        stimulus(tmp_path / "set", path.name)


def test_a_stimulus_without_a_calibrated_unit_is_refused(made: Path, tmp_path: Path) -> None:
    shutil.copytree(made / "float32", tmp_path / "set")
    manifest = tmp_path / "set" / "manifest.tsv"
    manifest.write_text(manifest.read_text().replace("\tg\t", "\tarbitrary\t"))
    with refused(InputError, expected="g", got=[row_of(tmp_path / "set")["file"], "'arbitrary'"]):
        stimulus(tmp_path / "set", row_of(tmp_path / "set")["file"])


def test_what_is_not_compensated_yet_is_compensated_before_the_limits() -> None:
    compensation = compensation_for(VIBRATOR, rate_hz=RATE_HZ)
    burst = tone_burst(VIBRATOR.frequency_hz, 1.0, duration_s=0.5, rate_hz=RATE_HZ)
    drive = np.abs(compensation.apply(burst.samples_g)).max()
    assert drive < 0.5  # at the resonance little drive is needed
    limits = Limits(peak=0.6)
    with Live.create() as live:
        sound = SoundOutput(
            live,
            device="none of this name",
            rate_hz=RATE_HZ,
            block=128,
            fullscale_per_g=0.1,
            limits=limits,
            compensation=compensation,
        )
        with refused(InputError, expected="0.6 g", got="1 g"):
            sound.play_signal(burst.samples_g, compensated=True)
        # Accepted as a signal: what is refused next is the device, which does not exist.
        with refused(SoundLost, expected="sound device", got="none"):
            sound.play_signal(burst.samples_g)


def plan_of(limits: Limits) -> RenderPlan:
    return plan_for(RATE_HZ, rate_hz=RATE_HZ, update_s=1e-3, limits=limits, compensation=None)


def test_the_largest_factor_in_closed_form() -> None:
    burst = tone_burst(100, 0.5, duration_s=0.5, rate_hz=RATE_HZ).samples_g
    assert largest_factor(burst, plan_of(Limits(peak=2.0))) == pytest.approx(4.0)
    assert largest_factor(burst, plan_of(Limits())) == np.inf
    assert largest_factor(np.zeros(10), plan_of(Limits(peak=2.0, rms=0.1))) == np.inf
    # After an RMS at its limit a constant signal may be as strong as the limit, no stronger.
    constant = np.full(1000, 0.25)
    assert largest_factor(constant, plan_of(Limits(peak=2.0, rms=1.0))) == pytest.approx(4.0)


@given(
    frequency_hz=st.floats(20.0, 1000.0),
    duration_s=st.floats(0.05, 1.0),
    peak=st.floats(0.1, 10.0),
    rms=st.floats(0.05, 10.0),
    window_s=st.floats(0.05, 2.0),
)
def test_a_signal_is_accepted_up_to_the_largest_factor_and_no_further(
    frequency_hz: float, duration_s: float, peak: float, rms: float, window_s: float
) -> None:
    plan = plan_of(Limits(peak=peak, rms=rms, rms_window_s=window_s))
    burst = tone_burst(frequency_hz, 1.0, duration_s=duration_s, rate_hz=RATE_HZ).samples_g
    factor = largest_factor(burst, plan)
    check_signal(burst * factor * (1 - 1e-9), plan)
    with pytest.raises(InputError) as caught:
        check_signal(burst * factor * 1.001, plan)
    assert any(f" {limit:g} g" in str(caught.value) for limit in (peak, rms))
