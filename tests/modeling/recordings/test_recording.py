"""Recordings, sets of them, and what their folders refuse."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import soundfile
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from scipy.signal import butter, sosfilt

from tactileq.modeling import InputError, Recording, RecordingSet
from tactileq.modeling.errors import shown
from tactileq.modeling.recordings.recording_set import is_recording_set, load_usable, textures_in
from tests.refusals import check_refusal, refused

RecordingMaker = Callable[..., Recording]
NOISE = np.random.default_rng(1).standard_normal(100)


# --- one recording


@pytest.mark.parametrize(
    ("samples", "expected", "got"),
    [
        ([], ["64", "samples"], 0),
        (NOISE[:63], ["64", "samples"], 63),
        (np.zeros(100), "vibration", 0),
        (np.full(100, 0.3), "vibration", 0.3),
        (np.where(np.arange(100) == 7, np.nan, NOISE), "finite", [1, "NaN", "sample 7"]),
        (np.where(np.arange(100) > 97, np.inf, NOISE), "finite", [2, "infinite", "sample 98"]),
        (NOISE.reshape(2, 50), "axis", "(2, 50)"),
    ],
)
def test_unusable_samples_are_refused(
    make_recording: RecordingMaker, samples: np.ndarray, expected: object, got: object
) -> None:
    with refused(InputError, names="planted", expected=expected, got=got):
        make_recording(np.asarray(samples))


@pytest.mark.parametrize(
    ("labels", "expected", "got"),
    [
        ({"rate_hz": 0.0}, ["rate", 1, "10000000 Hz"], 0.0),
        ({"rate_hz": np.nan}, ["rate", 1, "10000000 Hz"], "nan"),
        ({"rate_hz": np.inf}, ["rate", 1, "10000000 Hz"], "inf"),
        ({"speed_mm_s": -1.0}, ["speed_mm_s", "0 mm/s", 100000], -1),
        ({"speed_mm_s": np.nan}, ["speed_mm_s", "0 mm/s", 100000], "nan"),
        ({"force_n": -0.1}, ["force_n", "0 N", 10000], -0.1),
        ({"force_n": np.inf}, ["force_n", "0 N", 10000], "inf"),
        ({"unit": "m/s2"}, ["unit", "g", "arbitrary"], "'m/s2'"),
        ({"texture": "  "}, "texture name", "' '"),
        ({"texture": "a\tb"}, "texture name", r"'a\tb'"),
        ({"texture": "a\nb"}, "texture name", r"'a\nb'"),
        ({"repeat": 0}, ["repeat", 1], 0),
        ({"clipped_share": -0.1}, ["clipped_share", 0, 1], -0.1),
        ({"clipped_share": np.inf}, ["clipped_share", 0, 1], "inf"),
    ],
)
def test_wrong_labels_are_refused(
    make_recording: RecordingMaker, labels: dict[str, object], expected: object, got: object
) -> None:
    with refused(InputError, expected=expected, got=got):
        make_recording(NOISE, **labels)


def test_samples_are_copied_and_frozen(make_recording: RecordingMaker) -> None:
    samples = NOISE.copy()
    recording = make_recording(samples, rate_hz=1000.0)
    samples[0] = 99.0
    assert recording.samples[0] == NOISE[0]
    with pytest.raises(ValueError, match="read-only"):
        recording.samples[0] = 1.0
    assert recording.duration_s == pytest.approx(0.1)
    assert recording.condition == (100.0, 1.0)


@pytest.mark.parametrize(
    "change",
    [
        {"rate_hz": 1.0},
        {"speed_mm_s": 2.0},
        {"force_n": 2.0},
        {"texture": "x"},
        {"unit": "arbitrary"},
        {"simulated": True},
        {"repeat": 2},
        {"clipped_share": 0.5},
    ],
)
def test_recordings_differ_in_every_label(
    make_recording: RecordingMaker, change: dict[str, object]
) -> None:
    assert make_recording(NOISE) == make_recording(NOISE)
    assert make_recording(NOISE) != make_recording(NOISE, **change)
    assert make_recording(NOISE) != make_recording(-NOISE)


def test_clipped_share_of_known_clipping(make_recording: RecordingMaker) -> None:
    t = np.arange(22704) / 22704
    sine = np.sin(2 * np.pi * 50 * t)
    clipped = np.clip(sine, -0.8, 0.8)
    expected = np.mean(np.abs(sine) >= 0.8)
    assert expected == pytest.approx(1 - 2 / np.pi * np.arcsin(0.8), abs=1e-3)
    assert make_recording(clipped).clipped_share == pytest.approx(expected, abs=1e-3)
    one_sided = np.minimum(sine, 0.8)
    assert make_recording(one_sided).clipped_share == pytest.approx(expected / 2, abs=1e-3)


STEPS_G = (0.0, 4 / 2**16, 0.001907349)  # float, 16 bit over ±2 g, the sensor's


def quantised(samples: np.ndarray, step_g: float) -> np.ndarray:
    return np.rint(samples / step_g) * step_g if step_g else samples


@pytest.mark.parametrize("step_g", STEPS_G)
@pytest.mark.parametrize("limit_in_sd", [3.0, 2.0, 1.5, 1.0, 0.3, 0.05])
def test_all_clipped_samples_of_noise_count(
    make_recording: RecordingMaker, limit_in_sd: float, step_g: float
) -> None:
    """0.27 % to 96 % beyond the limits, most of them single samples."""
    noise = 0.5 * np.random.default_rng(3).standard_normal(22704)
    limit = 0.5 * limit_in_sd
    expected = np.mean(np.abs(noise) >= limit)
    clipped = quantised(np.clip(noise, -limit, limit), step_g)
    share = make_recording(clipped).clipped_share
    # Samples within half a step of the limit read as the limit.
    assert expected <= share == pytest.approx(expected, rel=0.02, abs=2e-4)
    below = np.mean(noise <= -limit)
    one_sided = quantised(np.maximum(noise, -limit), step_g)
    assert make_recording(one_sided).clipped_share == pytest.approx(below, rel=0.02, abs=2e-4)


def test_rest_is_not_clipping(make_recording: RecordingMaker) -> None:
    impulse = np.zeros(5000)
    impulse[100:103] = 1.0, 3.0, 2.0
    taps = np.where(np.arange(5000) % 500 < 5, np.linspace(0.1, 3.0, 5000), 0.0)
    for line in (impulse, -impulse, taps, impulse + 0.98):
        assert make_recording(line).clipped_share == 0.0


@pytest.mark.parametrize("step_g", STEPS_G)
@pytest.mark.parametrize("seed", range(3))
def test_noise_is_not_clipped(make_recording: RecordingMaker, seed: int, step_g: float) -> None:
    noise = np.random.default_rng(seed).standard_normal(22704)
    assert make_recording(quantised(noise, step_g)).clipped_share == 0.0
    assert make_recording(noise.astype(np.float32)).clipped_share == 0.0


@pytest.mark.parametrize("rate_hz", [1000, 10_000, 22_704])
@pytest.mark.parametrize("amplitude", [1.0, 1.49, 2.499, 5.5, 20.3])
def test_tones_are_not_clipped(
    make_recording: RecordingMaker, rate_hz: int, amplitude: float
) -> None:
    """Also where the rate is a multiple of the frequency, so that every crest is the same."""
    t = np.arange(rate_hz) / rate_hz
    for frequency_hz in (7, 40.3, 50, 100, 125, 250):
        for phase in (0.0, 0.5, np.pi / 2):
            tone = amplitude * np.sin(2 * np.pi * frequency_hz * t + phase)
            assert make_recording(tone).clipped_share == 0.0
            assert make_recording(quantised(tone, 1.0)).clipped_share == 0.0


def test_given_share_wins_and_survives_the_disk(
    make_recording: RecordingMaker, tmp_path: Path
) -> None:
    recording = make_recording(NOISE, clipped_share=0.125)
    RecordingSet([recording]).save(tmp_path / "set")
    (loaded,) = RecordingSet.load(tmp_path / "set").recordings
    assert loaded.clipped_share == recording.clipped_share == 0.125


def test_index_without_shares_has_them_counted(
    make_recording: RecordingMaker, tmp_path: Path
) -> None:
    recording = make_recording(np.clip(np.random.default_rng(0).standard_normal(1000), -1, 1))
    RecordingSet([recording]).save(tmp_path / "set")
    edit(tmp_path / "set/recordings.tsv", "clipped_share", "remark")
    (loaded,) = RecordingSet.load(tmp_path / "set").recordings
    assert loaded.clipped_share == recording.clipped_share > 0.3


@pytest.mark.parametrize("step_g", [0.001907349, 0.05, 0.3])
def test_quantised_noise_is_not_clipped(make_recording: RecordingMaker, step_g: float) -> None:
    for seed in range(5):
        noise = 0.2 * np.random.default_rng(seed).standard_normal(22704)
        assert make_recording(np.rint(noise / step_g) * step_g).clipped_share == 0.0


@pytest.mark.parametrize("amplitude_g", [0.0039, 0.01, 0.0488, 0.05, 0.5])
def test_quantised_smooth_vibration_is_not_clipped(
    make_recording: RecordingMaker, amplitude_g: float
) -> None:
    """A slow crest stays on its highest level for many samples without any clipping."""
    t = np.arange(22704) / 22704
    rng = np.random.default_rng(0)
    tone = amplitude_g * np.sin(2 * np.pi * 40.3 * t)
    sections = butter(2, [30, 50], "bandpass", fs=22704, output="sos")
    narrow = sosfilt(sections, rng.standard_normal(22704))
    narrow *= amplitude_g / np.abs(narrow).max()
    for smooth in (tone, narrow):
        assert make_recording(quantised(smooth, 0.001907349)).clipped_share == 0.0
    if amplitude_g >= 0.5:
        limited = np.clip(tone, -0.9 * amplitude_g, 0.9 * amplitude_g)
        expected = 1 - 2 / np.pi * np.arcsin(0.9)
        share = make_recording(quantised(limited, 0.001907349)).clipped_share
        assert share == pytest.approx(expected, abs=0.01)


# --- sets


def test_set_needs_a_recording() -> None:
    with refused(InputError, expected="recording", got="none"):
        RecordingSet([])


def test_two_files_for_a_condition_are_refused(make_recording: RecordingMaker) -> None:
    with refused(InputError, expected="condition", got=["planted", "100 mm/s", "1 N"]):
        RecordingSet([make_recording(seed=0), make_recording(seed=1)])
    assert len(RecordingSet([make_recording(), make_recording(repeat=2)])) == 2
    assert len(RecordingSet([make_recording(), make_recording(texture="other")])) == 2


@pytest.mark.parametrize(
    ("speed_mm_s", "force_n"), [(100.00000001, 1.0), (100.0, 1 + 2e-16), (99.99999, 0.9999999)]
)
def test_conditions_that_differ_by_rounding_are_refused(
    make_recording: RecordingMaker, speed_mm_s: float, force_n: float
) -> None:
    """They would span a grid of 2 x 2 that nobody recorded; a repeat's number is no excuse."""
    first = make_recording()
    other = make_recording(speed_mm_s=speed_mm_s, force_n=force_n, repeat=2)
    got = [f"{speed_mm_s!r} mm/s", f"{force_n!r} N", "100.0 mm/s", "1.0 N"]
    with refused(InputError, names=["'planted'", "repeat"], expected="rounding", got=got):
        RecordingSet([make_recording(force_n=2.0), first, other])


