"""WAV files in recording sets, and what is refused of them."""

from __future__ import annotations

import json
from contextlib import nullcontext
from pathlib import Path

import numpy as np
import pytest
import soundfile

from tactileq.modeling import InputError, Recording, RecordingSet
from tactileq.modeling.files.wav import read_wav, samples_only
from tactileq.modeling.recordings.recording_set import recording_folders
from tests.refusals import refused

NOISE = np.random.default_rng(1).standard_normal(100)
SIDECAR = {"texture": "felt", "speed_mm_s": 80, "force_n": 1.5}


def write_wav(path: Path, samples: np.ndarray, rate_hz: int = 8000) -> None:
    soundfile.write(path, samples, rate_hz, subtype="FLOAT")


def test_wav_listed_in_an_index(tmp_path: Path) -> None:
    samples = (0.1 * NOISE).astype(np.float32)
    write_wav(tmp_path / "a.wav", samples)
    (tmp_path / "recordings.tsv").write_text(
        "file\ttexture\tspeed_mm_s\tforce_n\tg_per_fullscale\na.wav\tfelt\t80\t1.5\t50\n"
    )
    recording = RecordingSet.load(tmp_path).recordings[0]
    assert (recording.rate_hz, recording.unit) == (8000.0, "g")
    assert (recording.texture, recording.condition) == ("felt", (80.0, 1.5))
    assert np.array_equal(recording.samples, samples.astype(float) * 50)


def test_wav_with_a_json_sidecar(tmp_path: Path) -> None:
    write_wav(tmp_path / "a.wav", NOISE / 10)
    sidecar = {"texture": "felt", "speed_mm_s": 80, "force_n": 1.5, "simulated": True}
    (tmp_path / "a.json").write_text(json.dumps(sidecar))
    write_wav(tmp_path / "unlisted.wav", NOISE / 10)
    (recording,) = RecordingSet.load(tmp_path).recordings
    assert recording.unit == "arbitrary"
    assert recording.simulated
    assert recording.condition == (80.0, 1.5)
    assert recording.samples == pytest.approx(NOISE / 10, rel=1e-6)


@pytest.mark.parametrize("sidecar", ["", "[]", "{", '{"texture": "felt", "speed_mm_s": 80}'])
def test_damaged_sidecars_are_refused(tmp_path: Path, sidecar: str) -> None:
    write_wav(tmp_path / "a.wav", NOISE / 10)
    (tmp_path / "a.json").write_text(sidecar)
    with pytest.raises(InputError, match="expected"):
        RecordingSet.load(tmp_path)


def test_unusable_wav_files_are_refused(tmp_path: Path) -> None:
    (tmp_path / "a.json").write_text('{"texture": "felt", "speed_mm_s": 80, "force_n": 1}')
    write_wav(tmp_path / "a.wav", np.stack([NOISE, NOISE], axis=1) / 10)
    with refused(InputError, expected=tmp_path / "a.wav", got=[2, "--channel"]):
        RecordingSet.load(tmp_path)
    (tmp_path / "a.wav").write_bytes(b"RIFF nothing")
    with refused(InputError, expected="WAV", got=tmp_path / "a.wav"):
        RecordingSet.load(tmp_path)
    (tmp_path / "a.wav").write_bytes(b"")
    with refused(InputError, expected="WAV", got=[tmp_path / "a.wav", "empty"]):
        RecordingSet.load(tmp_path)


def test_null_in_a_sidecar_is_missing(tmp_path: Path) -> None:
    write_wav(tmp_path / "a.wav", NOISE / 10)
    optional = dict.fromkeys(("unit", "repeat", "simulated", "g_per_fullscale", "texture"))
    (tmp_path / "a.json").write_text(json.dumps({**SIDECAR, **optional}))
    (recording,) = RecordingSet.load(tmp_path).recordings
    assert (recording.texture, recording.unit) == (tmp_path.name, "arbitrary")
    assert (recording.repeat, recording.simulated) == (1, False)
    (tmp_path / "a.json").write_text(json.dumps({**SIDECAR, "speed_mm_s": None}))
    with pytest.raises(InputError, match=r"speed_mm_s, a\.json, got nothing"):
        RecordingSet.load(tmp_path)


def test_a_channel_named_in_a_list_or_a_sidecar(tmp_path: Path) -> None:
    channels = np.stack([NOISE, NOISE[::-1]], axis=1) / 10
    write_wav(tmp_path / "a.wav", channels)
    (tmp_path / "a.json").write_text(json.dumps({**SIDECAR, "channel": 2}))
    (by_sidecar,) = RecordingSet.load(tmp_path).recordings
    assert np.array_equal(by_sidecar.samples, channels[:, 1].astype(np.float32))
    (tmp_path / "recordings.tsv").write_text(
        "file\ttexture\tspeed_mm_s\tforce_n\tchannel\na.wav\tfelt\t80\t1.5\t1\n"
    )
    (by_list,) = RecordingSet.load(tmp_path).recordings
    assert np.array_equal(by_list.samples, channels[:, 0].astype(np.float32))
    (tmp_path / "a.json").write_text(json.dumps({**SIDECAR, "channel": 3}))
    (tmp_path / "recordings.tsv").unlink()
    with pytest.raises(InputError, match=r"a channel from 1 to 2 of .*a\.wav, got 3"):
        RecordingSet.load(tmp_path)


