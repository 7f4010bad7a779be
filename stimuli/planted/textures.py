"""Seven textures whose layers are known exactly, and their recording in silico.

They carry the names of the paper's seven samples and 25 layers in all, but nothing in them was
measured: they are truth by decree, against which estimators are tested. Levels and their growth are
of the size that tool-on-surface recordings of like materials show (0.02–0.3 g RMS, growing with
speed).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import astuple, dataclass

import numpy as np
from numpy.typing import ArrayLike

from tactileq.modeling import PEQ, InputError, Recording, RecordingSet, TextureModel, render_many
from tactileq.modeling.arrays import Floats
from tactileq.modeling.checks import check_duration
from tactileq.modeling.equalizer.bands import band_rms
from tactileq.modeling.errors import shown
from tactileq.modeling.models.grid import Condition
from tactileq.modeling.recordings.spectrum import MODEL_RATE_HZ
from tactileq.modeling.seeds import noise_seed

SPEEDS_MM_S = np.linspace(50.0, 350.0, 7)
FORCES_N = np.linspace(0.5, 3.5, 7)
RECORDER_RATE_HZ = 22704.0
REFERENCE_SPEED_MM_S = 200.0
REFERENCE_FORCE_N = 2.0
SENSOR_STEP_G = 0.001907349
SENSOR_LIMIT_G = 50.0
SETTLING_S = 0.5


@dataclass(frozen=True)
class PlantedLayer:
    """One layer at 200 mm/s and 2 N, and how it changes with speed v and force F.

    Parameters
    ----------
    frequency_hz : float
        Grows as (v/200)^speed_law; a law of 1 is a spatial wavelength of 200/frequency_hz mm.
    bandwidth_hz : float
        Constant.
    rms_g : float
        Level of the layer alone at 5 kHz, which sets its peak gain; grows as
        (v/200)^growth_speed · (F/2)^growth_force.
    sign : {1, -1}
        Of the gain, over the whole texture.
    """

    frequency_hz: float
    speed_law: float
    bandwidth_hz: float
    rms_g: float
    sign: int
    growth_speed: float
    growth_force: float


@dataclass(frozen=True)
class PlantedTexture:
    """Layers and noise (RMS in g over 0–2.5 kHz at 200 mm/s) of one planted texture."""

    noise_g: float
    layers: tuple[PlantedLayer, ...]


CATALOGUE = {
    "aluminum": PlantedTexture(
        0.020,
        (
            PlantedLayer(80, 1.0, 30, 0.036, 1, 0.5, 0.2),
            PlantedLayer(290, 0.05, 30, 0.015, 1, 0.5, 0.1),
            PlantedLayer(700, 0.05, 110, 0.035, -1, 0.5, 0.2),
        ),
    ),
    "canvas": PlantedTexture(
        0.030,
        (
            PlantedLayer(52, 1.0, 25, 0.060, 1, 0.5, 0.35),
            PlantedLayer(215, 0.1, 35, 0.050, -1, 0.5, 0.2),
            PlantedLayer(345, 0.03, 35, 0.022, -1, 0.5, 0.1),
            PlantedLayer(760, 0.05, 120, 0.050, 1, 0.5, 0.2),
        ),
    ),
    "leather": PlantedTexture(
        0.016,
        (
            PlantedLayer(42, 1.0, 20, 0.036, 1, 0.4, 0.3),
            PlantedLayer(150, 0.05, 25, 0.026, 1, 0.4, 0.2),
            PlantedLayer(255, 0.04, 30, 0.012, 1, 0.4, 0.1),
            PlantedLayer(365, 0.03, 35, 0.017, 1, 0.4, 0.1),
        ),
    ),
    "MDF": PlantedTexture(
        0.020,
        (
            PlantedLayer(75, 1.0, 35, 0.045, 1, 0.5, 0.2),
            PlantedLayer(320, 0.05, 40, 0.019, -1, 0.5, 0.1),
            PlantedLayer(900, 0.05, 150, 0.045, 1, 0.5, 0.2),
        ),
    ),
    "polyester": PlantedTexture(
        0.030,
        (
            PlantedLayer(57, 1.0, 25, 0.056, 1, 0.5, 0.35),
            PlantedLayer(226, 0.1, 35, 0.048, -1, 0.5, 0.2),
            PlantedLayer(354, 0.03, 35, 0.022, -1, 0.5, 0.1),
            PlantedLayer(800, 0.05, 120, 0.050, 1, 0.5, 0.2),
        ),
    ),
    "PVC": PlantedTexture(
        0.014,
        (
            PlantedLayer(40, 1.0, 18, 0.028, 1, 0.4, 0.2),
            PlantedLayer(160, 0.05, 25, 0.022, 1, 0.4, 0.2),
            PlantedLayer(265, 0.04, 30, 0.011, 1, 0.4, 0.1),
            PlantedLayer(372, 0.02, 35, 0.015, 1, 0.4, 0.1),
        ),
    ),
    "wall paper": PlantedTexture(
        0.020,
        (
            PlantedLayer(40, 1.0, 20, 0.090, 1, 0.4, 0.4),
            PlantedLayer(175, 0.1, 30, 0.045, 1, 0.4, 0.2),
            PlantedLayer(300, 0.05, 40, 0.016, 1, 0.4, 0.1),
        ),
    ),
}
TEXTURES: tuple[str, ...] = tuple(CATALOGUE)
# The published noise gain falls with speed (PAPER table 2, negative alpha 1).
NOISE_GROWTH_SPEED = -0.1


def planted_texture(
    name: str,
    *,
    speeds_mm_s: Floats = SPEEDS_MM_S,
    forces_n: Floats = FORCES_N,
    rate_hz: float = MODEL_RATE_HZ,
) -> TextureModel:
    """One planted texture as a model (estimator "planted", simulated) at one rate.

    Frequency, −3 dB width and peak gain of a layer mean the same at every rate; its skirts do not,
    since the filter warps less at a higher one. So the truth of a recording is the texture at the
    recorder's rate, and the texture at 5 kHz is what a model of that rate renders.

    Parameters
    ----------
    name : str
        One of `TEXTURES`.
    speeds_mm_s, forces_n : (S,), (F,) ndarray
        The grid, rising, > 0; 50…350 mm/s × 0.5…3.5 N by default.
    rate_hz : float
        Where its layers are defined, more than about twice the highest frequency.

    Raises
    ------
    InputError
        For a name that is not in the catalogue; for a rate that is too low for its layers.
    """
    if name not in CATALOGUE:
        raise InputError(
            f"expected a planted texture among {', '.join(TEXTURES)}, got {shown(name)}; choose "
            "one."
        )
    speed, force = np.meshgrid(speeds_mm_s, forces_n, indexing="ij")
    noise_gains, frequencies, bandwidths, gains = _parameters(CATALOGUE[name], speed, force)
    at_5_khz = TextureModel(
        texture=name,
        rate_hz=MODEL_RATE_HZ,
        speeds_mm_s=np.asarray(speeds_mm_s),
        forces_n=np.asarray(forces_n),
        noise_gains=noise_gains,
        frequencies_hz=frequencies,
        bandwidths_hz=bandwidths,
        gains=gains,
        level_sd_db=np.zeros(gains.shape),
        estimator="planted",
        simulated=True,
        blending="logarithmic",
    )
    return at_5_khz.at_rate(rate_hz)


def _parameters(
    planted: PlantedTexture, speed_mm_s: Floats, force_n: Floats
) -> tuple[Floats, Floats, Floats, Floats]:
    """Noise gain (…), frequencies, widths and gains (…, m) at speeds and forces (…), at 5 kHz."""
    v = np.asarray(speed_mm_s / REFERENCE_SPEED_MM_S)[..., None]
    f = np.asarray(force_n / REFERENCE_FORCE_N)[..., None]
    frequency, speed_law, bandwidth, rms_g, sign, growth_speed, growth_force = np.array(
        [astuple(layer) for layer in planted.layers], dtype=np.float64
    ).T
    # Gain of a layer of 1 g RMS, the inverse of the PEQ's band variance.
    per_rms = 1 / band_rms(1.0, bandwidth, rate_hz=MODEL_RATE_HZ)
    gains = sign * rms_g * per_rms * v**growth_speed * f**growth_force
    noise_gain = planted.noise_g * v[..., 0] ** NOISE_GROWTH_SPEED
    return noise_gain, frequency * v**speed_law, np.broadcast_to(bandwidth, gains.shape), gains


@dataclass(frozen=True)
class PlantedSurface:
    """A planted texture at the recorder's rate: its spectrum at any speed and force, by formula."""

    texture: str

    def magnitude(self, frequency_hz: ArrayLike, *, speed_mm_s: float, force_n: float) -> Floats:
        """True magnitude (n,) in g per unit noise at 5 kHz; speed and force above 0."""
        planted = CATALOGUE[self.texture]
        noise_gain, frequencies, bandwidths, gains = _parameters(
            planted, np.asarray(speed_mm_s), np.asarray(force_n)
        )
        # Gains per unit noise at 5 kHz, bands at the recorder's rate.
        here = PEQ(
            noise_gain=float(noise_gain),
            frequencies_hz=frequencies,
            bandwidths_hz=bandwidths,
            gains=gains,
            rate_hz=RECORDER_RATE_HZ,
        )
        return here.response(frequency_hz)