def test_conditions_that_differ_in_one_value_are_two(make_recording: RecordingMaker) -> None:
    others = [
        {"speed_mm_s": 100.001},
        {"speed_mm_s": 100.0000001, "force_n": 2.0},
        {"speed_mm_s": 100.0000001, "texture": "other"},
    ]
    for other in others:
        assert len(RecordingSet([make_recording(), make_recording(**other)])) == 2


def test_only_texture(make_recording: RecordingMaker) -> None:
    both = RecordingSet([make_recording(texture="b"), make_recording(texture="a")])
    assert both.textures == ("b", "a")
    with refused(InputError, expected="texture", got="b, a"):
        _ = both.texture
    assert both.of_texture("a").texture == "a"


@st.composite
def recording_sets(draw: st.DrawFn) -> RecordingSet:
    names = st.text(st.characters(exclude_categories=["Cs"]), min_size=1, max_size=6).filter(
        lambda name: name.strip() and name.isprintable()
    )
    # Conditions that differ by rounding only are refused: five digits, and all bits behind them.
    values = st.floats(0, 1e4).map(lambda value: float(f"{value:.4e}") / 3)
    recordings = []
    for number in range(draw(st.integers(1, 3))):
        samples = draw(
            hnp.arrays(float, 64, elements=st.floats(allow_nan=False, allow_infinity=False))
        )
        samples[:2] = 0.1, -0.2
        recordings.append(
            Recording(
                np.clip(samples, -1e100, 1e100),
                draw(st.floats(1.0, 1e6)),
                draw(values),
                draw(values),
                draw(names),
                unit=draw(st.sampled_from(["g", "arbitrary"])),
                simulated=draw(st.booleans()),
                repeat=number + 1,
            )
        )
    return RecordingSet(recordings)


