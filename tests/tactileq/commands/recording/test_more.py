"""tactileq record --audio --more: which conditions a folder of recordings asks for."""

from __future__ import annotations

import io
from dataclasses import replace
from pathlib import Path

import pytest
from rich.console import Console

from tactileq.commands.recording import audio as record_audio
from tactileq.commands.recording.audio import (
    HandOptions,
    HandRecording,
    InputOptions,
    record_by_hand,
)
from tactileq.commands.recording.map import grid_table
from tactileq.commands.recording.more import NOTHING_MORE
from tactileq.modeling import InputError, RecordingSet
from tactileq.rig.recording.capture.coverage import Coverage
from tactileq.rig.recording.capture.grid import StrokeGrid
from tactileq.stimuli.planted.drawn import draw_surface
from tests.refusals import refused

SPEEDS, FORCES = [50.0, 150.0, 250.0, 350.0], [0.5, 1.5, 2.5, 3.5]


def recorded(folder: Path, *, louder=(), speeds=SPEEDS, forces=FORCES) -> Path:
    """A folder of a drawn surface; one condition is ten times as loud as it would be."""
    records = [
        replace(r, texture="oak", samples=(10 if r.condition == louder else 1) * r.samples)
        for r in draw_surface(9400).record(speeds, forces, duration_s=0.5)
    ]
    RecordingSet(records).save(folder)
    return folder


def asked(monkeypatch, folder: Path, **changes) -> list[StrokeGrid]:
    """The grids with which devices would be opened."""
    grids: list[StrokeGrid] = []
    monkeypatch.setattr(record_audio, "record_on", lambda grid, *_, **__: grids.append(grid))
    hand = HandOptions("scripted")
    heard = InputOptions(g_per_fullscale=10.0)
    record_by_hand(
        folder,
        HandRecording(
            **{
                "texture": "oak",
                "duration_s": 1.0,
                "repeat": 1,
                "grid": None,
                "rig": None,
                "hand": hand,
                "input": heard,
                "more": True,
            }
            | changes
        ),
    )
    return grids


def test_near_a_condition_that_the_others_do_not_predict(monkeypatch, capsys, tmp_path) -> None:
    folder = recorded(tmp_path / "oak", louder=(150.0, 1.5))
    (grid,) = asked(monkeypatch, folder)
    adjoining = {(100.0, 1.0), (100.0, 2.0), (200.0, 1.0), (200.0, 2.0)}
    assert adjoining <= set(grid.conditions)
    assert set(grid.speeds_mm_s) == {speed for speed, _ in grid.conditions}
    assert set(grid.forces_n) == {force for _, force in grid.conditions}
    assert "150 mm/s at 1.5 N" in capsys.readouterr().out
    (again,) = asked(monkeypatch, folder)
    assert again.to_dict() == grid.to_dict()


def test_along_one_force(monkeypatch, tmp_path) -> None:
    speeds = [50.0 + 30 * step for step in range(11)]
    folder = recorded(tmp_path / "oak", louder=(200.0, 1.5), speeds=speeds, forces=[1.5])
    (grid,) = asked(monkeypatch, folder)
    assert {(185.0, 1.5), (215.0, 1.5)} <= set(grid.conditions)
    assert grid.forces_n.tolist() == [1.5]


def test_nothing_where_all_are_predicted_alike(monkeypatch, capsys, tmp_path) -> None:
    assert asked(monkeypatch, recorded(tmp_path / "oak")) == []
    assert capsys.readouterr().out.splitlines()[-1] == NOTHING_MORE


def test_what_more_cannot_be_asked_of_is_refused(monkeypatch, tmp_path) -> None:
    small = recorded(tmp_path / "small", speeds=SPEEDS[:2], forces=FORCES[:2])
    with refused(InputError, names=small, expected=["oak", "leave some out"], got=4):
        asked(monkeypatch, small)
    with refused(InputError, names=small, expected="ash", got="oak"):
        asked(monkeypatch, small, texture="ash")
    with refused(InputError, names=tmp_path / "new", expected="recordings", got="none"):
        asked(monkeypatch, tmp_path / "new")
    with refused(ValueError, expected=["--more", "--grid"], got=["both", "grid.toml"]):
        asked(monkeypatch, small, grid=Path("grid.toml"))
    assert not (tmp_path / "new").exists()


@pytest.mark.parametrize("here", [None, (200.0, 2.0)])
def test_the_map_leaves_cells_blank_that_are_not_wanted(here) -> None:
    wanted = [(100.0, 1.0), (200.0, 2.0)]
    grid = StrokeGrid([100.0, 200.0], [1.0, 2.0], conditions=wanted)
    table = grid_table(Coverage(grid, 1.0, seconds={wanted[0]: 1.0}), wanted[1], here=here)
    screen = io.StringIO()
    Console(file=screen, width=60).print(table)
    rows = [line.split("│")[1:4] for line in screen.getvalue().splitlines() if "│" in line]
    cells = [[cell.strip() for cell in row] for row in rows]
    assert cells == [["2", "", ">*-" if here else ">-"], ["1", "ok", ""]]
