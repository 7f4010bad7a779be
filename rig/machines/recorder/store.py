"""A folder that a recorder fills, one record after another (docs/recorder.md#folder)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from math import inf
from pathlib import Path
from typing import Annotated, Any, ClassVar

from tactileq.modeling import Recording, RecordingSet
from tactileq.modeling.arrays import Floats
from tactileq.modeling.errors import InputError, shown
from tactileq.modeling.files.columns import Column, chosen
from tactileq.modeling.files.described import FileSection, key
from tactileq.modeling.files.documents import dump_json, read_json_object
from tactileq.modeling.files.folders import folder_behind
from tactileq.modeling.files.kinds import TextureName
from tactileq.modeling.files.provenance import PROVENANCE_NAME, provenance_text
from tactileq.modeling.files.tables import read_cells, table_text, typed
from tactileq.modeling.files.writing import write_text
from tactileq.modeling.models.grid import Condition
from tactileq.modeling.recordings.appending import append
from tactileq.modeling.recordings.recording_set import INDEX_COLUMNS, INDEX_NAME, listed, stated
from tactileq.rig.machines.recorder.driver import DriverRecord
from tactileq.rig.recording.capture.pieces import Plan
from tactileq.rig.recording.capture.recorded import (
    begin_index,
    check_continues,
    recorded_conditions,
    unusable_recordings,
)

PLAN_NAME = "recorder.json"
TABLE_NAME = "recorder.tsv"


def _number(name: str, unit: str, description: str) -> Column:
    return Column(name, unit=unit, description=description, limits=(-inf, inf), nan=True)


RECORDER_COLUMNS = (
    Column("texture", description="Name of the surface", required=True),
    *(
        replace(column, description=f"{description} that was commanded, the condition")
        for column, description in zip(
            chosen(INDEX_COLUMNS, "speed_mm_s", "force_n"), ("Speed", "Force"), strict=True
        )
    ),
    *(replace(column, optional=False, required=True) for column in chosen(INDEX_COLUMNS, "repeat")),
    _number("mean_speed_mm_s", "mm/s", "Mean speed, by the turntable's encoder"),
    _number("speed_sd_mm_s", "mm/s", "Its standard deviation"),
    _number("mean_force_n", "N", "Mean of the estimated force"),
    _number("force_sd_n", "N", "Its standard deviation"),
    _number("start_turn", "turns", "Place of the ball at the start, since the turntable's index"),
    _number("end_turn", "turns", "The same at the end"),
    _number("radius_mm", "mm", "From the turntable's axis to the ball"),
    _number("hottest_a2_s", "A²·s", "Largest heat of a motor: integral of i² above the nominal"),
    Column(
        "attempts",
        description="How many it took; the others were refused",
        limits=(1, inf),
        whole=True,
        required=True,
    ),
    Column(
        "simulated",
        description="Whether the recorder was simulated",
        levels={"true": "simulated", "false": "recorded"},
        required=True,
    ),
    _number("true_speed_mm_s", "mm/s", "Of a simulated recorder: mean speed of the mechanics"),
    _number("true_force_n", "N", "Of a simulated recorder: mean force on the sample"),
)


@dataclass(frozen=True, kw_only=True)
class RecorderPlan(FileSection):
    """What a recorder is to record into a folder; it stands there until another plan follows."""

    WHERE: ClassVar[str] = PLAN_NAME
    texture: TextureName
    conditions: Annotated[
        tuple[tuple[float, float], ...], key("pairs of speed and force", unit="mm/s, N")
    ]
    rate_hz: Annotated[float, key("of the sensor", unit="Hz", gt=0)]
    duration_s: Annotated[float, key("of each record", unit="s", gt=0)]
    repeat: Annotated[int, key("number of the repeat of each condition", ge=1)]
    radius_mm: Annotated[float, key("of the track", unit="mm", gt=0)]
    simulated: Annotated[bool, key("whether the recorder is simulated")]
    seed: Annotated[int, key("of a simulated recorder", ge=0)] | None = None


@dataclass(frozen=True)
class Kept:
    """A record that is to be stored.

    Parameters
    ----------
    samples_g : (n,) ndarray
    true : (speed, force), optional
        Of a simulated recorder's mechanics.
    """

    condition: Condition
    samples_g: Floats
    record: DriverRecord
    attempts: int
    true: tuple[float, float] | None = None


class RecorderStore:
    """A folder of recordings that a recorder fills; opened again, it continues.

    Every record is added at once with its row of the recorder's table, so that the folder is a
    recording set at any time. The plan stands beside it until another one follows.

    Parameters
    ----------
    folder : str or Path
        A new one, one that was filled so before, or another recording set.
    plan : Plan
    radius_mm : float
        From the turntable's axis to the ball.
    provenance : mapping
        Of this run.
    seed : int, optional
        Of a simulated recorder.

    Raises
    ------
    InputError
        For a folder that holds something else, an interrupted plan of another texture or rate, or
        the same texture and repeat of another seed.
    """

    def __init__(
        self,
        folder: str | Path,
        plan: Plan,
        *,
        radius_mm: float,
        provenance: Mapping[str, Any] | None = None,
        seed: int | None = None,
    ) -> None:
        self.folder = folder_behind(folder)
        self.plan, self._radius_mm, self._seed = plan, radius_mm, seed
        self._provenance = dict(provenance or {})
        check_continues(self.folder, PLAN_NAME)
        self._check_interrupted()
        self._check_alike()
        self._recorded = recorded_conditions(self.folder, plan.texture, plan.repeat)
        self.damaged = list(
            unusable_recordings(self.folder, plan.texture) if self._recorded else ()
        )
        known = {self._condition_of(row) for _, row in self._read() if self._is_ours(row)}
        if gone := len(self._recorded - known) if (self.folder / PLAN_NAME).is_file() else 0:
            self.damaged.append(
                f"expected a row of {TABLE_NAME} for each recording of {plan.texture} in "
                f"{self.folder}, got none for {gone}; what the recorder said of them is lost, "
                "restore the table from a copy."
            )

    @property
    def missing(self) -> list[Condition]:
        """Conditions of the plan that are not recorded yet."""
        return [one for one in self.plan.grid.conditions if one not in self._recorded]

    def begin(self) -> None:
        """Write the plan, unless it is there already."""
        if lost := begin_index(self.folder):
            self.damaged.append(f"{lost}; restore it from a copy, or all is recorded again.")
        write_text(self.folder / PLAN_NAME, dump_json(asdict(self._now)))

    def add(self, kept: Kept) -> None:
        """Store a record for good."""
        recording = Recording(
            kept.samples_g,
            self.plan.rate_hz,
            *kept.condition,
            self.plan.texture,
            simulated=self.plan.simulated,
            repeat=self.plan.repeat,
        )
        beside = {
            TABLE_NAME: table_text(
                RECORDER_COLUMNS, [*self.rows(), self._row(kept)], missing=""
            ).encode(),
            PROVENANCE_NAME: provenance_text(self._provenance).encode(),
        }
        append(self.folder, RecordingSet([recording]), [None], beside=beside)
        self._recorded.add(kept.condition)

    def rows(self) -> list[Mapping[str, object]]:
        """The table as it is, without the row of a record that a killed run did not add."""
        return [
            row
            for row, values in self._read()
            if not self._is_ours(values) or self._condition_of(values) in self._recorded
        ]

    def _read(self) -> list[tuple[Mapping[str, object], Mapping[str, Any]]]:
        """The rows of the table, each as its text and as what it says."""
        table = self.folder / TABLE_NAME
        if not table.is_file():
            return []
        rows = read_cells(table, RECORDER_COLUMNS)
        return [(row, typed(row, RECORDER_COLUMNS, where)) for where, row in rows]

    def _is_ours(self, row: Mapping[str, Any]) -> bool:
        return (row["texture"], row["repeat"]) == (self.plan.texture, self.plan.repeat)

    @staticmethod
    def _condition_of(row: Mapping[str, Any]) -> Condition:
        return row["speed_mm_s"], row["force_n"]

    def _check_alike(self) -> None:
        """Refuse to count recordings that this plan would not make."""
        if not (self.folder / INDEX_NAME).is_file():
            return
        plan = self.plan
        wanted = {
            "rate_hz": plan.rate_hz,
            "samples": plan.wanted_samples,
            "simulated": str(plan.simulated).lower(),
        }
        for cells in listed(self.folder):
            row = stated(self.folder, cells)
            if (row["texture"], row["repeat"] or 1) != (plan.texture, plan.repeat):
                continue
            for name, value in wanted.items():
                there = row[name] or ("false" if name == "simulated" else None)
                if there is not None and there != value:
                    raise InputError(
                        f"expected recordings of {plan.texture} in {self.folder} like those that "
                        f"are there, with {name} {_plain(there)}, got {_plain(value)}; choose "
                        "another folder, or another --repeat."
                    )

    def _row(self, kept: Kept) -> dict[str, object]:
        record, true = kept.record, kept.true or ("", "")
        return {
            "texture": self.plan.texture,
            "speed_mm_s": kept.condition[0],
            "force_n": kept.condition[1],
            "repeat": self.plan.repeat,
            "mean_speed_mm_s": f"{record.speed_mm_s:.6g}",
            "speed_sd_mm_s": f"{record.speed_sd_mm_s:.4g}",
            "mean_force_n": f"{record.force_n:.6g}",
            "force_sd_n": f"{record.force_sd_n:.4g}",
            "start_turn": f"{record.start_turn:.5f}",
            "end_turn": f"{record.end_turn:.5f}",
            "radius_mm": self._radius_mm,
            "hottest_a2_s": f"{record.hottest_a2_s:.4g}",
            "attempts": kept.attempts,
            "simulated": self.plan.simulated,
            "true_speed_mm_s": true[0] if true[0] == "" else f"{true[0]:.6g}",
            "true_force_n": true[1] if true[1] == "" else f"{true[1]:.6g}",
        }

    @property
    def _now(self) -> RecorderPlan:
        plan = self.plan
        return RecorderPlan(
            texture=plan.texture,
            conditions=tuple(plan.grid.conditions),
            rate_hz=plan.rate_hz,
            duration_s=plan.wanted_s,
            repeat=plan.repeat,
            radius_mm=self._radius_mm,
            simulated=plan.simulated,
            seed=self._seed,
        )

    def _check_interrupted(self) -> None:
        """Refuse to leave a plan unfinished for another texture, or to go on otherwise."""
        path = self.folder / PLAN_NAME
        if not path.is_file():
            return
        advice = "remove the file to begin a new plan"
        before = RecorderPlan.read(
            read_json_object(path, what="a recorder's plan", advice=advice), folder=self.folder
        )
        self._check_seed(before)
        wanted = set(before.conditions)
        done = wanted & recorded_conditions(self.folder, before.texture, before.repeat)
        if done == wanted:
            return
        for name in ("texture", "rate_hz", "duration_s", "radius_mm", "simulated"):
            was, now = getattr(before, name), getattr(self._now, name)
            if was != now:
                raise InputError(
                    f"expected to go on with the interrupted plan in {self.folder} "
                    f"({len(done)} of {len(wanted)} conditions of {before.texture} recorded), "
                    f"which has {name} {_plain(was)}, got {_plain(now)}; finish it, or choose "
                    "another folder."
                )

    def _check_seed(self, before: RecorderPlan) -> None:
        """Refuse another sample for the same recordings, whether or not the plan is finished."""
        same = (before.texture, before.repeat) == (self.plan.texture, self.plan.repeat)
        if same and None not in (before.seed, self._seed) and before.seed != self._seed:
            raise InputError(
                f"expected to go on with --seed {before.seed}, as the recordings of "
                f"{before.texture} in {self.folder} were begun, got {self._seed}; give --seed "
                f"{before.seed}, or choose another folder, or another --repeat."
            )


def _plain(value: object) -> str:
    return f"{value:g}" if isinstance(value, float) else shown(value)
