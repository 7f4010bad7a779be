"""Requirements on a rig before people use it."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from datetime import date

from tactileq.modeling import InputError
from tactileq.modeling.errors import shown
from tactileq.modeling.models.ar_model import ARModel
from tactileq.modeling.models.loading import AnyModel
from tactileq.modeling.rendering.lattice import lattice_fields
from tactileq.modeling.rendering.plan import plan_for
from tactileq.rig.desk.parts import vibration_output
from tactileq.rig.desk.stimuli import check_stimulus
from tactileq.rig.desk.walls import Walls, check_walls, usual_wall
from tactileq.rig.shared.interface import Presentable, Stimulus
from tactileq.rig.shared.live.memory import Live
from tactileq.rig.shared.setup.rig_file import RigFile
from tactileq.rig.shared.setup.sections import CALIBRATION_DAYS

HIGHEST_LATENCY_MS = 40.0  # textures are felt to change there (Okamoto and others 2009)


@dataclass(frozen=True, kw_only=True)
class Requirements:
    """What a study requires of a rig; by default what one does that says nothing of it.

    Parameters
    ----------
    calibration_days : float
        Greatest age of the calibration.
    measured_force : bool
        Whether the force must be measured.
    """

    calibration_days: float = CALIBRATION_DAYS
    measured_force: bool = False


def check_rig(
    rig: RigFile,
    requirements: Requirements | None,
    *,
    today: date,
    override: str | None = None,
    walls: Walls | None = None,
) -> None:
    """Refuse a rig that no session can use, or that is not what a study requires.

    Parameters
    ----------
    requirements : Requirements, optional
        Without them neither the age of the calibration nor the hand is checked.
    today : date
    override : str, optional
        Reason to use it although its latency is too long, or a wall too stiff to be passive.
    walls : Walls, optional
        Of a force device; without it the usual one.

    Raises
    ------
    InputError
        For a p95 of the latency above 40 ms, or one of another card, block or hand, without an
        override; for no calibration, one that does not fit this rig, or an older one than allowed;
        for an assumed force where it must be measured; for a window's pointer as the hand in a
        study; for limits that the card cannot play; for a wall that the device cannot render.
    """
    for check in _checks(rig, requirements, today=today, override=override, walls=walls).values():
        check()


def refusals(
    rig: RigFile,
    requirements: Requirements,
    *,
    today: date,
    walls: Walls | None = None,
    presented: Iterable[Presentable] = (),
) -> dict[str, str]:
    """Why sessions refuse a rig, all that `check_rig` and `check_models` say, by what it is about.

    Empty for a rig that they accept. Needs no device.
    """
    checks = _checks(rig, requirements, today=today, override=None, walls=walls)
    checks["models"] = lambda: check_models(_uncalibrated(rig), presented)
    refused = {}
    for name, check in checks.items():
        try:
            check()
        except InputError as error:
            refused[name] = str(error)
    return refused


def _checks(
    rig: RigFile,
    requirements: Requirements | None,
    *,
    today: date,
    override: str | None,
    walls: Walls | None,
) -> dict[str, Callable[[], None]]:
    return {
        "latency": lambda: _check_latency(rig, override),
        "calibration": lambda: _check_calibration(rig, requirements, today),
        "hand": lambda: _check_hand(rig, requirements),
        "output": lambda: _check_output(rig),
        "wall": lambda: _check_walls(rig, walls, override),
    }


def _uncalibrated(rig: RigFile) -> RigFile:
    """As it is without its calibration, which is another question."""
    return replace(rig, calibration=None)


def _check_output(rig: RigFile) -> None:
    with Live.create() as live:
        vibration_output(_uncalibrated(rig), live)


def _check_walls(rig: RigFile, walls: Walls | None, override: str | None) -> None:
    if walls is None and rig.force_device is not None:
        walls = Walls(usual=usual_wall(rig))
    if walls is not None:
        check_walls(rig, walls, override=override)


def _check_hand(rig: RigFile, requirements: Requirements | None) -> None:
    if requirements is None:
        return
    if rig.hand.kind == "window":
        raise InputError(
            f'expected a hand with a device of its own in a study, got kind = "window" under [hand]'
            f" in {rig.path}, whose pointer the participant needs to answer; use a tablet, a mouse "
            "or a serial sensor."
        )
    if requirements.measured_force and not rig.hand.measures_force:
        raise InputError(
            f"expected a rig that measures force, as the study requires, got a {rig.hand.kind} "
            f"under [hand] in {rig.path}, of which it is assumed; use a device that measures it."
        )


def check_models(rig: RigFile, models: Iterable[Presentable]) -> None:
    """Refuse models and stimuli that a rig cannot play, or not at their level and rate.

    Raises
    ------
    InputError
        For a model that is not in g, or of a higher rate than the card's; for an AR model that
        `lattice_fields` refuses. Where a device renders it, as
        `tactileq.rig.machines.device.models.device_model`. For a stimulus as `check_stimulus`.
    """
    for model in models:
        if isinstance(model, Stimulus):
            check_stimulus(rig, model)
            continue
        if model.unit != "g":
            raise InputError(
                f"expected models in g for the rig in {rig.path}, got {model.texture} in unit "
                f"{shown(model.unit)}; record it with a calibrated sensor."
            )
        if rig.renderer is not None:
            _check_on_device(rig, model)
            continue
        if model.rate_hz > rig.sound.rate_hz:
            raise InputError(
                f"expected models of at most sound.rate_hz, {rig.sound.rate_hz:g} Hz in {rig.path},"
                f" got {model.texture} of {model.rate_hz:g} Hz; choose a higher rate of the card."
            )
        plan = plan_for(model.rate_hz, rate_hz=rig.sound.rate_hz)
        if isinstance(model, ARModel):
            lattice_fields(model, plan)


def _check_on_device(rig: RigFile, model: AnyModel) -> None:
    from tactileq.rig.machines.device.models import ANY_DEVICE, device_model  # needs the extra rig

    device_model(model, ANY_DEVICE, limits=rig.safe_limits)


def _check_latency(rig: RigFile, override: str | None) -> None:
    if rig.latency is None or override is not None:
        return
    rig.check_latency()
    p95 = rig.latency.p95_ms.value
    if p95 > HIGHEST_LATENCY_MS:
        raise InputError(
            f"expected at most {HIGHEST_LATENCY_MS:g} ms from hand to vibration, got latency.p95_ms"
            f" of {p95:g} ms in {rig.path}; make blocks smaller, or give --override with a reason, "
            "which is stored."
        )


def _check_calibration(rig: RigFile, requirements: Requirements | None, today: date) -> None:
    rig.check_calibration()
    if requirements is None:
        return
    calibration, again = rig.calibration, "calibrate it (tactileq rig calibrate level)"
    if calibration is None:
        raise InputError(f"expected a calibrated rig, got no [calibration] in {rig.path}; {again}.")
    age = (today - calibration.date).days
    if not 0 <= age <= requirements.calibration_days:
        raise InputError(
            f"expected a calibration of the last {requirements.calibration_days:g} days in "
            f"{rig.path}, as the study requires, got one of {calibration.date}; {again}."
        )