def record_texture(truth: TextureModel, *, duration_s: float = 1.0, seed: int = 0) -> RecordingSet:
    """Record a texture in silico, one record per condition of its grid, at the truth's own rate.

    The noise floor reaches to the Nyquist frequency; the sensor's step (0.001907349 g) and range
    (±50 g) are those of the recorder's accelerometer.

    Parameters
    ----------
    truth : TextureModel
        At the recorder's rate: `planted_texture(name, rate_hz=RECORDER_RATE_HZ)`.
    duration_s : float
        Length of each record, > 0; ten million samples at most.
    seed : int
        Each texture and each condition has its own stream of noise under this seed.

    Returns
    -------
    RecordingSet
        All marked `simulated`.
    """
    check_duration(duration_s, truth.rate_hz)
    conditions = [(v, f) for v in truth.speeds_mm_s.tolist() for f in truth.forces_n.tolist()]
    vibrations = _vibrations(
        [truth] * len(conditions),
        conditions,
        duration_s=duration_s,
        seed=noise_seed(seed, truth.texture),  # two textures under one seed must not share noise
        streams=range(len(conditions)),
    )
    return RecordingSet(
        [
            Recording(g, truth.rate_hz, *condition, truth.texture, simulated=True)
            for g, condition in zip(vibrations, conditions, strict=True)
        ]
    )