@settings(deadline=None, max_examples=50)
@given(recordings=recording_sets())
def test_folder_loads_back_equal(
    recordings: RecordingSet, tmp_path_factory: pytest.TempPathFactory
) -> None:
    folder = tmp_path_factory.mktemp("set") / "recordings"
    recordings.save(folder)
    assert RecordingSet.load(folder) == recordings
    assert len(list(folder.iterdir())) == len(recordings) + 1


def test_values_that_come_again_keep_their_bits(
    make_recording: RecordingMaker, tmp_path: Path
) -> None:
    steps = np.round(NOISE / 0.01) * 0.01  # of a sensor; some are −0.0
    steps[:2] = -0.0, 0.0
    assert np.unique(steps).size < steps.size
    RecordingSet([make_recording(steps)]).save(tmp_path / "set")
    (loaded,) = RecordingSet.load(tmp_path / "set")
    assert loaded.samples.tobytes() == steps.tobytes()
    lines = (tmp_path / "set/0001.csv").read_text().splitlines()
    assert lines[1:] == [repr(value) for value in steps.tolist()]


# --- folders


@pytest.fixture
def folder(tmp_path: Path, make_recording: RecordingMaker) -> Path:
    """A sound folder of two recordings, to be damaged."""
    target = tmp_path / "recordings"
    RecordingSet([make_recording(NOISE), make_recording(-NOISE, force_n=2.0)]).save(target)
    return target


