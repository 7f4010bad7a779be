"""tactileq record --audio --more: what the model of what is recorded already asks for."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

from tactileq.modeling.errors import InputError, counted
from tactileq.printing import left_out_warnings, progress

if TYPE_CHECKING:
    from tactileq.modeling import RecordingSet
    from tactileq.modeling.models.grid import Condition

NOTHING_MORE = "no condition is predicted much worse than the others; nothing more is asked for"


def further_conditions(folder: Path, texture: str) -> list[Condition]:
    """Conditions to record further, half-way between badly predicted ones and their neighbours.

    As `tactileq model --check` does, conditions are left out and predicted by `joint` from the
    others. The ones that are asked for are within the range of the recorded ones; none where no
    condition is predicted much worse than the others.

    Parameters
    ----------
    folder : Path
        A recording set.
    texture : str
        One that it holds; other textures do not count.

    Raises
    ------
    InputError
        For a folder without recordings of the texture in g, or with too few to leave any out, or
        on a line across the grid.
    """
    from tactileq.analysis.textures.between import fit_like, left_out_table, worth_recording
    from tactileq.analysis.textures.wanted import half_way_to_neighbours
    from tactileq.modeling.fitting.conditions import recording_spectra
    from tactileq.modeling.fitting.texture import fit_spectra
    from tactileq.modeling.threads import one_linear_algebra_thread

    records = _recorded(folder, texture)
    with one_linear_algebra_thread(), progress("Predicting conditions left out", 3) as advance:
        measured = recording_spectra(records)
        advance("spectra")
        model = fit_spectra(measured)
        advance("model")
        left_out = left_out_table(measured, fit_like(model))
        advance("")
    recorded = {recording.condition for recording, _ in measured}
    if not len(left_out):
        raise InputError(
            f"expected enough conditions of {texture} in {folder} to leave some out and predict "
            f"them, got {len(recorded)}; record more of them first, without --more."
        )
    near = worth_recording(left_out)
    wanted = half_way_to_neighbours(near, recorded)
    if wanted:
        print(
            f"{counted(len(wanted), 'further condition')} of {texture} asked for, half-way to "
            f"the neighbours of {', '.join(f'{v:.4g} mm/s at {f:.3g} N' for v, f in near)}, "
            "predicted worst"
        )
    return wanted


def _recorded(folder: Path, texture: str) -> RecordingSet:
    """The usable recordings of a texture, in g; a warning names the others."""
    from tactileq.modeling.fitting.conditions import only_unit
    from tactileq.modeling.recordings.recording_set import (
        is_recording_set,
        load_usable,
        textures_in,
    )

    found = textures_in(folder) if is_recording_set(folder) else ()
    if texture not in found:
        raise InputError(
            f"expected recordings of {texture} in {folder} to add to, got "
            f"{'those of ' + ', '.join(found) if found else 'none'}; record it without --more "
            "first, or correct --texture."
        )
    records, unusable = load_usable(folder, texture=texture)
    for warning in left_out_warnings(texture, unusable):
        print(warning, file=sys.stderr)
    if (unit := only_unit(records)) != "g":
        raise InputError(
            f"expected recordings of {texture} in g, as --audio makes them, got unit {unit} in "
            f"{folder}; import them with --g-per-fullscale, or record into another folder."
        )
    return records
