"""The contact sheet: spectra as they were planted, and a figure that shows all of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.text import Text

from tactileq.analysis.spectra.contact_sheet import LINE_HZ, ContactSheet, contact_sheet
from tactileq.analysis.spectra.figures.stimuli import figure_contact_sheet, plot_stimuli
from tactileq.modeling import TextureModel
from tactileq.stimuli.planted.textures import planted_texture
from tactileq.stimuli.planted.vibrators import planted_vibrator
from tactileq.stimuli.sets.recipe import ModelEntry, Recipe, SetLevel, TrajectoryEntry
from tactileq.stimuli.sets.writing import write_set

GRID = {"speeds_mm_s": np.array([100.0, 300.0]), "forces_n": np.array([1.0, 3.0])}
TEXTURES = ("PVC", "canvas")
CONDITIONS = ((100.0, 1.0), (250.0, 2.5))


def recipe_of(folder: Path, **changes: object) -> Recipe:
    models = {name: planted_texture(name, **GRID) for name in TEXTURES}
    for name, model in models.items():
        model.save(folder / f"full/{name}.json")
    models["canvas"].with_layers([0]).save(folder / "simplified/canvas.json")
    values: dict[str, object] = {
        "name": "two of seven",
        "models": tuple(ModelEntry(folder / label, label) for label in ("full", "simplified")),
        "trajectories": tuple(TrajectoryEntry.constant(*c) for c in CONDITIONS),
        "rates_hz": (48_000, 8000),
        "seeds": (1, 2, 3),
        "duration_s": 2.0,
        **changes,
    }
    return Recipe(**values)  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def sheet(tmp_path_factory: pytest.TempPathFactory) -> ContactSheet:
    folder = tmp_path_factory.mktemp("sheet")
    write_set(folder / "set", recipe_of(folder))
    return contact_sheet(folder / "set")


def test_names_and_gaps(sheet: ContactSheet) -> None:
    assert (sheet.name, sheet.textures, sheet.models) == (
        "two of seven",
        TEXTURES,
        ("full", "simplified"),
    )
    assert sheet.trajectories == ("100mms_1N", "250mms_2.5N")
    assert (sheet.unit, sheet.simulated.tolist()) == ("g", [True, True])
    assert sheet.frequency_hz.tolist() == np.arange(0, 2501, LINE_HZ).tolist()
    # Only canvas has a simplified model.
    assert np.isnan(sheet.density_db[0, :, 1]).all()
    assert np.isnan(sheet.level_db[0, :, 1]).all()
    assert np.isfinite(np.delete(sheet.density_db.reshape(4, 2, -1), [0, 1], axis=0)).all()


def test_spectra_are_the_models(sheet: ContactSheet) -> None:
    """Density = response²·2/rate, in bands of 200 Hz and overall."""
    for row, name in enumerate(TEXTURES):
        for column, condition in enumerate(CONDITIONS):
            peq = planted_texture(name, **GRID).peq(*condition)
            expected = 10 * np.log10(peq.response(sheet.frequency_hz) ** 2 * 2 / 5000)
            error = (sheet.density_db[row, column, 0] - expected)[50:240]
            assert np.abs(error.reshape(-1, 19).mean(axis=1)).max() < 1.0
            rms = np.sqrt(np.mean(peq.response(np.arange(2500.0)) ** 2))
            assert sheet.level_db[row, column, 0] == pytest.approx(20 * np.log10(rms), abs=0.6)


def test_24_bit_files_have_the_same_spectra(tmp_path: Path) -> None:
    few = {"seeds": (1,), "rates_hz": (8000,), "duration_s": 0.3}
    write_set(tmp_path / "float", recipe_of(tmp_path, **few))
    made = recipe_of(tmp_path, format="pcm24", level=SetLevel(full_scale_g=2.0), **few)
    write_set(tmp_path / "pcm", made)
    a, b = (contact_sheet(tmp_path / name) for name in ("float", "pcm"))
    assert np.nanmax(np.abs(a.density_db - b.density_db)) < 0.01


def test_spectra_of_a_vibrators_set_are_those_of_its_drive(tmp_path: Path) -> None:
    """Four times weaker at the resonance, alike far from it; levels as without."""
    planted_vibrator(200.0, 50.0).save(tmp_path / "pen.json")
    few = {"seeds": (1,), "rates_hz": (8000,), "duration_s": 1.0}
    write_set(tmp_path / "plain", recipe_of(tmp_path, **few))
    write_set(tmp_path / "driven", recipe_of(tmp_path, vibrator=tmp_path / "pen.json", **few))
    plain, driven = (contact_sheet(tmp_path / name) for name in ("plain", "driven"))
    assert (plain.compensated, driven.compensated) == (False, True)
    assert np.array_equal(plain.level_db, driven.level_db, equal_nan=True)
    change_db = (driven.density_db - plain.density_db)[1]
    at = plain.frequency_hz
    assert change_db[..., at == 200].mean() == pytest.approx(-20 * np.log10(4), abs=1.0)
    assert np.abs(change_db[..., (at > 1800) & (at < 2400)]).max() < 0.2


def test_silence_and_names_like_missing_values(tmp_path: Path) -> None:
    truth = planted_texture("PVC", **GRID)
    values = {name: getattr(truth, name) for name in truth.__dataclass_fields__}
    TextureModel(**{**values, "texture": "NA"}).save(tmp_path / "full/na.json")
    made = recipe_of(
        tmp_path,
        models=(ModelEntry(tmp_path / "full/na.json", "null"),),
        trajectories=(TrajectoryEntry.constant(0.0, 1.0),),
        rates_hz=(5000,),
        duration_s=0.05,
    )
    write_set(tmp_path / "set", made)
    sheet = contact_sheet(tmp_path / "set")
    assert (sheet.textures, sheet.models) == (("NA",), ("null",))
    assert (sheet.level_db == -np.inf).all()
    figure_contact_sheet(sheet).savefig(tmp_path / "sheet.png")
    assert (tmp_path / "sheet.png").read_bytes().startswith(b"\x89PNG")


def test_figure_shows_every_stimulus(sheet: ContactSheet) -> None:
    figure = figure_contact_sheet(sheet)
    assert isinstance(figure, Figure)
    assert len(figure.axes) == 4
    for number, ax in enumerate(figure.axes):
        row, column = divmod(number, 2)
        for model, line in enumerate(ax.get_lines()):
            drawn = np.asarray(line.get_ydata())
            assert np.array_equal(drawn, sheet.density_db[row, column, model], equal_nan=True)
        assert ax.get_ylim() == figure.axes[0].get_ylim()
        assert ax.get_xlim() == (10, 2500)
    assert figure.axes[0].get_ylabel() == "PVC"
    assert figure.axes[2].get_xlabel() == "frequency (Hz)"
    stamps = [text.get_text() for ax in figure.axes for text in ax.texts]
    assert stamps.count("SIMULATED") == 2
    assert any(text.endswith(" / none") for text in stamps)
    (legend,) = figure.legends
    assert [text.get_text() for text in legend.get_texts()] == ["full", "simplified"]
    assert "dB re 1 g²/Hz" in figure.get_supylabel()


@pytest.mark.parametrize("compensated", [False, True])
@pytest.mark.parametrize("unit", ["g", "arbitrary"])
@pytest.mark.parametrize("shape", [(1, 1, 1), (1, 3, 1), (7, 2, 3)])
def test_nothing_is_cut_off(shape: tuple[int, int, int], unit: str, compensated: bool) -> None:
    """Titles and labels lie within the picture, from one panel to fourteen."""
    names = [
        tuple(f"{what} {n}" for n in range(count)) for what, count in zip("tsm", shape, strict=True)
    ]
    sheet = ContactSheet(
        name="touch",
        textures=names[0],
        trajectories=names[1],
        models=names[2],
        frequency_hz=np.arange(251) * LINE_HZ,
        density_db=np.full((*shape, 251), -60.0),
        level_db=np.full(shape, -20.0),
        unit=unit,
        simulated=np.ones(shape[0], dtype=bool),
        compensated=compensated,
    )
    figure = figure_contact_sheet(sheet)
    figure.draw_without_rendering()
    whole = figure.bbox
    texts = figure.findobj(Text)
    assert len([text for text in texts if text.get_text()]) > 10
    for text in texts:
        box = text.get_window_extent()
        if text.get_text() and text.get_visible():
            assert box.x0 >= whole.x0, text
            assert box.y0 >= whole.y0, text
            assert box.x1 <= whole.x1, text
            assert box.y1 <= whole.y1, text
    words = f"{figure.get_supylabel()} {figure.get_suptitle()}"
    assert ("drive" in words) == ("at the hand" in words) == compensated


def test_one_panel_alone(sheet: ContactSheet) -> None:
    ax = plot_stimuli(sheet, 1, column=0)
    assert len(ax.get_lines()) == 2