def edit(path: Path, old: str, new: str) -> None:
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new, 1), encoding="utf-8")


def header_and(lines: list[str]) -> str:
    return "\n".join(["acceleration_g", *lines]) + "\n"


@pytest.mark.parametrize(
    ("content", "expected", "got"),
    [
        ("", "header", "empty"),
        ("acceleration_g\n", "64", 0),
        (
            header_and([repr(x) for x in NOISE.tolist()])[:-5],
            "line",
            shown(repr(NOISE[-1].item())[:-4]),
        ),
        (header_and(["0.1"] * 100), "vibration", 0.1),
        (header_and(["nan", *map(str, NOISE)]), "finite", [1, "NaN", "sample 0"]),
        (header_and([*map(str, NOISE), "inf"]), "finite", [1, "infinite", "sample 100"]),
        (header_and([*map(str, NOISE), ""]), "number", "''"),
        (header_and([f"{x},{x}" for x in NOISE]), "number", f"'{NOISE[0]},{NOISE[0]}'"),
        (header_and(["loud"] * 100), "number", "'loud'"),
        ("\n".join(map(str, NOISE)) + "\n", ["header", "acceleration_g"], NOISE[0]),
    ],
)
def test_damaged_csv_is_refused_by_name(
    folder: Path, content: str, expected: object, got: object
) -> None:
    (folder / "0002.csv").write_text(content, encoding="utf-8")
    with refused(InputError, names="0002.csv", expected=expected, got=got):
        RecordingSet.load(folder)


