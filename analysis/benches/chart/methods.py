"""Every way to model and render a texture that the chart compares, by name."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from time import process_time

import numpy as np

from analysis.benches.chart.fitted import Fitted, Itself, Layered, Predictor, Shaped, block_samples
from analysis.benches.chart.shaped_noise import fit_shaped_noise
from analysis.textures.between import Measured, Truth
from modeling import InputError, Spectrum, TextureModel, Threshold, regressed, simplify
from modeling.errors import counted, shown
from modeling.estimation.likelihood import is_silent
from modeling.fitting.autoregressive import fit_ar_spectra
from modeling.fitting.conditions import spectra_by_condition
from modeling.fitting.texture import fit_spectra
from modeling.models.grid import fill_grid, grid_axes
from modeling.models.terms import DrivenBy
from modeling.perception.verdicts import CRITERIA, CriterionName
from modeling.recordings.spectrum import mean_spectrum

OURS, TRUTH, WHITE = "joint", "truth", "white noise"
MOST_LAYERS = 8
ORDERS = (6, 12, 20, 40)
BLOCKS_S = {"FFT, 1/16 s": 1 / 16, "FFT, 1/4 s": 1 / 4}
THRESHOLD = "codec"


@dataclass
class Subject:
    """What methods are fitted to: one texture's spectra, and its truth where that is known.

    The joint model, from which others are derived, is fitted once.
    """

    measured: Measured
    truth: Truth | None = None

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


def _autoregressive(subject: Subject, *, order: int) -> Fitted:
    return Predictor(fit_ar_spectra(subject.measured, order=order))


def _shaped(subject: Subject, *, block_s: float) -> Fitted:
    heard = [pair for pair in subject.measured if not is_silent(pair[1])]
    first, spectrum = subject.measured[0]
    block = block_samples(block_s, spectrum.rate_hz)
    noise = fit_shaped_noise(spectra_by_condition(heard), texture=first.texture, block=block)
    return Shaped(noise, block_s)


def _white(subject: Subject) -> Fitted:
    """A noise gain alone, of the recordings' power: a texture model without a layer."""
    first, spectrum = subject.measured[0]
    heard = [pair for pair in subject.measured if not is_silent(pair[1])]
    by_condition = spectra_by_condition(heard)
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


def _methods() -> Iterable[Method]:
    yield Method(OURS, "joint", _joint)
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
        yield Method(f"AR({order})", "autoregressive", partial(_autoregressive, order=order))
    for name, block_s in BLOCKS_S.items():
        yield Method(name, "FFT-shaped noise", partial(_shaped, block_s=block_s))
    yield Method(WHITE, "white noise", _white)
    yield Method(TRUTH, "truth", _truth)


METHODS = {method.name: method for method in _methods()}
# Between these numbers of layers there is little to see; they take half of the fitting time.
LEFT_TO_FULL = ("joint, 5 layers", "joint, 6 layers", "joint, 7 layers")
USUAL_METHODS = tuple(name for name in METHODS if name not in LEFT_TO_FULL)
# The demo's few: one of each kind.
BRIEF = (
    *("joint", "joint, 1 layer", "joint, 2 layers", "simplified, energy", "regressed, conditions"),
    *("paper", "paper-consistent", "AR(6)", "AR(20)", "FFT, 1/16 s", WHITE, TRUTH),
)
OUR_FAMILIES = ("joint", "joint, given layers", "simplified", "regressed")
# What users could take instead of ours.
RIVALS = tuple(
    name
    for name, method in METHODS.items()
    if method.family in ("paper", "autoregressive", "FFT-shaped noise", "white noise")
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
    before = subject.joint_seconds if method.derived or name == OURS else 0.0
    start = process_time()
    fitted = method.fit(subject)
    return Fit(name, method.family, fitted, before + process_time() - start)
