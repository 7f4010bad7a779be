"""How many layers, or which autoregressive order? A table over models of real textures.

Usage: python docs/studies/layers_and_orders.py Models_*.xml

Each filter of the given Penn Haptic Texture Toolkit files that vibrates makes one simulated record
of a second, which is then modelled by so many layers, with equal and with chosen signs, and by
autoregressive filters of several orders.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence

import pandas as pd
from rich.progress import track

from analysis.benches.layers_and_orders import layers_and_orders
from modeling import InputError, Recording
from modeling.similarity import SpectralFilter
from rig.importing.hatt import HattTexture, load_hatt


def cases_of(texture: HattTexture) -> list[tuple[Recording, SpectralFilter]]:
    """One simulated second of every filter of a texture that is not silent, and the filter."""
    heard = (texture.variances > 0) & (texture.conditions > 0).all(axis=1)
    cases: list[tuple[Recording, SpectralFilter]] = []
    for number, (speed, force) in enumerate(texture.conditions[heard].tolist()):
        [record] = texture.recordings([speed], [force], seed=number)
        cases.append((record, texture.filter(speed, force)))
    return cases


def main(paths: Sequence[str]) -> pd.DataFrame:
    """Print and return the table over all files."""
    if not paths:
        raise InputError("expected toolkit files, got none; give one or more Models_….xml.")
    cases = [case for path in paths for case in cases_of(load_hatt(path))]
    table = layers_and_orders(track(cases, "Fitting"))
    print(f"simulated records of {len(paths)} toolkit textures, {len(cases)} conditions, 1 s each")
    print(table.to_string(index=False, float_format="%.4f"))
    return table


if __name__ == "__main__":
    try:
        main(sys.argv[1:])
    except InputError as error:
        sys.exit(f"error: {error}")
