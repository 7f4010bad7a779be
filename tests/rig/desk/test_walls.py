"""Walls of a study on a rig's force device."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from tactileq.experiments.study.wall import WallSection, WallUnder
from tactileq.modeling import InputError
from tactileq.rig.desk.walls import Walls, check_walls, in_device, usual_wall
from tactileq.rig.machines.force.wall import Wall
from tactileq.rig.shared.setup.rig_file import RigFile
from tests.rig.desk.rig_files import rig_file
from tests.rig.machines.force.rig_files import force_rig

REAL = """hand_measured = false
offset_mm = { value = 30.0, unit = "mm", assumed = false, source = "a ruler" }
stiffness = { value = 0.7, unit = "N/mm", assumed = false, source = "pressed" }"""
POSE = """[pose]
origin_mm = [10.0, 0.0, -20.0]
x = [0.0, 1.0, 0.0]
z = [1.0, 0.0, 0.0]
measured_on = 2026-11-28
[latency]"""


@pytest.fixture
def rig(tmp_path: Path) -> RigFile:
    return force_rig(tmp_path, ("hand_measured = false", REAL))


def test_a_wall_is_like_the_real_surface_unless_the_study_says_more(rig: RigFile) -> None:
    usual = usual_wall(rig)
    assert (usual.height_mm, usual.stiffness_n_per_mm) == (30.0, 0.7)
    wall, own = WallSection().walls(usual)
    assert (wall.height_mm, wall.stiffness_n_per_mm) == (30.0, 0.7)
    assert own == {}
    soft = WallUnder(texture="MDF", stiffness_n_per_mm=0.4)
    low = WallUnder(texture="PVC", height_mm=-2.0, damping_n_s_per_m=0.0)
    section = WallSection(height_mm=5, damping_n_s_per_m=0.2, width_mm=60, under=(soft, low))
    wall, own = section.walls(usual)
    shared = {"damping_n_s_per_m": 0.2, "width_mm": 60, "length_mm": 100.0}
    assert wall == Wall(height_mm=5, stiffness_n_per_mm=0.7, **shared)
    walls = Walls(usual=wall, by_texture=own)
    assert walls.of("MDF") == replace(wall, stiffness_n_per_mm=0.4)
    assert walls.of("PVC") == replace(wall, height_mm=-2.0, damping_n_s_per_m=0.0)
    assert walls.of("canvas") == wall


def test_without_a_measured_surface_it_is_half_of_the_largest_that_is_passive(
    tmp_path: Path,
) -> None:
    # b = 2 N·s/m, T = 2 nominal periods, T/2 + t_d = 1 + 1 ms: 1 N/mm at most.
    assert usual_wall(force_rig(tmp_path)).stiffness_n_per_mm == pytest.approx(2 / 2 / 2)


def test_a_stiff_wall_needs_a_reason_and_a_far_one_has_none(rig: RigFile) -> None:
    stiff = Walls(usual=Wall(stiffness_n_per_mm=1.4))
    with pytest.raises(InputError, match=r"at most 1 N/mm"):
        check_walls(rig, stiff)
    check_walls(rig, stiff, override="damped by a heavy hand")
    check_walls(rig, Walls(usual=Wall(stiffness_n_per_mm=1.0)))
    far = Walls(usual=Wall(height_mm=150, stiffness_n_per_mm=0.5))
    with pytest.raises(InputError, match="z = 150 mm"):
        check_walls(rig, far, override="it is far")


def test_the_pose_says_where_a_wall_is(tmp_path: Path) -> None:
    rig = force_rig(tmp_path, ("[latency]", POSE))
    # y of the wall's frame is z × x = the device's z.
    assert in_device(rig, (1.0, 2.0, 3.0)) == pytest.approx((13.0, 1.0, -18.0))
    check_walls(
        rig, Walls(usual=Wall(height_mm=85, width_mm=100, length_mm=100, stiffness_n_per_mm=0.5))
    )
    with pytest.raises(InputError, match="x = 105 mm"):
        check_walls(
            rig,
            Walls(usual=Wall(height_mm=95, width_mm=100, length_mm=100, stiffness_n_per_mm=0.5)),
        )


def test_a_rig_without_a_device_renders_no_wall(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="expected a force device for a wall"):
        check_walls(rig_file(tmp_path), Walls(usual=Wall(stiffness_n_per_mm=0.5)))


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"stiffness_n_per_mm": 0.0}, "stiffness_n_per_mm"),
        ({"stiffness_n_per_mm": float("nan")}, "stiffness_n_per_mm"),
        ({"damping_n_s_per_m": -1.0}, "damping_n_s_per_m"),
        ({"width_mm": 0.0}, "width_mm"),
        ({"height_mm": 1e9}, "height_mm"),
    ],
)
def test_values_that_are_no_wall_are_refused(change: dict[str, float], told: str) -> None:
    with pytest.raises(InputError, match=told):
        Wall(**{"stiffness_n_per_mm": 1.0, **change})
