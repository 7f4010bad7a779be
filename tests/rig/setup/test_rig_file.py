import json
import re
import tomllib
from dataclasses import fields
from datetime import date
from pathlib import Path

import numpy as np
import pytest

from modeling import InputError
from modeling.vibrators.vibrator import Vibrator
from rig.setup.rig_file import _SECTIONS, SHIPPED_RIG_FILE, Curve, Figure, RigFile

ROOT = Path(__file__).parents[3]
TABLET = SHIPPED_RIG_FILE.read_text(encoding="utf-8")


def written(tmp_path, text):
    path = tmp_path / "rig.toml"
    path.write_text(text, encoding="utf-8")
    return path


def changed(tmp_path, old, new):
    """The shipped rig file with one change."""
    assert old in TABLET
    return written(tmp_path, TABLET.replace(old, new, 1))


def test_the_shipped_file_states_a_tablet_of_which_every_quantity_is_assumed():
    rig = RigFile.load(SHIPPED_RIG_FILE)
    assert rig.hand.kind == "tablet"
    assert rig.hand.measures_force
    assert rig.calibration is None
    assert rig.latency is None
    assert rig.accelerometer is None
    assert not rig.simulated
    assert [name for name, _ in rig.assumed()] == list(rig.figures())
    assert "sound.fullscale_v" in rig.figures()


def test_every_section_that_the_shipped_file_only_suggests_is_one_that_is_read(tmp_path):
    lines = []
    for line in TABLET.splitlines():
        bare = line.removeprefix("# ")
        try:
            tomllib.loads(bare)
        except tomllib.TOMLDecodeError:
            bare = line
        lines.append(bare if line.startswith("# ") else line)
    text = "\n".join(lines).replace('file = "vibrator.json"', "")
    rig = RigFile.load(written(tmp_path, text))
    assert rig.calibration is not None
    assert rig.accelerometer is not None
    assert rig.latency is not None
    given = tomllib.loads(text)
    for name, kind in _SECTIONS.items():
        missing = {key.name for key in fields(kind)} - set(given[name])
        assert missing <= {"file"}, name  # every key stands in the shipped file


def test_what_goes_out_for_one_g_follows_from_volts_of_full_scale_and_g_per_volt(tmp_path):
    path = changed(tmp_path, "g_per_volt = { value = 1.0", "g_per_volt = { value = 2.5")
    path = written(
        tmp_path,
        path.read_text().replace("fullscale_v = { value = 4.0", "fullscale_v = { value = 8.0"),
    )
    assert RigFile.load(path).fullscale_per_g == pytest.approx(0.05)


def test_limits_are_those_of_the_file(tmp_path):
    path = changed(tmp_path, "peak_g = { value = 3.0", "peak_g = { value = 1.5")
    limits = RigFile.load(path).safe_limits
    assert (limits.peak, limits.rms, limits.duration_s) == (1.5, 1.0, 60.0)


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("version = 1", "version = 2", "expected version = 1"),
        ("block = 128", "blocks = 128", "in [sound], got blocks"),
        ("[limits] ", "[limit] ", "in a rig file, got limit;"),
        ("rate_hz = 48000", "", "expected rate_hz under [sound], got none"),
        ("rate_hz = 48000", "rate_hz = -1", "sound.rate_hz from 1 to 10000000 Hz, got -1"),
        ("block = 128", "block = 1.5", "for sound.block, got 1.5"),
        ("vibration_channel = 1", "vibration_channel = 3", "sound.vibration_channel among the 2"),
        ("masking_channel = 2", "masking_channel = 1", "another channel than the vibration"),
        ("masking_level = 0.0", "masking_level = 2", "0 to 0.5 for sound.masking_level"),
        ('unit = "g/V"', 'unit = "m/s²/V"', 'expected the unit "g/V" for vibrator.g_per_volt'),
        ("peak_g = { value = 3.0", "peak_g = { value = 0", "1e-06 to 20 g for limits.peak_g"),
        ("peak_g = { value = 3.0", "peak_g = { value = nan", "20 g for limits.peak_g, got nan"),
        ("peak_g = { value = 3.0", "peak_g = { wert = 3.0", "for limits.peak_g, got"),
        ("peak_g = {", "peak_g = 3.0 #", "for limits.peak_g, got 3.0; write { value = 1.0"),
        (
            'assumed = true, source = "a guess: volt',
            'assumed = 1, source = "a',
            "sound.fullscale_v",
        ),
        ('kind = "tablet" ', 'kind = "glove"', 'hand.kind to be "tablet" or "mouse"'),
        ('kind = "tablet" ', 'kind = "mouse"', "hand.counts_per_mm (counts/mm) of a mouse"),
        ("[[0.0, 0.0], [1.0, 4.0]]", "[[0.0, 0.0], [1.0, -4.0]]", "for hand.pressure_curve"),
        ("[[0.0, 0.0], [1.0, 4.0]]", "[[0.0, 0.0]]", "two points [pressure, N]"),
        ('# file = "vibrator.json"', 'file = "vibrator.json"', "vibrator.json, got nothing there"),
        ("hand_measured = false", 'hand_measured = "no"', "for real_surface.hand_measured"),
        ("# measured_on = 2026-11-22", 'measured_on = "today"', "a date for vibrator.measured_on"),
        ("serials = [] ", "serials = [1]", "as rig.serials, got 1"),
    ],
)
def test_what_is_not_understood_is_refused_in_one_sentence_with_its_key(tmp_path, old, new, told):
    path = changed(tmp_path, old, new)
    with pytest.raises(InputError) as refused:
        RigFile.load(path)
    message = str(refused.value)
    assert told in message
    assert message.startswith(f"{path}: expected") or "vibrator.json" in message
    assert "\n" not in message


