"""Files of the Penn Haptic Texture Toolkit as they are read and checked."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn
from xml.etree import ElementTree

import numpy as np

from tactileq.modeling import InputError
from tactileq.modeling.arrays import Floats, Integers
from tactileq.modeling.checks import (
    HIGHEST_RATE_HZ,
    LOWEST_RATE_HZ,
)
from tactileq.modeling.errors import counted, shortened, shown
from tactileq.modeling.files.reading import read_bytes
from tactileq.modeling.models.line_spectral import check_line_spectral, prediction_coefficients
from tactileq.rig.recording.importing.hatt import (
    _ONLY_LINES,
    _TINY,
    AGREEMENT,
    HATT_UNITS,
    HattTexture,
    _areas,
    condition_key,
)


def load_hatt(path: str | Path) -> HattTexture:
    """Read one `Models_….xml` of the toolkit.

    Raises
    ------
    InputError
        If the file is no such XML, lacks a field, holds lists of wrong lengths, values that are no
        finite numbers, triangles of models that are not there, an unstable filter, or filter
        coefficients that differ by more than 5e-5 from their line spectral frequencies.
    """
    file = _Reader(Path(path).name)
    root = _root(Path(path))
    for name, unit in HATT_UNITS.items():
        if (given := root.findtext(name, unit).strip()) != unit:
            file.refuse(f"{name} of {unit}", given, "convert its models")
    rate_hz = file.number(root, "SampleRate")
    if not LOWEST_RATE_HZ <= rate_hz <= HIGHEST_RATE_HZ:
        file.refuse(
            f"a SampleRate from {LOWEST_RATE_HZ:.0f} to {HIGHEST_RATE_HZ:.0f} Hz",
            f"{rate_hz:g}",
            "correct it",
        )
    conditions = _conditions(file, root)
    models = _models_of(file, root, conditions)
    return HattTexture(
        material=file.text(root, "material"),
        rate_hz=rate_hz,
        conditions=conditions,
        triangles=_triangles(file, root, conditions),
        ar_frequencies=np.array([m.ar_frequencies for m in models]),
        ma_frequencies=np.array([m.ma_frequencies for m in models]),
        variances=np.array([m.variance for m in models]),
        gains=np.array([m.gain for m in models]),
    )


def _conditions(file: _Reader, root: ElementTree.Element) -> Floats:
    """Speed and force of each model, (models, 2)."""
    speeds, forces = file.values(root, "speedList"), file.values(root, "forceList")
    if speeds.size != forces.size or not speeds.size:
        file.refuse(
            "as many speeds as forces",
            f"{speeds.size} in speedList and {forces.size} in forceList",
            "download it again",
        )
    if (lowest := min(speeds.min(), forces.min())) < 0:
        file.refuse("speeds and forces of at least 0", f"{lowest:g}", "download it again")
    return np.stack([speeds, forces], axis=-1)


@dataclass(frozen=True, eq=False)
class _Model:
    """One filter of a file."""

    condition: tuple[float, float]
    ar_frequencies: Floats
    ma_frequencies: Floats
    variance: float
    gain: float


@dataclass(frozen=True)
class _Reader:
    """Looks up fields of one file and names the file where one is not as expected."""

    name: str

    def refuse(self, expected: str, got: str, remedy: str) -> NoReturn:
        raise InputError(f"expected {expected} in {self.name}, got {shortened(got)}; {remedy}.")

    def text(self, element: ElementTree.Element, field: str) -> str:
        found = (element.findtext(field) or "").strip()
        if not found:
            self.refuse(f"the field {field}", "none", "download it again")
        return found

    def number(self, element: ElementTree.Element, field: str) -> float:
        return float(self._floats([self.text(element, field)], field)[0])

    def values(self, element: ElementTree.Element, field: str) -> Floats:
        """The numbers of a list, which may be empty but must be there."""
        if (found := element.find(field)) is None:
            self.refuse(f"the list {field}", "none", "download it again")
        return self.values_of(found, field)

    def values_of(self, found: ElementTree.Element, field: str) -> Floats:
        return self._floats([value.text or "" for value in found.findall("value")], field)

    def _floats(self, texts: Sequence[str], field: str) -> Floats:
        try:
            numbers = np.array(texts, dtype=np.float64)
        except ValueError:
            self.refuse(f"numbers in {field}", shown(list(texts)), "download it again")
        if not np.isfinite(numbers).all():
            self.refuse(f"finite numbers in {field}", "NaN or infinity", "download it again")
        return numbers


def _root(path: Path) -> ElementTree.Element:
    data = read_bytes(path, "a file")
    try:
        root = ElementTree.fromstring(data)
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        raise InputError(
            f"expected XML in {path.name}, got something else ({shortened(str(error))}); give a "
            "Models_….xml of the toolkit."
        ) from None
    if root.tag != "modelSet":
        raise InputError(
            f"expected a modelSet in {path.name}, got the XML element {shortened(root.tag)}; give "
            "a Models_….xml of the toolkit."
        )
    return root


def _models_of(file: _Reader, root: ElementTree.Element, conditions: Floats) -> list[_Model]:
    """The models in the order of the listed conditions, which the triangles count."""
    models = [_model(file, element) for element in root.findall("model")]
    found = {model.condition: model for model in models}
    listed = [condition_key(speed, force) for speed, force in conditions]
    if missing := [condition for condition in listed if condition not in found]:
        speed, force = missing[0]
        file.refuse(
            f"a model for each of {len(listed)} listed speeds and forces",
            f"{counted(len(models), 'model')} and none at {speed:g} mm/s and {force:g} N",
            "download it again",
        )
    for field, sizes in (
        ("ARlsf", {m.ar_frequencies.size for m in models}),
        ("MAlsf", {m.ma_frequencies.size for m in models}),
    ):
        if len(sizes) > 1:
            file.refuse(f"one length of {field} in all models", f"{sorted(sizes)}", "repair it")
    return [found[condition] for condition in listed]


def _model(file: _Reader, element: ElementTree.Element) -> _Model:
    ar_frequencies = _checked_frequencies(file, element, "AR")
    if not ar_frequencies.size:
        file.refuse("at least one value in ARlsf", "an empty list", "download it again")
    # The original files at 10 kHz are purely autoregressive and have no such part.
    moving = element.find("MAlsf") is not None
    ma_frequencies = _checked_frequencies(file, element, "MA") if moving else np.zeros(0)
    variance = file.number(element, "var")
    if variance < 0:
        file.refuse("a var of at least 0", f"{variance:g}", "download it again")
    return _Model(
        condition_key(file.number(element, "speedMod"), file.number(element, "forceMod")),
        ar_frequencies,
        ma_frequencies,
        variance,
        file.number(element, "gain") if ma_frequencies.size else 1.0,
    )


def _checked_frequencies(file: _Reader, element: ElementTree.Element, part: str) -> Floats:
    """Line spectral frequencies that are stable and agree with the coefficients beside them."""
    frequencies = file.values(element, f"{part}lsf")
    coefficients = file.values(element, f"{part}coeff")
    if coefficients.size != frequencies.size + 1 or coefficients[0] != 1:
        file.refuse(
            f"{frequencies.size + 1} values in {part}coeff, the first one 1, beside "
            f"{frequencies.size} in {part}lsf",
            f"{coefficients.size} values that begin with {shown(coefficients[:1].tolist())}",
            "download it again",
        )
    check_line_spectral(frequencies, f"{part}lsf of {file.name}")
    if not frequencies.size:
        return frequencies
    difference = float(np.abs(prediction_coefficients(frequencies) - coefficients[1:]).max())
    if difference > AGREEMENT:
        file.refuse(
            f"{part}coeff and {part}lsf that agree to {AGREEMENT:g}",
            f"a difference of {difference:.2g}",
            "one of them is wrong, download it again",
        )
    return frequencies


def _triangles(file: _Reader, root: ElementTree.Element, conditions: Floats) -> Integers:
    rows = [file.values_of(triangle, "tri") for triangle in root.findall("tri")]
    count = len(conditions)
    for row in rows:
        whole = row.size == 3 and bool((row == np.round(row)).all())
        if not whole or row.min() < 1 or row.max() > count or len(set(row.tolist())) < 3:
            file.refuse(
                f"three different models of 1 to {count} in each tri",
                shown(row),
                "download it again",
            )
    if not rows:
        file.refuse("at least one triangle tri", "none", "download it again")
    triangles = np.array(rows, dtype=np.intp) - 1
    # As in `weights`, relative to the fastest speed and the strongest force.
    corners = (conditions / np.maximum(conditions.max(axis=0), _TINY))[triangles]
    if float(np.abs(_areas(corners)).max()) < _ONLY_LINES:
        file.refuse("a triangle with an area", "only lines", "download it again")
    return triangles