def test_sidecar_speaks_of_its_own_file(tmp_path: Path) -> None:
    write_wav(tmp_path / "a.wav", NOISE / 10)
    (tmp_path / "a.json").write_text(json.dumps({**SIDECAR, "file": "../b.wav"}))
    assert len(RecordingSet.load(tmp_path)) == 1


@pytest.mark.parametrize("scale", [0, -16, "nan", "inf"])
def test_meaningless_full_scale_is_refused(tmp_path: Path, scale: object) -> None:
    write_wav(tmp_path / "a.wav", NOISE / 10)
    (tmp_path / "a.json").write_text(json.dumps({**SIDECAR, "g_per_fullscale": scale}))
    with pytest.raises(InputError, match=r"above 0 g in column g_per_fullscale, a\.json"):
        RecordingSet.load(tmp_path)


@pytest.mark.parametrize("share", [0.3, 0.5, 0.9, 0.995])
@pytest.mark.parametrize("subtype", ["PCM_16", "PCM_24", "FLOAT"])
def test_cut_wav_is_refused(tmp_path: Path, subtype: str, share: float) -> None:
    path = tmp_path / "a.wav"
    soundfile.write(path, np.tile(NOISE / 10, 20), 8000, subtype=subtype)
    whole = path.read_bytes()
    path.write_bytes(whole[: int(share * len(whole))])
    with refused(InputError, expected=[path, f"{len(whole)} bytes"], got=path.stat().st_size):
        read_wav(path)


@pytest.mark.parametrize("size", [0, 0xFFFFFFFF, 0x7FFFF024])
def test_sizes_of_streaming_recorders_are_no_sizes(tmp_path: Path, size: int) -> None:
    path = tmp_path / "a.wav"
    soundfile.write(path, NOISE / 10, 8000, subtype="PCM_16")
    whole = path.read_bytes()
    path.write_bytes(whole[:4] + size.to_bytes(4, "little") + whole[8:])
    assert read_wav(path)[0].size == NOISE.size


def test_bytes_after_the_wav_are_no_harm(tmp_path: Path) -> None:
    path = tmp_path / "a.wav"
    soundfile.write(path, NOISE / 10, 8000, subtype="PCM_16")
    path.write_bytes(path.read_bytes() + b"tail")
    assert read_wav(path)[0].size == NOISE.size


def chunk(name: bytes, content: bytes) -> bytes:
    return name + len(content).to_bytes(4, "little") + content + bytes(len(content) % 2)


@pytest.mark.parametrize("subtype", ["PCM_24", "PCM_16", "FLOAT"])
def test_samples_only_leaves_nothing_but_the_sound(tmp_path: Path, subtype: str) -> None:
    """Whatever stands before, between and behind, of even and of odd length."""
    samples = np.linspace(-0.5, 0.5, 101)
    soundfile.write(tmp_path / "a.wav", samples, 8000, subtype=subtype)
    whole = (tmp_path / "a.wav").read_bytes()
    plain = samples_only(whole, tmp_path / "a.wav")
    noted = b"RIFF" + bytes(4) + b"WAVE" + chunk(b"bext", b"secret!") + whole[12:]
    noted += chunk(b"LIST", b"secret") + b"secret"
    assert samples_only(noted, tmp_path / "a.wav") == plain == samples_only(plain, Path("a.wav"))
    assert b"secret" not in plain
    (tmp_path / "b.wav").write_bytes(plain)
    for one, other in zip(read_wav(tmp_path / "a.wav"), read_wav(tmp_path / "b.wav"), strict=True):
        assert np.array_equal(one, other)


@pytest.mark.parametrize("data", [b"", b"RIFF", b"OggS" * 9, b"RIFF\0\0\0\0WAVE", b"x" * 99])
def test_samples_only_of_what_is_no_sound(data: bytes) -> None:
    with refused(InputError, expected="WAV", got="else", names="a.wav"):
        samples_only(data, Path("a.wav"))


def test_twins_of_wav_files_are_no_recordings(tmp_path: Path) -> None:
    """Nor are the folders that hold them alone."""
    for folder in (tmp_path / "felt", tmp_path / ".Trashes"):
        folder.mkdir()
        write_wav(folder / "a.wav", NOISE / 10)
        (folder / "a.json").write_text(json.dumps(SIDECAR))
        for name in ("._a.wav", "._a.json"):
            (folder / name).write_bytes(b"\0\5\x16\7")
    assert len(RecordingSet.load(tmp_path / "felt")) == 1
    assert recording_folders(tmp_path) == [tmp_path / "felt"]


@pytest.mark.parametrize(("name", "goes"), [("._0001.csv", True), (".notes", False)])
def test_what_systems_put_into_a_set_goes_with_it(tmp_path: Path, name: str, goes: bool) -> None:
    """A hidden file of somebody does not."""
    made = RecordingSet([Recording(NOISE, 8000.0, 80.0, 1.5, "felt")])
    made.save(tmp_path / "set")
    (tmp_path / "set" / name).write_bytes(b"\0\5\x16\7")
    with nullcontext() if goes else refused(InputError, got=name):
        made.save(tmp_path / "set")
    assert (tmp_path / "set" / name).exists() != goes
