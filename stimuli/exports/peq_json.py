"""A model's equalizer as JSON for other programs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from tactileq.modeling import InputError
from tactileq.modeling.equalizer.peq import PEQ
from tactileq.modeling.files.documents import dump_json
from tactileq.modeling.files.writing import write_text
from tactileq.modeling.models.loading import AnyModel
from tactileq.stimuli.exports.layered import Layered, check_layered

JSON_FORMAT = "tactileq.peq"
JSON_VERSION = 1
DEFINITION = (
    "output = noise_gain*w + the sum over layers of gain*H(w), in unit; one white noise w of unit "
    "variance at rate_hz drives all branches; H(z) = (b0 + b1/z + b2/z^2) / (a0 + a1/z + a2/z^2) "
    "is the band-pass of peak gain 1 at frequency_hz and -3 dB width bandwidth_hz; gains are "
    "signed; at another rate w needs the variance rate/rate_hz, the noise_gain branch a low-pass "
    "at rate_hz/2, and H new coefficients; b and a are for a condition that is held"
)


def write_peq_json(
    path: str | Path,
    model: AnyModel,
    *,
    speed_mm_s: float | None = None,
    force_n: float | None = None,
) -> int:
    """Write a model's equalizer as plain JSON that any program can use.

    Fields: `format`, `version`; `texture`, `estimator`, `simulated`; `model_sha256`; `unit` of the
    output ("g" or "arbitrary"); `rate_hz`, at which the noise w has unit variance and the filters
    run; `definition`, what the numbers mean, in words; `conditions`, each an object with
    `speed_mm_s`, `force_n`, `noise_gain` (G_w, unit per unit noise) and `layers`. A layer has
    `frequency_hz`, `bandwidth_hz` (−3 dB), `gain` (G_i, signed) and the coefficients `b` (b0, b1,
    b2) and `a` (a0, a1, a2) of its unit-gain band-pass as a biquad at `rate_hz`. The filter is that
    of docs/method/equalizer.md, but a biquad does not share its safety while parameters move.

    Parameters
    ----------
    path : path
        The file; there whole or not at all.
    speed_mm_s, force_n : float, optional
        One condition, interpolated as in rendering: at least 0 and not above the grid, where the
        renderer would stay at the edge. Without both, every condition of the model's grid (of a
        RegressedModel its four corners, between which every parameter is bilinear).

    Returns
    -------
    int
        Number of conditions written.

    Raises
    ------
    InputError
        For an autoregressive model, a condition out of range, or only one of speed and force.
    """
    values = peq_document(model, speed_mm_s=speed_mm_s, force_n=force_n)
    write_text(path, dump_json(values))
    return len(values["conditions"])


def peq_document(
    model: AnyModel, *, speed_mm_s: float | None = None, force_n: float | None = None
) -> dict[str, Any]:
    """The fields of the file that `write_peq_json` writes; refused as there."""
    layered = check_layered(model)
    conditions = _conditions(layered, speed_mm_s, force_n)
    return {
        "format": JSON_FORMAT,
        "version": JSON_VERSION,
        "texture": layered.texture,
        "estimator": layered.estimator,
        "simulated": layered.simulated,
        "model_sha256": layered.sha256,
        "unit": layered.unit,
        "rate_hz": layered.rate_hz,
        "definition": DEFINITION,
        "conditions": [
            {"speed_mm_s": v, "force_n": f, **_equalizer(layered.peq(v, f))} for v, f in conditions
        ],
    }


def _conditions(
    model: Layered, speed_mm_s: float | None, force_n: float | None
) -> list[tuple[float, float]]:
    """The condition asked for, or all of the grid."""
    speeds, forces = model.speeds_mm_s.tolist(), model.forces_n.tolist()
    if speed_mm_s is None and force_n is None:
        return [(v, f) for v in speeds for f in forces]
    if speed_mm_s is None or force_n is None:
        raise InputError(
            f"expected a speed and a force, or neither for the whole grid, got {speed_mm_s} mm/s "
            f"and {force_n} N; give both."
        )
    if not (0 <= speed_mm_s <= speeds[-1] and 0 <= force_n <= forces[-1]):
        raise InputError(
            f"expected a condition within 0…{speeds[-1]:g} mm/s and 0…{forces[-1]:g} N, as far as "
            f"{model.texture} was recorded, got {speed_mm_s:g} mm/s and {force_n:g} N; "
            "above the grid the renderer uses the grid's edge, so ask for that."
        )
    return [(float(speed_mm_s), float(force_n))]


def _equalizer(peq: PEQ) -> dict[str, Any]:
    """Noise gain and layers of one condition."""
    from scipy.signal import iirpeak  # late: slow to load

    layers = []
    for frequency_hz, bandwidth_hz, gain in zip(
        peq.frequencies_hz.tolist(), peq.bandwidths_hz.tolist(), peq.gains.tolist(), strict=True
    ):
        b, a = iirpeak(frequency_hz, frequency_hz / bandwidth_hz, fs=peq.rate_hz)
        layers.append(
            {
                "frequency_hz": frequency_hz,
                "bandwidth_hz": bandwidth_hz,
                "gain": gain,
                "b": b.tolist(),
                "a": a.tolist(),
            }
        )
    return {"noise_gain": peq.noise_gain, "layers": layers}
