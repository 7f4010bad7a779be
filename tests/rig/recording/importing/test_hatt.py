"""Toolkit files: planted filters come back, weights and hull, synthesis, and every bad file."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import freqz, welch

from tactileq.modeling import InputError, fit_ar, fit_texture, similarity
from tactileq.rig.recording.importing.hatt import HattTexture
from tactileq.rig.recording.importing.hatt_reader import load_hatt
from tests.refusals import refused

Xml = Callable[..., str]
G = 9.80665


def planted(speed_mm_s: float, force_n: float, frequency_hz: np.ndarray) -> np.ndarray:
    """Response of a planted filter at one of its own conditions, g per unit noise."""
    peaks = np.array([(40 + speed_mm_s / 2) / 1000, 0.3 + 0.01 * force_n])
    poles = np.array([0.93, 0.8]) * np.exp(2j * np.pi * peaks)
    denominator = np.poly([*poles, *poles.conj()]).real
    gain = 3 * np.sqrt(0.01 * speed_mm_s * force_n) / G
    _, response = freqz([gain, 0.2 * gain, -0.3 * gain], denominator, worN=frequency_hz, fs=1000)
    return np.abs(response)


def square(conditions: list[tuple[float, float]], triangles: list[list[int]]) -> HattTexture:
    """Filters that differ in nothing but variance (1, 2, 3, …)."""
    n = len(conditions)
    return HattTexture(
        material="square",
        rate_hz=1000.0,
        conditions=np.array(conditions, dtype=float),
        triangles=np.array(triangles),
        ar_frequencies=np.tile([1.0, 2.0], (n, 1)),
        ma_frequencies=np.zeros((n, 0)),
        variances=np.arange(1.0, n + 1),
        gains=np.ones(n),
    )


UNIT = square([(0, 0), (200, 0), (0, 4), (200, 4)], [[0, 1, 2], [1, 2, 3]])


@pytest.fixture
def load(tmp_path: Path) -> Callable[[str], HattTexture]:
    def read(text: str) -> HattTexture:
        (tmp_path / "Models_Planted 1.xml").write_text(text, encoding="utf-8")
        return load_hatt(tmp_path / "Models_Planted 1.xml")

    return read


# --- reading


def test_planted_file_is_read(load: Callable[[str], HattTexture], hatt_xml: Xml) -> None:
    texture = load(hatt_xml())
    assert (texture.material, texture.rate_hz) == ("Planted 1", 1000.0)
    assert texture.conditions[4].tolist() == [160.0, 1.5]
    assert texture.ar_frequencies.shape == (5, 4)
    assert texture.ma_frequencies.shape == (5, 2)
    assert texture.triangles.shape == (4, 3)
    assert texture.triangles.min() == 0
    assert texture.variances == pytest.approx([0, 0, 0, 12, 2.4])
    frequency = np.arange(5.0, 495.0)
    for condition in ((160.0, 1.5), (300.0, 4.0)):
        found = texture.filter(*condition).response(frequency)
        # Six decimals of a frequency near a pole.
        assert found == pytest.approx(planted(*condition, frequency), rel=1e-4)


def test_models_are_matched_by_condition_not_by_place(
    load: Callable[[str], HattTexture], hatt_xml: Xml
) -> None:
    text = hatt_xml()
    models = re.findall(r"<model>.*?</model>", text)
    shuffled = text.replace("\n".join(models), "\n".join(reversed(models)))
    assert shuffled != text
    assert load(shuffled).variances == pytest.approx(load(text).variances)


def test_purely_autoregressive_files_are_read(
    load: Callable[[str], HattTexture], hatt_xml: Xml
) -> None:
    """As the toolkit's originals at 10 kHz: no moving average, no gain."""
    texture = load(hatt_xml(moving_average=False, rate_hz=10_000.0))
    assert texture.ma_frequencies.shape == (5, 0)
    assert texture.gains.tolist() == [1] * 5
    assert texture.filter(160.0, 1.5).numerator == pytest.approx([np.sqrt(2.4) / G])