def test_csv_of_other_bytes_is_refused(folder: Path) -> None:
    (folder / "0002.csv").write_bytes(bytes(range(128, 256)) * 10)
    with refused(InputError, expected=["text", folder / "0002.csv"], got="bytes"):
        RecordingSet.load(folder)


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ("\t100.0\t2.0", "\t100.0\t1.0", "one recording per condition"),
        ("\t2.0\t5000.0\tg", "\t2.0\t5000.0\tm/s2", "unit among g, arbitrary"),
        ("\t2.0\t5000.0\tg", "\t2.0\t\tg", "rate_hz, row 0002.csv .* got nothing"),
        ("rate_hz", "operator", "rate_hz, row 0001.csv .* got nothing"),
        ("0002.csv", "0003.csv", "0003.csv"),
        ("0002.csv", "0001.csv", "each file once in .*, got '0001.csv' twice"),
    ],
)
def test_damaged_index_is_refused(folder: Path, old: str, new: str, sentence: str) -> None:
    edit(folder / "recordings.tsv", old, new)
    with pytest.raises(InputError, match=sentence):
        RecordingSet.load(folder)


def test_only_the_row_with_an_impossible_speed_is_left_out(folder: Path) -> None:
    column, got = "speed_mm_s", "'nan'"
    edit(folder / "recordings.tsv", "\t100.0\t2.0", "\tnan\t2.0")
    names = [folder / "recordings.tsv", "row 0002.csv"]
    with refused(InputError, names=names, expected=column, got=got):
        RecordingSet.load(folder)
    kept, (sentence,) = load_usable(folder)
    assert len(kept) == 1
    check_refusal(sentence, names=names, expected=column, got=got)


def test_impossible_speeds_of_sidecars_are_refused_by_name(tmp_path: Path) -> None:
    soundfile.write(tmp_path / "a.wav", NOISE / 10, 8000)
    (tmp_path / "a.json").write_text('{"speed_mm_s": NaN, "force_n": 1.0}')
    with refused(InputError, names="a.json", expected="speed_mm_s", got="nan"):
        RecordingSet.load(tmp_path)


@pytest.mark.parametrize(
    ("content", "got"),
    [(b"", "empty"), (b"\n\n", "empty"), (b"\xff\xfe\xff", "bytes"), (b"# comment\n", "empty")],
)
def test_index_that_is_none_is_refused(folder: Path, content: bytes, got: str) -> None:
    (folder / "recordings.tsv").write_bytes(content)
    with refused(InputError, names=folder / "recordings.tsv", got=got):
        RecordingSet.load(folder)


def test_index_without_rows_is_refused(folder: Path) -> None:
    index = folder / "recordings.tsv"
    index.write_text(index.read_text().split("\n")[0] + "\n")
    with refused(InputError, expected="recording", got="none"):
        RecordingSet.load(folder)


def test_unit_left_out_means_arbitrary(folder: Path) -> None:
    edit(folder / "recordings.tsv", "unit", "remark")
    assert {r.unit for r in RecordingSet.load(folder).recordings} == {"arbitrary"}


