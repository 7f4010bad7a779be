"""Every way to model and render a texture that the chart compares, by name."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from time import process_time

import numpy as np

from tactileq.analysis.textures.between import Measured, Truth
from tactileq.benches.chart.fitted import Fitted, Itself, Layered
from tactileq.benches.chart.rival_costs import block_samples, grain_samples
from tactileq.benches.chart.rival_fits import Filtered, Grained, Looped, Shaped
from tactileq.benches.chart.shaped_noise import fit_shaped_noise
from tactileq.benches.rendering.coefficients import fit_sections, tabled, tabled_bands
from tactileq.benches.rendering.stored_sounds import Magnitude, grains_of, make_loops
from tactileq.modeling import InputError, Spectrum, TextureModel, Threshold, regressed, simplify
from tactileq.modeling.arrays import Floats
from tactileq.modeling.errors import counted, shown
from tactileq.modeling.estimation.likelihood import is_silent
from tactileq.modeling.fitting.autoregressive import fit_ar_spectra
from tactileq.modeling.fitting.conditions import spectra_by_condition
from tactileq.modeling.fitting.spectral_field import fit_field_to_spectra
from tactileq.modeling.fitting.texture import fit_spectra
from tactileq.modeling.models.grid import Condition, fill_grid, grid_axes
from tactileq.modeling.models.terms import DrivenBy
from tactileq.modeling.perception.verdicts import CRITERIA, CriterionName
from tactileq.modeling.recordings.recording import Recording
from tactileq.modeling.recordings.spectrum import mean_spectrum, smooth

OUR_METHOD, TRUTH, WHITE = "joint", "truth", "white noise"
MOST_LAYERS = 8
ORDERS = (6, 12, 20, 40)
BLOCKS_S = {"1/16 s": 1 / 16, "1/4 s": 1 / 4}
SECTIONS = (2, 4)  # of the filter fitted by SciPy
LOOP_S = 1.0
# Of recorded spectra, before loops are made of them; chosen on drawn surfaces 3001 to 3005.
LOOP_SMOOTHING_HZ = 10.0
THRESHOLD = "codec"


@dataclass
class Subject:
    """What methods are fitted to: one texture's spectra, and its truth where that is known.

    The joint model, from which others are derived, is fitted once.
    """

    measured: Measured
    truth: Truth | None = None

    @property
    def texture(self) -> str:
        return self.measured[0][0].texture

    @property
    def rate_hz(self) -> float:
        """Of the spectra."""
        return self.measured[0][1].rate_hz

    @cached_property
    def heard(self) -> dict[Condition, list[Spectrum]]:
        """Spectra by condition, without silent ones."""
        return spectra_by_condition([pair for pair in self.measured if not is_silent(pair[1])])

    @property
    def axes(self) -> tuple[Floats, Floats]:
        """Speeds and forces of what is heard."""
        speeds, forces = grid_axes(self.heard)
        return np.array(speeds), np.array(forces)

    @property
    def joint(self) -> TextureModel:
        return self._joint_and_seconds[0]

    @property
    def joint_seconds(self) -> float:
        """Of processor time."""
        return self._joint_and_seconds[1]

    @cached_property
    def _joint_and_seconds(self) -> tuple[TextureModel, float]:
        start = process_time()
        return fit_spectra(self.measured), process_time() - start


@dataclass(frozen=True)
class Method:
    """One way to model a texture.

    Parameters
    ----------
    name, family : str
        Methods of one family are drawn alike.
    fit : callable
        From a `Subject` to what was fitted.
    derived : bool
        From the joint model, whose fitting time is then part of its own.
    """

    name: str
    family: str
    fit: Callable[[Subject], Fitted]
    derived: bool = False


def _joint(subject: Subject) -> Fitted:
    return Layered(subject.joint)


def _layers(subject: Subject, *, count: int) -> Fitted:
    return Layered(fit_spectra(subject.measured, layers=count))


def _paper(subject: Subject, *, estimator: str) -> Fitted:
    return Layered(fit_spectra(subject.measured, estimator=estimator))


def _simplified(subject: Subject, *, criterion: CriterionName) -> Fitted:
    return Layered(simplify(subject.joint, Threshold.named(THRESHOLD), criterion=criterion).model)


def _regressed(subject: Subject, *, by: DrivenBy) -> Fitted:
    return Layered(regressed(subject.joint, by=by))


def _direct_form(subject: Subject) -> Fitted:
    model = subject.joint
    if not model.n_layers:
        raise InputError("expected a model with layers, got none; it is white noise.")
    return Filtered(tabled_bands(model), model.gains[..., 0].size)


def _autoregressive(subject: Subject, *, order: int) -> Fitted:
    return Filtered.of(fit_ar_spectra(subject.measured, order=order))


def _sections(subject: Subject, *, sections: int) -> Fitted:
    order = 2 * sections
    by_condition = subject.heard
    rows = {c: fit_sections(mean_spectrum(x), order=order) for c, x in by_condition.items()}
    values, _ = fill_grid(rows, subject.texture)
    table = tabled(subject.axes, values, poles=order, rate_hz=subject.rate_hz)
    return Filtered(table, values[..., 0].size)


def _loops(subject: Subject, *, of: Callable[[Subject], Magnitude], between: bool) -> Fitted:
    axes = subject.axes
    if between:
        axes = _with_middles(axes[0]), _with_middles(axes[1])
    rng = np.random.default_rng(0)
    loops = make_loops(axes, of(subject), rate_hz=subject.rate_hz, seconds=LOOP_S, rng=rng)
    return Looped(loops)


def _with_middles(axis: Floats) -> Floats:
    """The axis with the geometric mean of each pair of neighbours."""
    return np.sort(np.concatenate((axis, np.sqrt(axis[1:] * axis[:-1]))))


def _joint_magnitude(subject: Subject) -> Magnitude:
    return lambda speed, force, frequency: subject.joint.peq(speed, force).response(frequency)


def _field_magnitude(subject: Subject) -> Magnitude:
    field = fit_field_to_spectra(subject.measured)
    return lambda speed, force, frequency: field.filter(speed, force).response(frequency)


def _spectra_magnitude(subject: Subject) -> Magnitude:
    """Of recorded conditions alone, or holes between them."""
    means = {c: mean_spectrum(found) for c, found in subject.heard.items()}
    grid = next(iter(means.values())).frequency_hz
    rows = {c: np.interp(grid, x.frequency_hz, _smoothed(x)) for c, x in means.items()}
    values, _ = fill_grid(rows, subject.texture)
    speeds, forces = (axis.tolist() for axis in subject.axes)

    def magnitude(speed: float, force: float, frequency: Floats) -> Floats:
        row = values[speeds.index(speed), forces.index(force)]
        return np.asarray(np.interp(frequency, grid, row))

    return magnitude


def _smoothed(measured: Spectrum) -> Floats:
    step_hz = measured.rate_hz / measured.n_samples
    power = measured.without_leakage**2 * np.pi / 4
    return np.sqrt(np.maximum(smooth(power, LOOP_SMOOTHING_HZ, step_hz=step_hz), 0.0))


def _grains(subject: Subject, *, block_s: float) -> Fitted:
    records: dict[Condition, list[Recording]] = {}
    for recording, spectrum in subject.measured:
        if not is_silent(spectrum):
            records.setdefault(recording.condition, []).append(recording)
    block = grain_samples(block_s, subject.rate_hz)
    return Grained(grains_of(records, texture=subject.texture, block=block), block_s)


def _shaped(subject: Subject, *, block_s: float) -> Fitted:
    block = block_samples(block_s, subject.rate_hz)
    noise = fit_shaped_noise(subject.heard, texture=subject.texture, block=block)
    return Shaped(noise, block_s)


def _white(subject: Subject) -> Fitted:
    """A noise gain alone, of the recordings' power: a texture model without a layer."""
    first, spectrum = subject.measured[0]
    by_condition = subject.heard
    rows = {c: [_root_mean_square(mean_spectrum(found))] for c, found in by_condition.items()}
    gains, interpolated = fill_grid(rows, first.texture)
    speeds, forces = grid_axes(by_condition)
    none = np.zeros((len(speeds), len(forces), 0))
    model = TextureModel(
        texture=first.texture,
        rate_hz=spectrum.rate_hz,
        speeds_mm_s=np.array(speeds),
        forces_n=np.array(forces),
        noise_gains=gains[..., 0],
        frequencies_hz=none,
        bandwidths_hz=none,
        gains=none,
        level_sd_db=none,
        estimator="white",
        unit=first.unit,
        simulated=first.simulated,
        interpolated=interpolated,
        blending="logarithmic",
    )
    return Layered(model)


