"""Recordings as a real accelerometer leaves them: import, then model."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from numpy.typing import NDArray
from scipy.io import wavfile

from tactileq.modeling import Recording, RecordingSet, TextureModel
from tactileq.stimuli.planted.textures import planted_texture, record_texture

G_PER_FULLSCALE = 8.0
SPEEDS_MM_S = (60.0, 120.0, 180.0, 240.0, 300.0)


def vibration(speed_mm_s: float, force_n: float, *, rate_hz: float, seconds: float, seed: int):
    """A planted canvas at one condition, as an accelerometer of this rate sees it."""
    grid = {
        "speeds_mm_s": np.array([speed_mm_s, speed_mm_s + 1]),
        "forces_n": np.array([force_n, force_n + 1]),
    }
    records = record_texture(
        planted_texture("canvas", **grid, rate_hz=10_000.0), duration_s=seconds, seed=seed
    )
    return records.recordings[0].samples[:: round(10_000 / rate_hz)]


def write_wav(path: Path, samples: NDArray[np.float64]) -> None:
    wavfile.write(path, 10_000, np.round(samples / G_PER_FULLSCALE * 32767).astype(np.int16))


def write_grid_of_wavs(folder: Path, *, forces: tuple[float, ...], leave_out=()) -> Path:
    """WAV files of 1–3 s with a table of labels."""
    rows = ["file\tspeed_mm_s\tforce_n"]
    for number, (speed, force) in enumerate((v, f) for v in SPEEDS_MM_S for f in forces):
        if (speed, force) in leave_out:
            continue
        seconds = 1.0 + (number * 0.37) % 2
        name = f"run{number:02d}.wav"
        write_wav(
            folder / name,
            vibration(speed, force, rate_hz=10_000, seconds=seconds, seed=number),
        )
        rows.append(f"{name}\t{speed:g}\t{force:g}")
    table = folder / "labels.tsv"
    table.write_text("\n".join(rows) + "\n", encoding="utf-8")
    return table


def test_ten_files_at_one_force_give_models_of_that_force(main, tmp_path: Path) -> None:
    rows = ["file\ttexture\tspeed_mm_s\tforce_n"]
    for number in range(10):
        texture, speed = ("cloth A", "cloth B")[number % 2], SPEEDS_MM_S[number // 2]
        samples = vibration(speed, 1.0, rate_hz=10_000, seconds=1 + 0.2 * number, seed=number)
        write_wav(tmp_path / f"{number}.wav", samples)
        rows.append(f"{number}.wav\t{texture}\t{speed:g}\t1.0")
    (tmp_path / "labels.tsv").write_text("\n".join(rows) + "\n", encoding="utf-8")
    wavs = [f"{n}.wav" for n in range(10)]
    imported = main("import", "wav", *wavs, "--labels", "labels.tsv", "--out", "set")
    assert imported.returncode == 0, imported.stderr
    assert "unit is arbitrary" in imported.stdout
    fitted = main("model", "set", "--out", "models")
    assert fitted.returncode == 0, fitted.stderr
    for name in ("cloth A", "cloth B"):
        told = f"note: {name}: recorded at 1 N only; the model says nothing about other forces."
        assert told in fitted.stdout
    names = ("cloth-A", "cloth-B")
    tables = [
        pd.read_csv(tmp_path / f"models/{name}_{kind}.tsv", sep="\t")
        for kind in ("layers", "spectra")
        for name in names
    ]
    layers, spectra = pd.concat(tables[:2]), pd.concat(tables[2:])
    assert set(layers.texture) == {"cloth A", "cloth B"}
    assert len(layers.groupby(["texture", "speed_mm_s"])) == 10
    assert (layers.unit == "arbitrary").all()
    assert len(spectra.groupby(["texture", "speed_mm_s"])) == 10
    assert spectra.magnitude.gt(0).all()
    for name in ("cloth-A", "cloth-B"):
        model = TextureModel.load(tmp_path / f"models/{name}.json")
        assert model.noise_gains.shape == (5, 1)
    rendered = main("stimuli", "models/cloth-A.json", "--out", "wavs")
    assert rendered.returncode == 0, rendered.stderr


def test_repeats_of_a_condition_need_numbers(main, tmp_path: Path) -> None:
    for number in (1, 2):
        samples = vibration(100, 1, rate_hz=10_000, seconds=1, seed=number)
        write_wav(tmp_path / f"{number}.wav", samples)
    labels = ["--speed", 100, "--force", 1, "--texture", "oak", "--out", "set"]
    refused = main("import", "wav", "1.wav", "2.wav", *labels)
    assert refused.returncode == 1
    assert "expected one recording per condition" in refused.stderr
    assert not (tmp_path / "set").exists()
    (tmp_path / "labels.tsv").write_text(
        "file\tspeed_mm_s\tforce_n\trepeat\n1.wav\t100\t1\t1\n2.wav\t100\t1\t2\n"
    )
    taken = main("import", "wav", "1.wav", "2.wav", "--labels", "labels.tsv", "--out", "set")
    assert taken.returncode == 0, taken.stderr
    assert len(RecordingSet.load(tmp_path / "set")) == 2


def test_grid_with_holes_is_modelled_named_and_marked(main, tmp_path: Path) -> None:
    holes = {(120.0, 1.0), (240.0, 2.0)}
    table = write_grid_of_wavs(tmp_path, forces=(0.5, 1.0, 2.0), leave_out=holes)
    wavs = sorted(p.name for p in tmp_path.glob("*.wav"))
    options = ["--labels", table.name, "--texture", "canvas", "--out", "set"]
    imported = main("import", "wav", *wavs, *options, "--g-per-fullscale", G_PER_FULLSCALE)
    assert imported.returncode == 0, imported.stderr
    fitted = main("model", "set", "--out", "models")
    assert fitted.returncode == 0, fitted.stderr
    assert "120 mm/s at 1 N; 240 mm/s at 2 N" in fitted.stdout
    model = TextureModel.load(tmp_path / "models/canvas.json")
    assert (model.unit, model.rate_hz) == ("g", 5000.0)
    marked = {
        (float(model.speeds_mm_s[i]), float(model.forces_n[j]))
        for i, j in np.argwhere(model.interpolated)
    }
    assert marked == holes
    # The strongest layers of the truth are there: the weave (v/λ) and the one near 215 Hz.
    truth = planted_texture("canvas").peq(300.0, 2.0).frequencies_hz
    found = model.peq(300.0, 2.0).frequencies_hz
    assert np.abs(found - truth[0]).min() < 15
    simplified = main("simplify", "models/canvas.json", "--out", "fewer")
    assert simplified.returncode == 0, simplified.stderr
    assert TextureModel.load(tmp_path / "fewer/canvas.json").n_layers <= model.n_layers
    rendered = main("stimuli", "models/canvas.json", "fewer/canvas.json", "--out", "wavs")
    assert rendered.returncode == 0, rendered.stderr
    manifest = pd.read_csv(tmp_path / "wavs/manifest.tsv", sep="\t")
    assert set(manifest.model) == {"models", "fewer"}
    assert (manifest.simulated == False).all()  # noqa: E712 (a column of booleans)


def write_axes(path: Path, samples: NDArray[np.float64], rate_hz: float) -> None:
    time = np.arange(samples.size) / rate_hz
    rows = np.column_stack([time, 0.6 * samples, 0.8 * samples, 0.0 * samples + 1.0])
    lines = [",".join(f"{value:.9g}" for value in row) for row in rows]
    path.write_text("time_s,x_g,y_g,z_g\n" + "\n".join(lines) + "\n", encoding="utf-8")


def test_three_axis_csv_at_1_khz_says_which_band_is_lost(main, tmp_path: Path) -> None:
    for speed in (100, 200):
        for force in (1, 2):
            samples = vibration(speed, force, rate_hz=1000, seconds=2, seed=speed + force)
            name = f"{speed}_{force}.csv"
            write_axes(tmp_path / name, samples, 1000.0)
            labels = ["--speed", speed, "--force", force, "--texture", "felt", "--out", "set"]
            added = main("import", "csv", name, *labels, "--axis", "dft321")
            assert added.returncode == 0, added.stderr
    assert "1 recording added at 1000 Hz, 4 in set" in added.stdout
    fitted = main("model", "set")
    assert fitted.returncode == 0, fitted.stderr
    assert "the band from 500 to 2500 Hz is missing" in fitted.stdout
    model = TextureModel.load(tmp_path / "models/felt.json")
    assert model.rate_hz == 1000.0
    assert model.n_layers >= 1
    # z is constant (gravity): without it x and y hold 0.6² + 0.8² = 1 of the energy.
    stored = RecordingSet.load(tmp_path / "set").recordings[0].samples
    expected = vibration(100, 1, rate_hz=1000, seconds=2, seed=101)
    assert np.std(stored) == pytest.approx(np.std(expected), rel=0.02)


def test_clipping_is_accepted_with_its_share(main, tmp_path: Path) -> None:
    samples = np.clip(np.sin(2 * np.pi * 60 * np.arange(10_000) / 10_000) * 2, -1, 1)
    wavfile.write(tmp_path / "loud.wav", 10_000, np.round(samples * 32767).astype(np.int16))
    result = main("import", "wav", "loud.wav", "--speed", 100, "--force", 1, "--out", "set")
    assert result.returncode == 0
    # |2 sin| exceeds 1 for two thirds of the time.
    share = float(result.stderr.split("clipped in ")[1].split("%")[0])
    assert share == pytest.approx(66.7, abs=1.0)


def test_models_in_arbitrary_units_are_not_simplified(main, tmp_path: Path) -> None:
    records = record_texture(planted_texture("MDF"), duration_s=0.5)
    arbitrary = RecordingSet(
        Recording(r.samples, r.rate_hz, r.speed_mm_s, r.force_n, r.texture, unit="arbitrary")
        for r in records.recordings
    )
    arbitrary.save(tmp_path / "set")
    assert main("model", "set").returncode == 0
    refused = main("simplify", "models/MDF.json")
    assert refused.returncode == 1
    assert "got the unit 'arbitrary'" in refused.stderr
    assert not (tmp_path / "simplified").exists()
