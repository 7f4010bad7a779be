"""Line spectral frequencies of an all-pole filter, and back (Itakura 1975).

With A(z) = 1 + a₁z⁻¹ + … + a_p z⁻ᵖ the sum and difference polynomials are
P(z) = A(z) + z⁻⁽ᵖ⁺¹⁾A(1/z) and Q(z) = A(z) − z⁻⁽ᵖ⁺¹⁾A(1/z), hence A = (P + Q)/2. Apart from fixed
roots at z = ±1 their roots lie on the unit circle and alternate, P's first, if and only if 1/A is
stable; the p angles between 0 and π are the line spectral frequencies. Any rising sequence in
(0, π) is a stable filter, and so is any weighted mean of such sequences.
"""

from __future__ import annotations

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import ArrayLike

from tactileq.modeling.arrays import Floats
from tactileq.modeling.errors import InputError


def check_line_spectral(frequencies: Floats, what: str) -> None:
    """Refuse (…, p) line spectral frequencies that do not rise strictly within (0, π).

    Raises
    ------
    InputError
        Naming `what`: such a filter is unstable.
    """
    padded = np.concatenate(
        [
            np.zeros((*frequencies.shape[:-1], 1)),
            frequencies,
            np.full((*frequencies.shape[:-1], 1), np.pi),
        ],
        axis=-1,
    )
    if not bool((np.diff(padded, axis=-1) > 0).all()):
        raise InputError(
            f"expected line spectral frequencies that rise between 0 and π in {what}, got others: "
            "the filter is unstable; fit it again."
        )


def line_spectral_frequencies(coefficients: ArrayLike) -> Floats:
    """Line spectral frequencies of a stable all-pole filter 1/A(z).

    Parameters
    ----------
    coefficients : (p,) array_like
        a₁ … a_p, without the leading 1; p ≥ 1.

    Returns
    -------
    (p,) ndarray
        Radians per sample, rising in (0, π).

    Raises
    ------
    InputError
        For coefficients that are not finite, and for an unstable filter.

    Notes
    -----
    Without their fixed roots P and Q are sums of cosines of the angle, Chebyshev series in its
    cosine, whose roots are eigenvalues of a symmetric-like matrix; one Newton step each polishes.
    """
    a = np.asarray(coefficients, dtype=np.float64)
    if a.ndim != 1 or not a.size or not np.isfinite(a).all():
        raise InputError(
            f"expected one or more finite filter coefficients, got {a.tolist()}; fit them again."
        )
    forward = np.concatenate([[1.0], a, [0.0]])
    total, difference = forward + forward[::-1], forward - forward[::-1]
    if a.size % 2:
        difference = _divide(difference, [1.0, 0.0, -1.0])
    else:
        total, difference = _divide(total, [1.0, 1.0]), _divide(difference, [1.0, -1.0])
    angles = np.full(a.size, np.nan)
    angles[0::2], angles[1::2] = _unit_circle_angles(total), _unit_circle_angles(difference)
    check_line_spectral(angles, "the filter")
    return angles


def _divide(polynomial: Floats, factor: list[float]) -> Floats:
    """A polynomial without a factor that it is known to hold."""
    from scipy.signal import lfilter

    quotient: Floats = lfilter([1.0], factor, polynomial)[: 1 - len(factor)]
    return quotient


def _unit_circle_angles(symmetric: Floats) -> Floats:
    """Angles in (0, π) of the roots of a palindromic polynomial of even degree 2k, rising (k,)."""
    k = symmetric.size // 2
    # e^{jkω}·polynomial = c₀ + Σ c_n cos nω, a Chebyshev series in cos ω.
    series = np.concatenate([symmetric[k : k + 1], 2 * symmetric[k + 1 :]])
    angles = np.sort(np.arccos(np.clip(chebyshev.chebroots(series).real, -1.0, 1.0)))
    order = np.arange(k + 1)
    value = np.cos(np.outer(angles, order)) @ series
    slope = -np.sin(np.outer(angles, order)) @ (order * series)
    step = np.divide(value, slope, out=np.zeros(k), where=slope != 0)
    polished: Floats = angles - step
    return polished


def prediction_coefficients(frequencies: ArrayLike) -> Floats:
    """Coefficients a₁ … a_p of the filter with these line spectral frequencies.

    Parameters
    ----------
    frequencies : (…, p) array_like
        Radians per sample, rising in (0, π).

    Returns
    -------
    (…, p) ndarray
        Without the leading 1.

    Notes
    -----
    On the unit circle each pair of roots contributes e^{−jθ}·2(cos θ − cos ω), a real factor apart
    from delay, so A is computed there and transformed back: no polynomial is multiplied out.
    """
    omega = np.asarray(frequencies, dtype=np.float64)
    p = omega.shape[-1]
    points = 2 * (p + 2)
    theta = 2 * np.pi / points * np.arange(points // 2 + 1)
    total, difference = _half_sums(omega, theta)
    # P = e^{−j(p+1)θ/2}·2·total and Q = j·e^{−j(p+1)θ/2}·2·difference.
    response = np.exp(-0.5j * (p + 1) * theta) * (total + 1j * difference)
    coefficients: Floats = np.fft.irfft(response, n=points, axis=-1)[..., 1 : p + 1]
    return coefficients


def reflection_coefficients(coefficients: ArrayLike) -> Floats:
    """Reflection coefficients k₁ … k_p of 1/A(z), by the step-down recursion.

    Parameters
    ----------
    coefficients : (…, p) array_like
        a₁ … a_p, without the leading 1.

    Returns
    -------
    (…, p) ndarray
        All within −1 … 1 if and only if the filter is stable (Schur–Cohn); NaN below a
        coefficient of exactly ±1.
    """
    a = np.array(coefficients, dtype=np.float64)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        for m in range(a.shape[-1] - 1, 0, -1):
            last = a[..., m : m + 1]
            a[..., :m] = (a[..., :m] - last * a[..., m - 1 :: -1]) / (1 - last**2)
    return a


def _half_sums(omega: Floats, theta: Floats) -> tuple[Floats, Floats]:
    """Real amplitudes of P/2 and Q/2 at angles θ, without their common delay: (…, n) each."""
    p = omega.shape[-1]
    # cos θ − cos ω = −2·sin((θ+ω)/2)·sin((θ−ω)/2) keeps its digits where θ is close to ω.
    half_theta, half_omega = theta / 2, omega[..., None] / 2
    factors = -4 * np.sin(half_theta + half_omega) * np.sin(half_theta - half_omega)
    total = factors[..., 0::2, :].prod(axis=-2)
    difference = factors[..., 1::2, :].prod(axis=-2)
    if p % 2:
        return total / 2, difference * np.sin(theta)
    return total * np.cos(half_theta), difference * np.sin(half_theta)