def test_the_force_of_a_mouse_cannot_pass_for_a_measured_one(tmp_path):
    assumed = '{ value = 1.0, unit = "N", assumed = ASSUMED, source = "" }'
    mouse = (
        'kind = "mouse"\nassumed_force_n = ' + assumed + "\n"
        'counts_per_mm = { value = 40.0, unit = "counts/mm", assumed = true, source = "" }\n#'
    )
    told = changed(tmp_path, 'kind = "tablet"', mouse.replace("ASSUMED", "false"))
    with pytest.raises(InputError, match=r"assumed = true for hand\.assumed_force_n"):
        RigFile.load(told)
    rig = RigFile.load(changed(tmp_path, 'kind = "tablet"', mouse.replace("ASSUMED", "true")))
    assert not rig.hand.measures_force


def test_a_scripted_hand_and_a_card_that_is_none_make_the_rig_a_simulated_one(tmp_path):
    assert RigFile.load(changed(tmp_path, 'kind = "tablet"', 'kind = "scripted"')).simulated
    assert RigFile.load(changed(tmp_path, "simulated = false", "simulated = true")).simulated


def test_the_hash_follows_the_values_and_the_vibrator_but_no_comment(tmp_path):
    first = RigFile.load(SHIPPED_RIG_FILE).sha256
    assert RigFile.load(written(tmp_path, TABLET + "# a comment\n")).sha256 == first
    assert RigFile.load(changed(tmp_path, "block = 128", "block = 256")).sha256 != first
    named = changed(tmp_path, '# file = "vibrator.json"', 'file = "vibrator.json"')
    hashes = set()
    for height in (2.0, 3.0):
        vibrator(height).save(tmp_path / "vibrator.json")
        rig = RigFile.load(named)
        assert rig.identified == vibrator(height)
        hashes.add(rig.sha256)
    assert len(hashes | {first}) == 3


def vibrator(height):
    curve = np.array([50.0, 100.0])
    return Vibrator(
        rate_hz=48000,
        frequency_hz=80,
        bandwidth_hz=20,
        height=height,
        flat_gain=1.0,
        coherence=0.9,
        lowest_hz=10,
        highest_hz=1000,
        curve_hz=curve,
        curve_response=curve,
        curve_coherence=curve,
    )


def test_its_values_are_plain_and_complete():
    rig = RigFile.load(SHIPPED_RIG_FILE)
    values = json.loads(json.dumps(rig.to_dict()))
    assert values["limits"]["peak_g"] == {
        "value": 3.0,
        "unit": "g",
        "assumed": True,
        "source": "default of tactileq",
    }
    assert values["hand"]["baud"] == 115200  # a default, written out


def test_an_update_replaces_its_keys_and_leaves_the_rest_of_the_file_with_its_comments(tmp_path):
    path = written(tmp_path, TABLET)
    measured = Figure(2.25, "g/V", False, 'accelerometer "at" the pen # 3')
    curve = Curve(((0.0, 0.0), (0.5, 1.25)), "N", False, "weights")
    rig = RigFile.updated(
        path,
        {
            "vibrator.g_per_volt": measured,
            "vibrator.measured_on": date(2026, 11, 22),
            "hand.pressure_curve": curve,
            "sound.block": 256,
            "calibration.date": date(2026, 11, 22),
            "calibration.rig": "desk rig",
            "calibration.serials": ("A1", "B2"),
        },
    )
    assert rig == RigFile.load(path)
    assert rig.vibrator.g_per_volt == measured
    assert rig.vibrator.measured_on == date(2026, 11, 22)
    assert rig.hand.pressure_curve == curve
    assert rig.calibration is not None
    assert rig.calibration.serials == ("A1", "B2")
    assert "vibrator.g_per_volt" not in dict(rig.assumed())
    before, after = TABLET.splitlines(), path.read_text(encoding="utf-8").splitlines()
    assert "block = 256  # samples per block of the card" in "\n".join(after)
    replaced = ("g_per_volt", "pressure_curve", "block =")
    kept = [line for line in before if not line.startswith(replaced)]
    assert [line for line in kept if line not in after] == []


def test_an_update_that_would_spoil_the_file_changes_nothing(tmp_path):
    path = written(tmp_path, TABLET)
    with pytest.raises(InputError, match=r'expected the unit "g/V"'):
        RigFile.updated(path, {"vibrator.g_per_volt": Figure(1.0, "V", False, "")})
    with pytest.raises(InputError, match="got gain"):
        RigFile.updated(path, {"vibrator.gain": 1.0})
    assert path.read_text(encoding="utf-8") == TABLET
    spread = changed(tmp_path, "[[0.0, 0.0], [1.0, 4.0]]", "[[0.0, 0.0],\n[1.0, 4.0]]")
    with pytest.raises(InputError, match=r"hand\.pressure_curve in one line"):
        RigFile.updated(
            spread, {"hand.pressure_curve": Curve(((0.0, 0.0), (1.0, 4.0)), "N", True, "")}
        )


def test_the_page_about_the_rig_file_names_every_key_and_no_other():
    page = (ROOT / "docs/rig-file.md").read_text(encoding="utf-8")
    told = re.findall(r"^\| `\[(\w+)\]` \| `(\w+)` \|", page, flags=re.MULTILINE)
    assert told == [(name, key.name) for name, kind in _SECTIONS.items() for key in fields(kind)]
