"""What a study may refuse of a rig, one sentence each."""

from __future__ import annotations

from dataclasses import replace
from datetime import date, timedelta
from pathlib import Path

import pytest

from tactileq.modeling import InputError
from tactileq.rig.desk.checks import Requirements, check_models, check_rig
from tactileq.stimuli.planted.textures import planted_texture
from tests.modeling.rendering.lattices import planted_ar
from tests.refusals import refused
from tests.rig.desk.rig_files import rig_file

TODAY = date.today()
STRICT = Requirements(calibration_days=30, measured_force=True)


def told(folder: Path, *changes: tuple[str, str], today: date = TODAY, **more: object) -> str:
    rig = rig_file(folder, *changes)
    with pytest.raises(InputError) as refused:
        check_rig(rig, STRICT, today=today, **more)  # type: ignore[arg-type]
    message = str(refused.value)
    assert message.startswith("expected")
    assert message.endswith(".")
    assert str(rig.path) in message
    return message


def test_a_calibrated_rig_of_today_is_accepted_and_one_day_beyond_the_age_is_not(
    tmp_path: Path,
) -> None:
    rig = rig_file(tmp_path)
    check_rig(rig, STRICT, today=TODAY)
    check_rig(rig, STRICT, today=TODAY + timedelta(30))
    assert "of the last 30 days" in told(tmp_path, today=TODAY + timedelta(31))
    assert f"got one of {TODAY}" in told(tmp_path, today=TODAY - timedelta(1))


def test_no_calibration_is_refused_unless_there_is_no_study(tmp_path: Path) -> None:
    calibration = f'[calibration]\ndate = {TODAY}\nrig = "{tmp_path / "rig.toml"}"\n'
    without = (calibration + 'serials = ["V1", "C1"]\n', "")
    assert "got no [calibration]" in told(tmp_path, without)
    check_rig(rig_file(tmp_path, without), None, today=TODAY)


@pytest.mark.parametrize(
    ("change", "got"),
    [
        (('serials = ["V1", "C1"]', 'serials = ["V2", "C1"]'), "got that of the rig"),
        (('serials = ["V1", "C1"]', "serials = []"), "got that of the rig"),
        (("[calibration]\ndate", '[calibration]\nrig = "x"\n#'), ""),
    ],
)
def test_the_calibration_of_another_rig_is_refused(
    tmp_path: Path, change: tuple[str, str], got: str
) -> None:
    if not got:
        name = str(tmp_path / "rig.toml")
        change = (f'\nrig = "{name}"', '\nrig = "another"')
        got = "got that of the rig 'another'"
    assert got in told(tmp_path, change)


def test_the_force_of_a_mouse_is_refused_where_the_study_wants_it_measured(tmp_path: Path) -> None:
    mouse = (
        'kind = "scripted"',
        'kind = "mouse"\n'
        'counts_per_mm = { value = 40.0, unit = "counts/mm", assumed = true, source = "" }\n'
        'assumed_force_n = { value = 1.0, unit = "N", assumed = true, source = "" }',
    )
    assert "measures force, as the study requires, got a mouse" in told(tmp_path, mouse)
    free = Requirements(calibration_days=30, measured_force=False)
    check_rig(rig_file(tmp_path, mouse), free, today=TODAY)


def test_a_pointer_that_also_answers_is_no_hand_of_a_study(tmp_path: Path) -> None:
    pointer = (
        'kind = "scripted"',
        'kind = "window"\n'
        'counts_per_mm = { value = 4.0, unit = "counts/mm", assumed = true, source = "" }\n'
        'assumed_force_n = { value = 1.0, unit = "N", assumed = true, source = "" }',
    )
    assert 'got kind = "window"' in told(tmp_path, pointer)
    check_rig(rig_file(tmp_path, pointer), None, today=TODAY)


def test_models_in_another_unit_or_of_a_higher_rate_are_refused(tmp_path: Path) -> None:
    model = planted_texture("PVC")
    check_models(rig_file(tmp_path), [model])
    with refused(InputError, expected=["g", tmp_path / "rig.toml"], got=["PVC", "'arbitrary'"]):
        check_models(rig_file(tmp_path), [model, replace(model, unit="arbitrary")])
    slow = rig_file(tmp_path, ("rate_hz = 48000", "rate_hz = 4000"))
    with refused(
        InputError,
        expected=["sound.rate_hz", "4000 Hz", tmp_path / "rig.toml"],
        got=["PVC", "5000 Hz"],
    ):
        check_models(slow, [model])


def test_all_pole_models_are_accepted_where_the_cards_rate_can_be_made_of_theirs(
    tmp_path: Path,
) -> None:
    rig, rival = rig_file(tmp_path), planted_ar()
    check_models(rig, [planted_texture("PVC"), rival, planted_ar(rate_hz=44100.0)])
    with refused(InputError, expected=4000, got=["5000.1 Hz", "48000.0 Hz"]):
        check_models(rig, [rival, planted_ar(rate_hz=5000.1)])
    with refused(InputError, expected="g", got=["planted", "'arbitrary'"]):
        check_models(rig, [replace(rival, unit="arbitrary")])


def test_a_latency_above_40_ms_needs_a_reason_whatever_the_study(tmp_path: Path) -> None:
    slow = ("p95_ms = { value = 18.0", "p95_ms = { value = 40.5")
    assert "at most 40 ms from hand to vibration, got latency.p95_ms of 40.5 ms" in told(
        tmp_path, slow
    )
    rig = rig_file(tmp_path, slow)
    with refused(
        InputError,
        names="--override",
        expected="40 ms",
        got=["latency.p95_ms", "40.5 ms", tmp_path / "rig.toml"],
    ):
        check_rig(rig, None, today=TODAY)
    check_rig(rig, STRICT, today=TODAY, override="only a pilot")
    check_rig(rig_file(tmp_path, (slow[0], "p95_ms = { value = 40.0")), None, today=TODAY)