def _root_mean_square(measured: Spectrum) -> float:
    return float(np.sqrt(np.mean(measured.without_leakage**2 * np.pi / 4)))


def _truth(subject: Subject) -> Fitted:
    if subject.truth is None:
        raise InputError("expected a surface whose truth is known, got recordings; leave it out.")
    return Itself(subject.truth, subject.measured[0][1].rate_hz)


AUTOREGRESSIVE, POLE_ZERO, LOOPS = "autoregressive", "poles and zeros", "looped wavetables"
GRAINS, SHAPED = "grains of recordings", "FFT-shaped noise"
# What loops are made of; whether also half-way between the conditions; whether joint is fitted.
_LOOPS = {
    "joint": (_joint_magnitude, True, True),
    "joint, at conditions": (_joint_magnitude, False, True),
    "field": (_field_magnitude, True, False),
    "spectra": (_spectra_magnitude, False, False),
}


def _methods() -> Iterable[Method]:
    yield Method(OUR_METHOD, "joint", _joint)
    for count in range(1, MOST_LAYERS + 1):
        name = f"joint, {counted(count, 'layer')}"
        yield Method(name, "joint, given layers", partial(_layers, count=count))
    for criterion in CRITERIA:
        fit = partial(_simplified, criterion=criterion)
        yield Method(f"simplified, {criterion}", "simplified", fit, derived=True)
    drivers: tuple[DrivenBy, ...] = ("conditions", "centroid")
    for by in drivers:
        yield Method(f"regressed, {by}", "regressed", partial(_regressed, by=by), derived=True)
    for estimator in ("paper", "paper-consistent"):
        yield Method(estimator, "paper", partial(_paper, estimator=estimator))
    for order in ORDERS:
        yield Method(f"AR({order})", AUTOREGRESSIVE, partial(_autoregressive, order=order))
    for sections in SECTIONS:
        name = f"IIR, {sections} sections"
        yield Method(name, POLE_ZERO, partial(_sections, sections=sections))
    yield Method("joint, direct form", POLE_ZERO, _direct_form, derived=True)
    for name, (of, between, derived) in _LOOPS.items():
        fit = partial(_loops, of=of, between=between)
        yield Method(f"loops of {name}", LOOPS, fit, derived=derived)
    for name, block_s in BLOCKS_S.items():
        yield Method(f"grains, {name}", GRAINS, partial(_grains, block_s=block_s))
    for name, block_s in BLOCKS_S.items():
        yield Method(f"FFT, {name}", SHAPED, partial(_shaped, block_s=block_s))
    yield Method(WHITE, "white noise", _white)
    yield Method(TRUTH, "truth", _truth)