def test_folders_that_are_none_are_refused(tmp_path: Path) -> None:
    with refused(InputError, expected="folder", got=tmp_path / "nowhere"):
        RecordingSet.load(tmp_path / "nowhere")
    (tmp_path / "file").write_text("x")
    with refused(InputError, expected="folder", got=tmp_path / "file"):
        RecordingSet.load(tmp_path / "file")
    with refused(InputError, expected=["recordings.tsv", tmp_path], got="tactileq import"):
        RecordingSet.load(tmp_path)


# --- saving


def snapshot(folder: Path) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


@pytest.mark.parametrize(
    "broken", ["tactileq.modeling.recordings.recording_set.write_samples", "pathlib.Path.rename"]
)
def test_failed_save_leaves_the_old_folder(
    folder: Path,
    make_recording: RecordingMaker,
    monkeypatch: pytest.MonkeyPatch,
    broken: str,
) -> None:
    before = snapshot(folder.parent)

    def fail(*_: object) -> None:
        raise OSError("disk full")

    with monkeypatch.context() as patch:
        patch.setattr(broken, fail)
        with pytest.raises(OSError, match="disk full"):
            RecordingSet([make_recording()]).save(folder)
    assert snapshot(folder.parent) == before
    assert list(folder.parent.iterdir()) == [folder]


def test_failed_swap_puts_the_old_folder_back(
    folder: Path, make_recording: RecordingMaker, monkeypatch: pytest.MonkeyPatch
) -> None:
    before, rename = snapshot(folder.parent), Path.rename

    def fail_for_the_new_one(self: Path, target: Path) -> Path:
        if target == folder and self.suffix != ".old":
            raise OSError("disk full")
        return rename(self, target)

    monkeypatch.setattr(Path, "rename", fail_for_the_new_one)
    with pytest.raises(OSError, match="disk full"):
        RecordingSet([make_recording()]).save(folder)
    assert snapshot(folder.parent) == before
    assert list(folder.parent.iterdir()) == [folder]


def test_save_replaces_an_older_set_whole(folder: Path, make_recording: RecordingMaker) -> None:
    fewer = RecordingSet([make_recording(texture="new")])
    fewer.save(folder)
    assert RecordingSet.load(folder) == fewer
    assert sorted(p.name for p in folder.iterdir()) == ["0001.csv", "recordings.tsv"]
    assert list(folder.parent.iterdir()) == [folder]


def test_foreign_folders_are_not_replaced(tmp_path: Path, make_recording: RecordingMaker) -> None:
    (tmp_path / "notes.txt").write_text("mine")
    with refused(InputError, got=[tmp_path, "notes.txt"]):
        RecordingSet([make_recording()]).save(tmp_path)
    with refused(InputError, expected="folder", got=tmp_path / "notes.txt"):
        RecordingSet([make_recording()]).save(tmp_path / "notes.txt")
    assert snapshot(tmp_path) == {"notes.txt": b"mine"}


def test_one_texture_of_a_folder_is_read_and_the_others_are_left_alone(tmp_path: Path) -> None:
    noise = np.random.default_rng(8).normal(0, 0.1, 200)
    oak, elm = (Recording(noise, 5000.0, 100.0, 1.0, name) for name in ("oak", "elm"))
    RecordingSet([oak, elm]).save(tmp_path / "set")
    assert textures_in(tmp_path / "set") == ("oak", "elm")
    assert is_recording_set(tmp_path / "set")
    assert not is_recording_set(tmp_path)
    (tmp_path / "set/0001.csv").write_text("")
    assert RecordingSet.load(tmp_path / "set", texture="elm").recordings == (elm,)
    with refused(InputError, expected=tmp_path / "set/0001.csv", got="empty"):
        RecordingSet.load(tmp_path / "set", texture="oak")
    with refused(InputError, expected=["'ash'", tmp_path / "set"], got="none"):
        RecordingSet.load(tmp_path / "set", texture="ash")