# --- between the filters


def test_weights_in_closed_form() -> None:
    assert UNIT.weights(50, 1).tolist() == pytest.approx([0.5, 0.25, 0.25, 0])
    assert UNIT.weights(150, 3).tolist() == pytest.approx([0, 0.25, 0.25, 0.5])
    assert UNIT.weights(200, 4).tolist() == pytest.approx([0, 0, 0, 1])
    assert UNIT.weights(100, 0).tolist() == pytest.approx([0.5, 0.5, 0, 0])


def test_outside_the_hull_the_nearest_point_counts() -> None:
    assert UNIT.nearest(500, 2) == pytest.approx((200, 2))
    assert UNIT.nearest(50, 9) == pytest.approx((50, 4))
    assert UNIT.nearest(900, 9) == pytest.approx((200, 4))
    # A slanting side: distances relative to the fastest and the strongest, here 200 and 4.
    corner = square([(0, 0), (200, 0), (0, 4)], [[0, 1, 2]])
    assert corner.nearest(200, 4) == pytest.approx((100, 2))
    assert corner.weights(200, 4) == pytest.approx([0, 0.5, 0.5])


@given(st.floats(0.01, 400), st.floats(0.01, 8))
def test_weights_sum_to_one_and_give_the_point_back(speed: float, force: float) -> None:
    weights = UNIT.weights(speed, force)
    assert weights.min() >= 0
    assert weights.sum() == pytest.approx(1)
    assert UNIT.nearest(speed, force) == pytest.approx((min(speed, 200), min(force, 4)), rel=1e-6)


def test_degenerate_triangles_are_passed_over() -> None:
    texture = square([(0, 0), (100, 0), (200, 0), (0, 4)], [[0, 1, 2], [0, 2, 3]])
    assert texture.weights(100, 1).tolist() == pytest.approx([0.25, 0, 0.5, 0.25])


def test_variance_and_not_amplitude_is_blended() -> None:
    level = UNIT.filter(100, 0).numerator[0] * G
    assert level == pytest.approx(np.sqrt(1.5))


def test_frequencies_are_blended(load: Callable[[str], HattTexture], hatt_xml: Xml) -> None:
    texture = load(hatt_xml())
    weights = texture.weights(230, 2.75)
    assert weights == pytest.approx([0, 0, 0, 0.5, 0.5], abs=1e-9)
    middle = texture.ar_frequencies[[3, 4]].mean(axis=0)
    roots = np.roots(texture.filter(230, 2.75).denominator)
    assert np.abs(roots).max() < 1
    from tactileq.modeling.models.line_spectral import line_spectral_frequencies

    assert line_spectral_frequencies(texture.filter(230, 2.75).denominator[1:]) == pytest.approx(
        middle, abs=1e-9
    )


# --- synthesis


def test_recordings_have_the_spectrum_of_the_filter(
    load: Callable[[str], HattTexture], hatt_xml: Xml
) -> None:
    texture = load(hatt_xml())
    [record] = texture.recordings([160.0], [1.5], duration_s=100.0, seed=1)
    frequency, density = welch(record.samples, fs=1000.0, nperseg=1000)
    inside = (frequency >= 10) & (frequency < 490)
    measured = density[inside].reshape(-1, 12).mean(axis=1)
    expected = (planted(160.0, 1.5, frequency[inside]) ** 2 * 2 / 1000).reshape(-1, 12).mean(axis=1)
    # 199 half-overlapping pieces × 12 bins: 2.5 %.
    assert measured == pytest.approx(expected, rel=0.12)
    assert np.mean(measured / expected) == pytest.approx(1, abs=0.02)


