"""Scene files: every key and its default, the three hands, and one sentence for what is wrong."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tactileq.modeling import InputError, Scene
from tactileq.modeling.recordings.trajectory import Trajectory
from tactileq.modeling.scenes.hands import HandPlaces, HandRange, distributed_hand, recorded_hand
from tactileq.modeling.scenes.scene import Bound, Budget
from tests.refusals import refused

LEAST = """
version = 1
[scene]
name = "touch"
[hand]
speed_mm_s = [50, 150]
force_n = 0.5
"""
FULL = """
version = 1
[scene]
name = "slow light touch"
models = "models"
textures = ["canvas", "PVC"]
threshold = "own.tsv"
margin_db = 3
[hand]
speed_mm_s = [50, 150]
force_n = [0.5, 1.0]
stroke_hz = 1.5
[actuator]
band_hz = [40, 400]
rate_hz = 5000
peak_g = 5
rms_g = 2
[bound]
gfc30 = 0.9
bands_db = 1.5
level_db = 0.5
[budget]
operations = 150
bytes = 16384
"""
PLACES = """
version = 1
[scene]
name = "touch"
[hand]
[[hand.place]]
speed_mm_s = 100
force_n = 1
share = 3
[[hand.place]]
speed_mm_s = 200
force_n = 2
share = 1
"""


def loaded(folder: Path, text: str) -> Scene:
    (folder / "scene.toml").write_text(text, encoding="utf-8")
    return Scene.load(folder / "scene.toml")


def test_every_key_is_read(tmp_path: Path) -> None:
    (tmp_path / "own.tsv").write_text("frequency_hz\tacceleration_g\n10\t1\n500\t2\n")
    scene = loaded(tmp_path, FULL)
    assert (scene.name, scene.textures) == ("slow light touch", ("canvas", "PVC"))
    assert scene.models == tmp_path / "models"
    assert scene.threshold.acceleration_g.tolist() == [1, 2]
    assert scene.margin_db == 3
    assert scene.hand == HandRange(speed_mm_s=(50, 150), force_n=(0.5, 1.0), stroke_hz=1.5)
    assert scene.actuator.band_hz == (40, 400)
    assert scene.actuator.rate_hz == 5000
    assert (scene.actuator.limits.peak, scene.actuator.limits.rms) == (5, 2)
    assert scene.bound == Bound(gfc30=0.9, bands_db=1.5, level_db=0.5)
    assert scene.budget == Budget(operations=150, bytes=16384)


def test_what_is_left_out_has_its_default(tmp_path: Path) -> None:
    scene = loaded(tmp_path, LEAST)
    assert (scene.textures, scene.models, scene.margin_db) == ((), None, 0)
    assert scene.threshold.name == "codec"
    assert scene.hand == HandRange(speed_mm_s=(50, 150), force_n=(0.5, 0.5), stroke_hz=2)
    assert scene.bound == Bound(gfc30=0.95, bands_db=1, level_db=1)
    assert (scene.actuator.band_hz, scene.actuator.rate_hz) == (None, None)
    assert (scene.actuator.limits.peak, scene.actuator.limits.rms) == (np.inf, np.inf)
    assert scene.budget.most_bytes == scene.budget.most_operations(5000) == np.inf


def test_a_hand_may_do_all_that_was_recorded(tmp_path: Path) -> None:
    text = LEAST.replace("speed_mm_s = [50, 150]", 'speed_mm_s = "recorded"')
    scene = loaded(tmp_path, text)
    assert scene.hand == HandRange(speed_mm_s="recorded", force_n=(0.5, 0.5))
    assert scene.hand.to_dict()["speed_mm_s"] == "recorded"
    assert scene.sha256 != loaded(tmp_path, LEAST).sha256


def test_a_device_gives_operations_and_bytes() -> None:
    budget = Budget(device="stm32l432")
    assert budget.most_operations(5000) == pytest.approx(2 * budget.most_operations(10_000))
    assert budget.most_bytes == 65536
    assert Budget(device="stm32l432", bytes=1000).most_bytes == 1000


def test_the_hash_follows_every_value(tmp_path: Path) -> None:
    (tmp_path / "own.tsv").write_text("frequency_hz\tacceleration_g\n10\t1\n500\t2\n")
    hashes = {loaded(tmp_path, FULL).sha256}
    changed = [
        ("slow light", "slow"), ('"canvas", ', ""), ("own.tsv", "codec"), ("margin_db = 3", ""),
        ("[50, 150]", "[50, 151]"), ("[0.5, 1.0]", "[0.5, 1.1]"), ("1.5\n[act", "1.6\n[act"),
        ("[40, 400]", "[40, 401]"), ("rate_hz = 5000", ""), ("peak_g = 5", ""), ("rms_g = 2", ""),
        ("gfc30 = 0.9", ""), ("bands_db = 1.5", ""), ("level_db = 0.5", ""), ("= 150\nb", "= 1\nb"),
        ("bytes = 16384", ""),
    ]  # fmt: skip
    for old, new in changed:
        assert old in FULL
        hashes.add(loaded(tmp_path, FULL.replace(old, new)).sha256)
    assert len(hashes) == 1 + len(changed)
    moved = loaded(tmp_path, FULL.replace('models = "models"', 'models = "elsewhere"'))
    assert moved.sha256 in hashes


# --- Hands


def test_a_distribution_is_normed_and_strokes_up_to_its_highest_speed(tmp_path: Path) -> None:
    hand = loaded(tmp_path, PLACES).hand
    assert isinstance(hand, HandPlaces)
    assert hand.share.tolist() == [0.75, 0.25]
    assert hand.ranges == ((100, 200), (1, 2))
    omega = 2 * np.pi * 2
    assert hand.speed_change_mm_s2 == pytest.approx([omega * np.sqrt(3) * 100, 0])
    assert hand.force_change_n_s == pytest.approx([omega / 2] * 2)
    still = distributed_hand([100], [1], [1], stroke_hz=0)
    assert still.speed_change_mm_s2.tolist() == still.force_change_n_s.tolist() == [0]


def test_a_recorded_sine_has_its_shares_and_slopes() -> None:
    """|v| = 200·|sin(2πt)| is below 100 mm/s for a third of the time; its slope is the cosine."""
    time_s = np.arange(0, 4.0005, 1e-3)
    speed = 200 * np.sin(2 * np.pi * time_s)
    hand = recorded_hand(Trajectory("sine", time_s, speed, 1 + time_s / 4))
    assert hand.share[hand.speed_mm_s < 100].sum() == pytest.approx(1 / 3, abs=0.01)
    assert hand.share.sum() == pytest.approx(1)
    slope = 2 * np.pi * np.sqrt(200**2 - hand.speed_mm_s**2)
    inside = slice(2, -2)  # at the ends one-sided differences are taken
    assert hand.speed_change_mm_s2[inside] == pytest.approx(slope[inside], rel=0.01, abs=10)
    assert hand.force_change_n_s == pytest.approx(np.full(hand.share.size, 0.25))
    assert hand.ranges[0] == pytest.approx((0, 200), abs=1e-9)


def test_a_hand_that_rests_or_lifts_off_is_at_no_place() -> None:
    time_s = np.linspace(0, 3, 601)
    speed = np.where(time_s < 1, 0.0, 100.0)
    force = np.where(time_s > 2, np.nan, 1.0)
    hand = recorded_hand(Trajectory("parts", time_s, speed, force))
    assert hand.share.size == pytest.approx(200, abs=3)
    assert set(hand.speed_mm_s) == {100.0}
    assert np.isfinite(hand.speed_change_mm_s2).all()
    assert np.isfinite(hand.force_change_n_s).all()
    with refused(InputError, expected="hand", got="none"):
        recorded_hand(Trajectory("still", time_s, 0 * time_s, force))


def test_a_recorded_hand_is_read_from_beside_the_scene(tmp_path: Path) -> None:
    (tmp_path / "hand.csv").write_text("time_s,speed_mm_s,force_n\n0,100,1\n1,-200,2\n")
    text = LEAST.split("[hand]")[0] + '[hand]\nfile = "hand.csv"\n'
    hand = loaded(tmp_path, text).hand
    assert isinstance(hand, HandPlaces)
    assert hand.kind == "recorded"
    assert hand.ranges[1] == (1, 2)
    assert hand.speed_change_mm_s2 == pytest.approx(np.full(hand.share.size, 300.0))


# --- What is refused


HAND = LEAST.split("name = ")[0] + 'name = "touch"\n[hand]\n'


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (LEAST.replace("version = 1", ""), "expected version = 1 at the top"),
        (LEAST.replace("version = 1", "version = 2"), "or update tactileq if the scene is newer"),
        (LEAST.replace("version = 1", "version = true"), "expected version = 1"),
        (LEAST + "[more]\n", "expected only version, scene, hand, actuator, bound, budget"),
        (LEAST.replace('"touch"', '"a"\nthreshold = "c"'), "expected a threshold among codec"),
        (LEAST.replace('"touch"', '"a"\nthreshold = "c.tsv"'), "c.tsv"),
        (LEAST.replace('"touch"', '"a"\ntextures = ["b", "b"]'), "each once"),
        ("version = 1\nscene = 5\n" + "[hand]\nspeed_mm_s = 5", "expected a table .scene."),
        ("version = 1\n[[scene]]\nname = 'a'", "expected a table .scene."),
        ("version = 1\n[scene\n", "scene.toml"),
        (HAND, "got none; give one of the three"),
        (HAND + "speed_mm_s = 5\n", "got speed_mm_s; give one of the three"),
        (HAND + "stroke_hz = 5\n", "got stroke_hz; give one of the three"),
        (LEAST + 'file = "hand.csv"\n', "got speed_mm_s, force_n, file; give one of the three"),
        (HAND + 'file = "a.csv"\nstroke_hz = 2\n', "expected no stroke_hz beside a recorded hand"),
        (HAND + 'file = "a.csv"\n', "a.csv"),
        (LEAST.replace("[50, 150]", "[150, 50]"), "got 150 before 50; swap them"),
        (LEAST.replace("[50, 150]", "[50]"), "write .lowest, highest."),
        (LEAST.replace("[50, 150]", "[50, 100, 150]"), "write .lowest, highest."),
        (LEAST.replace("0.5", "[0.5, nan]"), "write .lowest, highest."),
        (HAND + "place = [5]\n", "expected a table ..hand.place.."),
        (PLACES.replace("share = 1", "share = 0"), "share under ..hand.place.. number 2"),
        (LEAST + "[actuator]\nband_hz = [400, 40]\n", "got 400 before 40; swap them"),
        (LEAST + "[actuator]\nband_hz = [40, 40]\n", "got 40 Hz twice; give both ends"),
        (LEAST + '[budget]\ndevice = "abacus"\n', "abacus"),
        (
            LEAST + '[budget]\noperations = 5\ndevice = "stm32l432"\n',
            "got both, which may contradict each other; remove one",
        ),
    ],
)
def test_what_is_wrong_is_told_in_one_sentence(text: str, expected: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=expected) as refused:
        loaded(tmp_path, text)
    told = str(refused.value)
    assert "scene.toml" in told
    assert "\n" not in told
    assert told.endswith(".")
    assert ". " not in told.replace("…", "")


def test_a_missing_file_is_refused(tmp_path: Path) -> None:
    with refused(InputError, expected=["scene", tmp_path / "none.toml"], got="nothing"):
        Scene.load(tmp_path / "none.toml")


# --- Bounds


def test_a_widened_bound_allows_that_many_times_the_errors() -> None:
    wider = Bound(gfc30=0.99, bands_db=0.5, level_db=2).widened(3)
    assert np.arccos(wider.gfc30) == pytest.approx(3 * np.arccos(0.99))
    assert (wider.bands_db, wider.level_db) == (1.5, 6)
    widest = Bound().widened(1000)
    assert (widest.gfc30, widest.bands_db, widest.level_db) == (pytest.approx(0), 100, 100)
