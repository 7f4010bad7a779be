import json
import tomllib
from datetime import date

import numpy as np
import pytest

from tactileq.modeling import InputError
from tactileq.modeling.files.described import keys_of
from tactileq.modeling.vibrators.vibrator import Vibrator
from tactileq.rig.shared.setup.rig_file import SHIPPED_RIG_FILE, Curve, Figure, RigFile

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
    for key in keys_of(RigFile):
        missing = {one.name for one in key.keys} - set(given[key.name])
        assert missing <= {"file"}, key.name  # every key stands in the shipped file


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
        ("vibration_channel = 1", "vibration_channel = 3", "sound.vibration_channel among the 2"),
        ("masking_channel = 2", "masking_channel = 1", "another channel than the vibration"),
        ('kind = "tablet" ', 'kind = "mouse"', "hand.counts_per_mm (counts/mm) of a mouse"),
        ("[[0.0, 0.0], [1.0, 4.0]]", "[[0.0, 0.0], [1.0, -4.0]]", "force in N] of rising pressure"),
        ("[[0.0, 0.0], [1.0, 4.0]]", "[[0.0, 0.0], [0.0, 4.0]]", "under [hand.pressure_curve]"),
        ("[[0.0, 0.0], [1.0, 4.0]]", "[[0.0, 0.0]]", "two or more points [pressure"),
        ('# file = "vibrator.json"', 'file = "vibrator.json"', "vibrator.json, got nothing there"),
    ],
)
def test_keys_that_do_not_go_together_are_refused_in_one_sentence(tmp_path, old, new, told):
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
    schema, _, rest = TABLET.partition("\n")
    assert schema.startswith("#:schema ")
    assert RigFile.load(written(tmp_path, rest)).sha256 == first
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


def lines_changed(before, after):
    """The numbers of the lines that differ."""
    both = zip(before.splitlines(), after.splitlines(), strict=True)
    return [number for number, (old, new) in enumerate(both) if old != new]


def test_an_update_changes_its_values_and_not_a_byte_of_all_else(tmp_path):
    path = written(tmp_path, TABLET)
    measured = Figure(2.25, "g/V", False, 'accelerometer "at" the pen # 3')
    curve = Curve(((0.0, 0.0), (0.5, 1.25)), "N", False, "weights")
    rig = RigFile.updated(
        path, {"vibrator.g_per_volt": measured, "hand.pressure_curve": curve, "sound.block": 256}
    )
    assert rig == RigFile.load(path)
    assert rig.vibrator.g_per_volt == measured
    assert rig.hand.pressure_curve == curve
    assert "vibrator.g_per_volt" not in dict(rig.assumed())
    after = path.read_text(encoding="utf-8")
    begins = [after.splitlines()[number].split()[0] for number in lines_changed(TABLET, after)]
    assert begins == ["block", "g_per_volt", "pressure_curve"]
    assert "block = 256                 # samples per block of the card" in after


@pytest.mark.parametrize("key", tomllib.loads(TABLET)["limits"])
def test_an_update_of_one_key_changes_only_the_line_of_its_value(tmp_path, key):
    path = written(tmp_path, TABLET)
    unit = tomllib.loads(TABLET)["limits"][key]["unit"]
    RigFile.updated(path, {f"limits.{key}": Figure(0.5, unit, True, "chosen")})
    after = path.read_text(encoding="utf-8")
    assert [after.splitlines()[number] for number in lines_changed(TABLET, after)] == [
        f'{key} = {{ value = 0.5, unit = "{unit}", assumed = true, source = "chosen" }}'
    ]


def test_what_an_update_adds_stands_in_its_section(tmp_path):
    path = written(tmp_path, TABLET)
    day = date(2026, 11, 22)
    rig = RigFile.updated(
        path,
        {
            "vibrator.measured_on": day,
            "hand.assumed_force_n": Figure(1.0, "N", True, ""),
            "calibration.date": day,
            "calibration.rig": "desk rig",
            "calibration.serials": ("A1", "B2"),
        },
    )
    assert rig == RigFile.load(path)
    assert (rig.vibrator.measured_on, rig.hand.assumed_force_n) == (day, Figure(1, "N", True, ""))
    assert rig.calibration is not None
    assert (rig.calibration.date, rig.calibration.serials) == (day, ("A1", "B2"))
    after = path.read_text(encoding="utf-8").splitlines()
    assert [line for line in TABLET.splitlines() if line not in after] == []
    added = 'assumed_force_n = { value = 1.0, unit = "N", assumed = true, source = "" }'
    assert added in after


def test_values_over_several_lines_are_replaced_and_those_of_other_keys_stay(tmp_path):
    serials = 'serials = [  # of all\n    "V1",  # the vibrator\n    "A1",\n]'
    points = "points = [\n    [0.0, 0.0],  # at rest\n    [1.0, 4.0],\n]"
    spread = TABLET.replace("serials = []", serials, 1)
    table = f'[hand.pressure_curve]  # by hand\n{points}\nunit = "N"\nassumed = true\nsource = ""\n'
    own = next(line for line in TABLET.splitlines() if line.startswith("pressure_curve"))
    spread = spread.replace(f"{own}\n", "") + table
    curve = Curve(((0.0, 0.0), (0.5, 2.0)), "N", False, "weights")
    path = written(tmp_path, spread)
    rig = RigFile.updated(path, {"hand.pressure_curve": curve})
    assert (rig.rig.serials, rig.hand.pressure_curve) == (("V1", "A1"), curve)
    changed = table.replace(points, "points = [[0.0, 0.0], [0.5, 2.0]]")
    changed = changed.replace("assumed = true", "assumed = false")
    expected = spread.replace(table, changed.replace('source = ""', 'source = "weights"'))
    assert path.read_text(encoding="utf-8") == expected
    assert RigFile.updated(path, {"rig.serials": ["B2"]}).rig.serials == ("B2",)
    assert path.read_text(encoding="utf-8") == expected.replace(serials, 'serials = ["B2"]')


def test_an_update_that_would_spoil_the_file_changes_nothing(tmp_path):
    path = written(tmp_path, TABLET)
    with pytest.raises(InputError, match=r'expected "g/V" for unit under \[vibrator\.g_per_volt\]'):
        RigFile.updated(path, {"vibrator.g_per_volt": Figure(1.0, "V", False, "")})
    with pytest.raises(InputError, match="got gain"):
        RigFile.updated(path, {"vibrator.gain": 1.0})
    assert path.read_text(encoding="utf-8") == TABLET