def test_set_is_labelled_simulated_in_g(load: Callable[[str], HattTexture], hatt_xml: Xml) -> None:
    records = load(hatt_xml()).recordings([100.0, 150.0], [1.0, 2.0], duration_s=0.5)
    assert [r.condition for r in records] == [(100, 1), (100, 2), (150, 1), (150, 2)]
    assert all(r.simulated and r.unit == "g" and r.texture == "Planted 1" for r in records)
    assert {(r.samples.size, r.rate_hz) for r in records} == {(500, 1000.0)}


def test_seed_fixes_the_noise_and_textures_differ(
    load: Callable[[str], HattTexture], hatt_xml: Xml
) -> None:
    def samples(material: str, seed: int) -> np.ndarray:
        records = load(hatt_xml(material=material)).recordings([100.0, 200.0], [1.0], seed=seed)
        return np.concatenate([r.samples for r in records])

    assert np.array_equal(samples("A", 3), samples("A", 3))
    assert not np.array_equal(samples("A", 3), samples("A", 4))
    assert abs(np.corrcoef(samples("A", 3), samples("B", 3))[0, 1]) < 0.5
    first, second = np.split(samples("A", 3), 2)
    assert abs(np.corrcoef(first, second)[0, 1]) < 0.5


def test_lower_rates_keep_the_band_below(load: Callable[[str], HattTexture], hatt_xml: Xml) -> None:
    texture = load(hatt_xml())
    [full] = texture.recordings([160.0], [1.5], seed=2)
    [half] = texture.recordings([160.0], [1.5], rate_hz=500.0, seed=2)
    assert (half.rate_hz, half.samples.size) == (500.0, 5000)
    kept = np.fft.rfft(full.samples)[1:2400]
    assert np.fft.rfft(half.samples)[1:2400] * 2 == pytest.approx(kept, abs=1e-9)


def test_such_a_set_becomes_a_model_and_a_rival(
    load: Callable[[str], HattTexture], hatt_xml: Xml
) -> None:
    records = load(hatt_xml()).recordings([100.0, 200.0, 300.0], [1.0, 3.0], duration_s=2.0)
    model, rival = fit_texture(records), fit_ar(records, order=6)
    assert model.rate_hz == rival.rate_hz == 1000.0
    assert model.simulated
    assert rival.simulated
    scores = [similarity.report(r, rival).gfc30 for r in records]
    assert min(scores) > 0.98


@pytest.mark.parametrize(
    ("options", "expected", "got"),
    [
        ({"rate_hz": 2000.0}, ["rate", 1, "1000 Hz"], 2000),
        ({"rate_hz": 0.0}, ["rate", 1, "1000 Hz"], 0),
        ({"duration_s": 0.0}, ["duration", "0 s"], 0.0),
        ({"duration_s": np.inf}, ["duration", "0 s"], "inf"),
        ({"duration_s": 0.01}, "64 samples", ["0.01 s", "1000 Hz"]),
    ],
)
def test_unusable_options_are_refused(
    options: dict[str, float], expected: object, got: object
) -> None:
    with refused(InputError, expected=expected, got=got):
        UNIT.recordings([100.0], [1.0], **options)  # type: ignore[arg-type]


@pytest.mark.parametrize("condition", [(0.0, 1.0), (100.0, -1.0), (np.nan, 1.0), (100.0, np.inf)])
def test_conditions_without_contact_are_refused(condition: tuple[float, float]) -> None:
    with refused(
        InputError,
        expected=[0, "100000 mm/s", "10000 N"],
        got=[f"{condition[0]:g} mm/s", f"{condition[1]:g} N"],
    ):
        UNIT.recordings([condition[0]], [condition[1]])


def test_silent_textures_are_refused(load: Callable[[str], HattTexture], hatt_xml: Xml) -> None:
    silent = load(re.sub("<var>.*?</var>", "<var>0.000000</var>", hatt_xml()))
    with refused(InputError, names="Planted 1", expected=["condition", "vibration"], got="none"):
        silent.recordings([100.0], [1.0])