def vibration_at(
    texture: str,
    condition: Condition,
    *,
    rate_hz: float = RECORDER_RATE_HZ,
    duration_s: float = 1.0,
    seed: int = 0,
    stream: int = 0,
) -> Floats:
    """What the accelerometer reports, (n,) in g, at a speed (mm/s) and a force (N), both above 0.

    As `record_texture`, but of the planted texture at exactly this condition, on its grid or not.

    Parameters
    ----------
    stream : int
        Another one for other noise under the same seed.
    """
    check_duration(duration_s, rate_hz)
    speeds, forces = (np.array([value]) for value in condition)
    truth = planted_texture(texture, speeds_mm_s=speeds, forces_n=forces, rate_hz=rate_hz)
    seeds = noise_seed(seed, texture)
    return _vibrations([truth], [condition], duration_s=duration_s, seed=seeds, streams=[stream])[0]


def _vibrations(
    truths: Sequence[TextureModel],
    conditions: Sequence[Condition],
    *,
    duration_s: float,
    seed: int,
    streams: Sequence[int],
) -> list[Floats]:
    """What the accelerometer reports of each truth, at its condition, once it has settled."""
    rate_hz = truths[0].rate_hz
    settling, samples = round(SETTLING_S * rate_hz), round(duration_s * rate_hz)
    held = {value: np.full(settling + samples, value) for each in conditions for value in each}
    vibrations = render_many(
        truths,
        [(held[speed], held[force]) for speed, force in conditions],
        seeds=[seed] * len(truths),
        streams=streams,
    )
    return [sensed(g[settling:]) for g in vibrations]


def sensed(acceleration_g: Floats) -> Floats:
    """What the accelerometer reports of (n,) g: whole steps, limited to its range."""
    steps = np.rint(np.clip(acceleration_g, -SENSOR_LIMIT_G, SENSOR_LIMIT_G) / SENSOR_STEP_G)
    reported: Floats = np.round(steps * SENSOR_STEP_G, 9)
    return reported