METHODS = {method.name: method for method in _methods()}
# Between these numbers of layers there is little to see; they take half of the fitting time.
LEFT_TO_FULL = ("joint, 5 layers", "joint, 6 layers", "joint, 7 layers")
USUAL_METHODS = tuple(name for name in METHODS if name not in LEFT_TO_FULL)
# The demo's few: one of each kind.
BRIEF = (
    *("joint", "joint, 1 layer", "regressed, conditions", "paper", "AR(20)", "IIR, 2 sections"),
    *("loops of field", "grains, 1/16 s", "FFT, 1/16 s", WHITE, TRUTH),
)
OUR_FAMILIES = ("joint", "joint, given layers", "simplified", "regressed")
# What users could take instead of ours.
RIVALS = tuple(
    name
    for name, method in METHODS.items()
    if method.family in ("paper", AUTOREGRESSIVE, POLE_ZERO, LOOPS, GRAINS, SHAPED, "white noise")
)


def chosen_methods(names: Sequence[str], *, full: bool) -> tuple[str, ...]:
    """The methods of these names in the chart's order; without names the usual ones, or all.

    Raises
    ------
    InputError
        For a name that no method has.
    """
    for name in names:
        if name not in METHODS:
            raise InputError(
                f"expected methods among {'; '.join(METHODS)}, got {shown(name)}; correct it."
            )
    wanted = names or (METHODS if full else USUAL_METHODS)
    return tuple(name for name in METHODS if name in wanted)


@dataclass(frozen=True, eq=False)
class Fit:
    """A model by its name and family, and how many seconds of processor time its fit took."""

    name: str
    family: str
    fitted: Fitted
    seconds: float

    def variants(self) -> dict[str, Fitted]:
        """By blending; "" where there is only one."""
        if isinstance(self.fitted, Layered):
            return dict(self.fitted.blendings())
        return {"": self.fitted}

    @property
    def own_blending(self) -> str:
        """How it is blended unless something else is asked for."""
        model = self.fitted.model if isinstance(self.fitted, Layered) else None
        if isinstance(model, TextureModel):
            return model.blending
        return next(iter(self.variants()))


def fit_method(name: str, subject: Subject) -> Fit:
    """One method fitted to one texture, with its time.

    Raises
    ------
    InputError
        Where the method cannot model this texture.
    """
    method = METHODS[name]
    before = subject.joint_seconds if method.derived or name == OUR_METHOD else 0.0
    start = process_time()
    fitted = method.fit(subject)
    return Fit(name, method.family, fitted, before + process_time() - start)