def test_conditions_beyond_the_hull_are_holes() -> None:
    """Nothing is known there; a copy of the nearest filter would say that nothing changes."""
    records = UNIT.recordings([50.0, 200.0, 201.0], [1.0, 4.0, 5.0], duration_s=0.5)
    assert [r.condition for r in records] == [(50, 1), (50, 4), (200, 1), (200, 4)]
    assert UNIT.conditions_inside([(200.0, 4.0), (200.001, 4.0)]) == [(200.0, 4.0)]
    with refused(InputError, names="square", expected="condition", got=["none", 4]):
        UNIT.recordings([300.0, 400.0], [1.0, 2.0])


def test_a_hole_changes_no_other_recording() -> None:
    inside = {r.condition: r for r in UNIT.recordings([50.0, 150.0], [1.0], duration_s=0.5)}
    again = UNIT.recordings([50.0, 999.0], [1.0], duration_s=0.5)
    [kept] = again
    assert np.array_equal(kept.samples, inside[50.0, 1.0].samples)


# --- at the file's own conditions


def test_each_loud_filter_has_one_recording_at_its_own_condition(
    load: Callable[[str], HattTexture], hatt_xml: Xml
) -> None:
    texture = load(hatt_xml())
    assert texture.vibrating() == [3, 4]
    records = texture.own_recordings(duration_s=100.0, seed=1)
    assert [r.condition for r in records] == [(300, 4), (160, 1.5)]
    assert all(r.simulated and r.unit == "g" and r.texture == "Planted 1" for r in records)
    frequency = np.arange(10.0, 490.0)
    for record in records:
        _, density = welch(record.samples, fs=1000.0, nperseg=1000)
        expected = planted(*record.condition, frequency) ** 2 * 2 / 1000
        assert np.mean(density[10:490] / expected) == pytest.approx(1, abs=0.02)


def test_own_conditions_take_the_filter_itself_even_outside_all_triangles() -> None:
    """The triangles of a file may leave a filter out; its neighbours then say nothing about it."""
    texture = square([(100, 1), (200, 1), (100, 2), (300, 3)], [[0, 1, 2]])
    *_, last = texture.own_recordings(duration_s=100.0, seed=4)
    assert last.condition == (300, 3)
    alone = square([(100, 1), (200, 1), (300, 3), (100, 2)], [[0, 1, 2]])
    exact = alone.filter(300.0, 3.0)
    # Line spectral frequencies are those of all filters; the variance is the fourth one's.
    power = np.mean(exact.response(np.linspace(0, 500, 20_001)) ** 2) * 4 / 3
    assert np.var(last.samples) == pytest.approx(power, rel=0.03)


def test_own_conditions_are_bits_of_seed_and_place_at_any_rate() -> None:
    first = [r.samples for r in UNIT.own_recordings(duration_s=0.5, seed=3)]
    assert len(first) == 1
    assert np.array_equal(
        first[0], UNIT.own_recordings(duration_s=0.5, seed=3).recordings[0].samples
    )
    other = UNIT.own_recordings(duration_s=0.5, seed=4).recordings[0].samples
    assert not np.array_equal(first[0], other)
    [half] = UNIT.own_recordings(duration_s=0.5, rate_hz=500.0)
    assert (half.rate_hz, half.samples.size) == (500.0, 250)


def test_filters_without_speed_force_or_level_are_no_own_conditions() -> None:
    texture = square([(100, 1), (0, 1), (100, 0), (200, 2), (300, 1)], [[0, 1, 2]])
    texture.variances[3] = 0
    assert texture.vibrating() == [0, 4]
    texture.gains[0] = 0
    assert texture.vibrating() == [4]
    assert [r.condition for r in texture.own_recordings(duration_s=0.1)] == [(300, 1)]


