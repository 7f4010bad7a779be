"""The manifest of a stimulus set, which `stimuli` writes and `rig` reads: its columns."""

from __future__ import annotations

from math import inf

from tactileq.modeling.files.columns import ABOVE_0, Column

MANIFEST = "manifest.tsv"
STIMULUS_COLUMNS = (
    Column("file", description="name of the WAV file", required=True),
    Column("texture", description="texture of the model", required=True),
    Column("model", description="label of the model in the recipe", required=True),
    Column(
        "layers",
        description="number of layers; n/a for an autoregressive model",
        limits=(0, inf),
        whole=True,
    ),
    Column(
        "model_rate_hz",
        unit="Hz",
        description="rate of the model; above half of it the file has no content",
        limits=(ABOVE_0, inf),
        required=True,
    ),
    Column("trajectory", description="name of the trajectory in the recipe", required=True),
    Column(
        "speed_mm_s",
        unit="mm/s",
        description="speed where it is constant, else n/a",
        limits=(-inf, inf),
    ),
    Column(
        "force_n", unit="N", description="force where it is constant, else n/a", limits=(-inf, inf)
    ),
    Column(
        "rate_hz",
        unit="Hz",
        description="sampling rate of the file",
        limits=(ABOVE_0, inf),
        required=True,
    ),
    Column(
        "duration_s",
        unit="s",
        description="length of the file",
        limits=(ABOVE_0, inf),
        required=True,
    ),
    Column("seed", description="seed of the noise", limits=(-inf, inf), whole=True, required=True),
    Column(
        "stream",
        description="stream of the noise under that seed; equal where the noise is frozen",
        limits=(-inf, inf),
        whole=True,
        required=True,
    ),
    Column(
        "unit",
        description="unit of rms and peak: g, or arbitrary where the recordings were not "
        "calibrated",
        required=True,
    ),
    Column(
        "format",
        description="float32 (samples in the unit) or pcm24 (samples in shares of full_scale_g)",
        required=True,
    ),
    Column("bits", description="bits per sample", limits=(1, inf), whole=True, required=True),
    Column(
        "full_scale_g",
        description="value of a full-scale sample of a pcm24 file in the unit, else n/a",
        limits=(ABOVE_0, inf),
    ),
    Column(
        "gain_db",
        unit="dB",
        description="gain applied to the model's output",
        limits=(-inf, inf),
        required=True,
    ),
    Column(
        "rms",
        description="RMS over the file without its fades (the first and last 10 ms); of a "
        "compensated file, of the vibration meant at the hand, before the "
        "compensation",
        limits=(0, inf),
        required=True,
    ),
    Column(
        "level_db",
        unit="dB",
        description="the same in dB re 1 g (re 1 where the unit is arbitrary)",
        limits=(-inf, inf),
        silence=True,
    ),
    Column(
        "sensation_level_db",
        unit="dB",
        description="threshold-weighted RMS after the gain in dB above threshold, over the "
        "same part at the model's rate, before any compensation; n/a where "
        "loudness was not matched",
        limits=(-inf, inf),
        silence=True,
    ),
    Column(
        "share_without_threshold",
        description="share of the power at frequencies without a known threshold, which the "
        "sensation level leaves out; n/a where loudness was not matched",
        limits=(0, 1),
    ),
    Column(
        "peak",
        description="largest absolute sample of the file, compensated or not",
        limits=(0, inf),
        required=True,
    ),
    Column(
        "crest_db",
        unit="dB",
        description="peak over RMS; of a compensated file, of the vibration meant at the hand",
        limits=(-inf, inf),
    ),
    Column("sha256", description="SHA-256 of the file", required=True),
    Column("model_sha256", description="SHA-256 of the model's file", required=True),
    Column("recipe_sha256", description="SHA-256 of recipe.toml in this folder", required=True),
    Column(
        "threshold_sha256",
        description="SHA-256 of the threshold's values (`Threshold.sha256`); n/a where "
        "loudness was not matched",
    ),
    Column(
        "vibrator",
        description="compensated: the file is the drive for the vibrator of "
        "sources/vibrator.json, whose vibration is then the one meant at the "
        "hand, times the flat gain in that file; n/a: the file is the vibration "
        "itself",
    ),
    Column("vibrator_sha256", description="SHA-256 of the vibrator's file; n/a without"),
    Column(
        "simulated",
        description="true where the recordings behind the model, or the test of the vibrator,"
        " were simulated",
        required=True,
    ),
)
