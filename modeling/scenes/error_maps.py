"""The error of each of the compiler's simplifications, place by place.

docs/method/scenes.md#errors

Errors do not depend on the scene, but only on the model and the actuator's band: a scene chooses
the places that count and how large an error may be there. That is why a narrower scene never needs
a more expensive model.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise, product

import numpy as np

from tactileq.modeling.arrays import Floats, Integers
from tactileq.modeling.models.loading import Layered
from tactileq.modeling.models.parameter_table import Parameters
from tactileq.modeling.models.texture_model import TextureModel
from tactileq.modeling.rendering.compiled import is_compiled
from tactileq.modeling.rendering.renderer import Renderer
from tactileq.modeling.scenes.measures import ComparedBand, Errors, Features, errors_between
from tactileq.modeling.scenes.places import Places, nodes_of

Segment = tuple[int, int]
# Smallest displacement of a hand by a late update that is distinguished from none.
LEAST_SPEED_MM_S, LEAST_FORCE_N = 0.25, 0.0025
AT_ONCE = 64  # responses, so that they stay small beside the processor's cache
ROUNDING_S = 0.5  # of each of the records by which precisions are compared


class ErrorMaps:
    """Errors against one model at the P nodes of its table, in C order.

    Parameters
    ----------
    model : TextureModel
        What is felt of the full model.
    """

    def __init__(self, model: TextureModel, yardstick: ComparedBand) -> None:
        self.model, self.yardstick = model, yardstick
        self._speeds, self._forces = nodes_of(model)
        self.shape = (self._speeds.size, self._forces.size)
        speed, force = np.meshgrid(self._speeds, self._forces, indexing="ij")
        self._speed, self._force = speed.ravel(), force.ravel()
        self._at = model.parameters(self._speed, self._force)
        self.truth: Features = yardstick.features(self._at)
        self._index = np.arange(speed.size).reshape(self.shape)
        self._cells: dict[tuple[Segment, Segment], tuple[Integers, Errors]] = {}
        self._centres: dict[Segment, tuple[Integers, Errors]] = {}
        self._late: dict[str, list[Errors]] = {"speed": [], "force": []}

    # --- A grid with fewer nodes

    @property
    def column_segments(self) -> list[Segment]:
        """Every segment of the forces, one without an extent at each node among them."""
        nodes = range(self._forces.size)
        return [(a, b) for a in nodes for b in nodes if a <= b]

    def centres(self, rows: Segment) -> tuple[Integers, Errors]:
        """As `cells`, but in the middle of every cell alone, in the order of `column_segments`.

        A wide cell that fails there need not be looked at.
        """
        if rows not in self._centres:
            across = np.array([sum(rows) // 2])
            parts = [(a, b, np.array([(a + b) // 2])) for a, b in self.column_segments]
            places, errors = self._blended(rows, across, parts)
            self._centres[rows] = places, errors
        return self._centres[rows]

    def cells(self, rows: Segment, columns: Sequence[Segment]) -> list[tuple[Integers, Errors]]:
        """Errors of blending linearly between the four corners of wider cells.

        Parameters
        ----------
        rows : (int, int)
            First and last node of the cells along speed; twice the same of one without an extent.
        columns : sequence of (int, int)
            Likewise along force, one for each cell.

        Returns
        -------
        list of (k,) ndarray and Errors
            For each cell the nodes in it, and the errors there.
        """
        unknown = [column for column in columns if (rows, column) not in self._cells]
        if unknown:
            across = np.arange(rows[0], rows[1] + 1)
            parts = [(a, b, np.arange(a, b + 1)) for a, b in unknown]
            places, errors = self._blended(rows, across, parts)
            ends = np.cumsum([across.size * along.size for _, _, along in parts])
            for column, end, (_, _, along) in zip(unknown, ends, parts, strict=True):
                own = np.arange(end - across.size * along.size, end)
                self._cells[rows, column] = places[own], errors.at(own)
        return [self._cells[rows, column] for column in columns]

    def _blended(
        self, rows: Segment, across: Integers, parts: Sequence[tuple[int, int, Integers]]
    ) -> tuple[Integers, Errors]:
        """Errors at nodes `across` speeds and along forces, of one cell after the other."""
        x = _shares(self._speeds, *rows, across)[:, None]
        corners, weights, places = [], [], []
        for first, last, along in parts:
            y = _shares(self._forces, first, last, along)[None, :]
            four = np.array([[(1 - x) * (1 - y), (1 - x) * y], [x * (1 - y), x * y]])
            weights.append(four.reshape(4, -1))
            nodes = self._index[np.ix_(rows, (first, last))].ravel()
            corners.append(np.repeat(nodes[:, None], weights[-1].shape[1], axis=1))
            places.append((across[:, None] * self.shape[1] + along[None, :]).ravel())
        corner, weight = np.concatenate(corners, axis=1), np.concatenate(weights, axis=1)
        at = np.concatenate(places)
        blended = [np.einsum("kn,kn...->n...", weight, part[corner]) for part in self._at]
        found = []
        for start in range(0, at.size, AT_ONCE):
            some = slice(start, start + AT_ONCE)
            ours = self.yardstick.features(Parameters(*(part[some] for part in blended)))
            found.append(errors_between(ours, self.truth.at(at[some])))
        return at, Errors(*(np.concatenate(part) for part in zip(*found, strict=True)))

    def of_nodes(self, rows: tuple[int, ...], columns: tuple[int, ...]) -> Errors:
        """Errors of the table with these nodes alone, at all nodes; 0 beyond them."""
        errors = Errors.none(self._index.size)
        for row, column in product(segments_of(rows), segments_of(columns)):
            [(places, found)] = self.cells(row, [column])
            for part, values in zip(errors, found, strict=True):
                part[places] = np.maximum(part[places], values)
        return errors

    # --- Another way of driving the parameters

    def of_model(self, model: Layered) -> Errors:
        """Errors of another model at all places."""
        ours = self.yardstick.features(model.parameters(self._speed, self._force))
        return errors_between(ours, self.truth)

    # --- Late updates

    def late(self, update_s: float, places: Places) -> Errors:
        """Errors of parameters that are held from update to update, at all places.

        Frequencies and bandwidths are those for the middle of an update; half an update earlier or
        later the hand has another speed and force. Gains ramp and are taken to be right.
        """
        half_s = update_s / 2
        by_speed = self._late_by("speed", half_s * places.speed_change_mm_s2)
        return by_speed + self._late_by("force", half_s * places.force_change_n_s)

    def _late_by(self, axis: str, displacement: Floats) -> Errors:
        """Errors where the hand is displaced by so much, (p, q), rounded up to doublings."""
        least = LEAST_SPEED_MM_S if axis == "speed" else LEAST_FORCE_N
        with np.errstate(divide="ignore"):
            steps = np.ceil(np.log2(displacement.ravel() / least) - 1e-9)
        index = np.where(displacement.ravel() > 1e-12, np.maximum(steps, 0), -1).astype(int)
        ladder = self._ladder(axis, int(index.max()))
        none = np.zeros(index.size)
        return Errors(
            *(
                np.choose(index + 1, [none, *(np.asarray(step[kind]) for step in ladder)])
                if ladder
                else none
                for kind in range(3)
            )
        )

    def _ladder(self, axis: str, highest: int) -> list[Errors]:
        """Errors of displacements of 1, 2, 4, … times the least one; each no less than the last."""
        known = self._late[axis]
        while len(known) <= highest:
            least = LEAST_SPEED_MM_S if axis == "speed" else LEAST_FORCE_N
            found = self._displaced(axis, least * 2 ** len(known))
            known.append(Errors.largest([known[-1], found]) if known else found)
        return known[: highest + 1]

    def _displaced(self, axis: str, by: float) -> Errors:
        """Of a hand that was, or will be, so much faster or slower (mm/s), or presses so (N)."""
        found = []
        for step in (-by, by):
            there = self.model.parameters(
                np.maximum(self._speed + step * (axis == "speed"), self._speeds[0]),
                np.maximum(self._force + step * (axis == "force"), self._forces[0]),
            )
            late = self._at._replace(
                frequencies_hz=there.frequencies_hz, bandwidths_hz=there.bandwidths_hz
            )
            found.append(errors_between(self.yardstick.features(late), self.truth))
        return Errors.largest(found)

    # --- Precision

    def rounding(self, rate_hz: float) -> Errors | None:
        """Largest errors of single precision, each (1,); None where it cannot be rendered here.

        Of records with the hand at rest in the corners and in the middle of the grid.
        """
        if not is_compiled():
            return None
        speeds, forces = self.model.speeds_mm_s, self.model.forces_n
        middle = (speeds[speeds.size // 2], forces[forces.size // 2])
        conditions = {(v, f) for v in speeds[[0, -1]] for f in forces[[0, -1]]} | {middle}
        found = [self._rounded(v, f, rate_hz) for v, f in sorted(conditions)]
        return Errors.largest(found)

    def _rounded(self, speed: float, force: float, rate_hz: float) -> Errors:
        features = []
        for single in (False, True):
            renderer = Renderer(self.model, rate_hz=rate_hz, single=single, update_samples=1000)
            samples = renderer.render(speed, force, samples=math.ceil(ROUNDING_S * rate_hz))
            frequency = np.fft.rfftfreq(samples.size, 1 / rate_hz)
            magnitude = np.abs(np.fft.rfft(samples))
            features.append(
                self.yardstick.features_of(
                    np.interp(self.yardstick.frequency_hz, frequency, magnitude)[None, :]
                )
            )
        return errors_between(features[1], features[0])


def segments_of(nodes: tuple[int, ...]) -> list[Segment]:
    """From each node to the next; of a single node from it to itself."""
    return list(pairwise(nodes)) or [(nodes[0], nodes[0])]


def _shares(axis: Floats, first: int, last: int, at: Integers) -> Floats:
    """How far places of an axis are from its value `first` to `last`, 0 … 1."""
    if first == last:
        return np.zeros(at.size)
    share: Floats = (axis[at] - axis[first]) / (axis[last] - axis[first])
    return share