def test_a_condition_that_is_listed_twice_has_one_recording() -> None:
    texture = square([(100, 1), (200, 1), (100, 2), (200.0000001, 1)], [[0, 1, 2]])
    assert texture.vibrating() == [0, 1, 2]


def test_silent_files_have_no_own_conditions(
    load: Callable[[str], HattTexture], hatt_xml: Xml
) -> None:
    silent = load(re.sub("<var>.*?</var>", "<var>0.000000</var>", hatt_xml()))
    with refused(InputError, names="Planted 1", expected="vibration", got=["none", "5 models"]):
        silent.own_recordings()


def test_unusable_options_of_own_conditions_are_refused() -> None:
    with refused(InputError, expected=["rate", "1000 Hz"], got=2000):
        UNIT.own_recordings(rate_hz=2000.0)
    with refused(InputError, expected="100000 mm/s", got="200000 mm/s"):
        square([(100, 1), (2e5, 1), (100, 2)], [[0, 1, 2]]).own_recordings()


# --- bad files


def swapped(text: str, part: str) -> str:
    """The first two values of the first list `part` exchanged."""
    return re.sub(rf"(<{part}>)(<value>.*?</value>)(<value>.*?</value>)", r"\1\3\2", text, count=1)


def nudged(text: str, part: str, by: float) -> str:
    """The second value of the first list `part` changed by a little."""
    pattern = rf"(<{part}><value>.*?</value><value>)(.*?)(</value>)"
    return re.sub(pattern, lambda m: f"{m[1]}{float(m[2]) + by:.9f}{m[3]}", text, count=1)


BAD = [
    (lambda t: "not xml", "XML", "line 1"),
    (lambda t: "", "XML", "line 1"),
    (lambda t: t[:2000], "XML", "line 16"),
    (lambda t: "<other/>", "modelSet", "other"),
    (lambda t: re.sub("<SampleRate>.*?</SampleRate>", "", t), "SampleRate", "none"),
    (lambda t: t.replace(">1000<", ">fast<"), ["numbers", "SampleRate"], "'fast'"),
    (lambda t: t.replace(">1000<", ">0<"), ["SampleRate", 1, "10000000 Hz"], 0),
    (lambda t: t.replace("<material>Planted 1", "<material> "), "material", "none"),
    (lambda t: t.replace("m/s^2", "g"), ["AccelUnits", "m/s^2"], "g"),
    (lambda t: t.replace(">mm/s<", ">in/s<"), ["SpeedUnits", "mm/s"], "in/s"),
    (lambda t: re.sub("<speedList.*?</speedList>", "", t), "speedList", "none"),
    (
        lambda t: t.replace("<value>4.000000</value>", "", 1),
        ["speeds", "forces"],
        ["5 in speedList", "4 in forceList"],
    ),
    (lambda t: t.replace(">160.000000<", ">-160.000000<"), ["speeds", 0], -160),
    (lambda t: t.replace(">160.000000<", ">nan<", 1), ["finite", "speedList"], "NaN"),
    (lambda t: re.sub("<model>.*?</model>", "", t, count=1), 5, [4, "0 mm/s", "0 N"]),
    (lambda t: re.sub("<tri .*</tri>", "", t), ["one", "tri"], "none"),
    (
        lambda t: re.sub(r"<tri(.*?)<value>\d", r"<tri\1<value>6", t, count=1),
        ["1 to 5", "tri"],
        6.0,
    ),
    (
        lambda t: re.sub(r"<tri(.*?)<value>\d", r"<tri\1<value>0", t, count=1),
        ["1 to 5", "tri"],
        0.0,
    ),
    (
        lambda t: re.sub(r"<tri(.*?)<value>\d", r"<tri\1<value>1.5", t, count=1),
        ["1 to 5", "tri"],
        1.5,
    ),
    (
        lambda t: re.sub(r"(<tri[^/]*)<value>\d</value>", r"\1", t, count=1),
        ["three", "tri"],
        "[5.0, 1.0]",
    ),
    (lambda t: re.sub("<ARlsf>.*?</ARlsf>", "", t, count=1), "ARlsf", "none"),
    (lambda t: re.sub("<ARcoeff>.*?</ARcoeff>", "", t, count=1), "ARcoeff", "none"),
    (
        lambda t: t.replace("<ARlsf><value>", "<ARlsf><value>0.001</value><value>", 1),
        ["6 values", "ARcoeff", "ARlsf"],
        "5 values",
    ),
    (
        lambda t: t.replace("<ARcoeff><value>1.0", "<ARcoeff><value>2.0", 1),
        ["ARcoeff", 1],
        "[2.0]",
    ),
    (lambda t: swapped(t, "ARlsf"), ["ARlsf", "π"], "unstable"),
    (lambda t: swapped(t, "MAlsf"), ["MAlsf", "π"], "unstable"),
    (lambda t: nudged(t, "ARlsf", 2e-4), ["ARcoeff", "ARlsf", 5e-05], "difference"),
    (lambda t: nudged(t, "ARcoeff", 6e-5), ["ARcoeff", "ARlsf", 5e-05], 6.1e-05),
    (lambda t: nudged(t, "MAcoeff", -6e-5), ["MAcoeff", "MAlsf", 5e-05], 6e-05),
    (lambda t: re.sub("<var>.*?</var>", "<var>-1</var>", t, count=1), ["var", 0], -1),
    (
        lambda t: re.sub("<var>.*?</var>", "<var>inf</var>", t, count=1),
        ["finite", "var"],
        "infinity",
    ),
    (lambda t: re.sub("<gain>.*?</gain>", "", t, count=1), "gain", "none"),
]


@pytest.mark.parametrize(("damage", "expected", "got"), BAD)
def test_bad_files_get_one_sentence(
    load: Callable[[str], HattTexture],
    hatt_xml: Xml,
    damage: Callable[[str], str],
    expected: object,
    got: object,
) -> None:
    good = hatt_xml()
    assert damage(good) != good
    facts = {"names": "Models_Planted 1.xml", "expected": expected, "got": got}
    with refused(InputError, **facts) as caught:
        load(damage(good))
    assert "\n" not in str(caught.value)


def test_small_differences_of_rounding_are_accepted(
    load: Callable[[str], HattTexture], hatt_xml: Xml
) -> None:
    assert load(nudged(hatt_xml(), "ARcoeff", 3e-5)).material == "Planted 1"


def test_filters_of_different_orders_are_refused(
    load: Callable[[str], HattTexture], hatt_xml: Xml
) -> None:
    both, plain = hatt_xml(), hatt_xml(moving_average=False)
    one = re.findall("<model>.*?</model>", plain)[0]
    mixed = re.sub("<model>.*?</model>", lambda m: one, both, count=1)
    with refused(InputError, names="Models_Planted 1.xml", expected="MAlsf", got="[0, 2]"):
        load(mixed)


@pytest.mark.parametrize("last", [(200, 0), (200, 0.000001)])
def test_triangles_without_area_are_refused(
    load: Callable[[str], HattTexture], hatt_xml: Xml, last: tuple[float, float]
) -> None:
    """A line to the six decimals of the file is a line."""
    text = hatt_xml(conditions=((0, 0), (100, 0), last, (0, 4)))
    corner = "<value>1</value><value>2</value><value>3</value>"
    line = re.sub(r"<tri .*</tri>", f'<tri type="array">{corner}</tri>', text, flags=re.DOTALL)
    with refused(InputError, names="Models_Planted 1.xml", expected=["triangle", "area"]):
        load(line)


def test_missing_file_is_named(tmp_path: Path) -> None:
    with refused(InputError, expected=tmp_path / "nowhere.xml", got="nothing"):
        load_hatt(tmp_path / "nowhere.xml")
