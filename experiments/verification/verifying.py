"""Is everything in a data set as it was stored? Reads only.

docs/method/verification.md
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from tactileq.experiments.sessions.bids.export import differing_tables
from tactileq.experiments.sessions.kept.data_set import (
    BIDS_VERSIONS,
    DATASET_TYPE,
    DESCRIPTION_NAME,
    MAY_DIFFER,
    describe_data_set,
    generated_by,
    is_other,
)
from tactileq.experiments.sessions.kept.files import SessionFiles, require_data_folder, sessions_in
from tactileq.experiments.sessions.kept.manifest import SessionManifest
from tactileq.experiments.sessions.kept.roster import Roster
from tactileq.experiments.sessions.kept.stored_sessions import Damaged, StoredSession, held_sessions
from tactileq.experiments.sessions.kept.texts import texts_of_sessions
from tactileq.experiments.study.study import Study, plan_sha256
from tactileq.experiments.tasks import task_named
from tactileq.experiments.verification.copies import copied
from tactileq.experiments.verification.difference import Difference
from tactileq.experiments.verification.orders import drawn_trials
from tactileq.experiments.verification.replaying import contradictions
from tactileq.experiments.verification.sidecars import check_sidecars
from tactileq.modeling import InputError
from tactileq.modeling.errors import counted, shown
from tactileq.modeling.files.documents import read_json_object
from tactileq.modeling.files.hashes import seal_over, sha256_of_paths

_OF_A_SESSION = re.compile(r"(sub-\d+)_ses-\d+_task-.*")
# Of the description: what the first session fixes. `_by_program` looks at what the program writes
# by itself; the name stands in the README, too; the rest is for people to fill in.
_FIXED = (
    "Simulated",
    "SimulatedParticipant",
    "SimulatedRig",
    "Pilot",
    "StudySHA256",
    "ModelsSHA256",
    "TextsSHA256",
    "StudyDesign",
)


@dataclass(frozen=True, kw_only=True)
class Verified:
    """What became of verifying a data set.

    Parameters
    ----------
    differences : tuple of Difference
        Empty where everything is as it was stored.
    sessions : tuple of str
        Those that have ended, as sub-01_ses-01_task-absolute.
    running : tuple of str
        Those that a console runs now, of which nothing is verified.
    unsealed : tuple of str
        Those whose log an earlier version wrote, without seals.
    seal : str
        8 hexadecimal digits over the seals of all logs.
    with_source : bool
        Whether there are logs; without, only hashes in sidecars could be compared.
    manifests : tuple of SessionManifest
        Of all sessions that can be read.
    earlier : tuple of str
        Tables, sidecars and README that an earlier version made, with the values of the logs.
    """

    differences: tuple[Difference, ...]
    sessions: tuple[str, ...]
    running: tuple[str, ...] = ()
    unsealed: tuple[str, ...] = ()
    seal: str = ""
    with_source: bool = True
    manifests: tuple[SessionManifest, ...] = ()
    earlier: tuple[str, ...] = ()

    def without(self, participants: Collection[str]) -> Verified:
        """Without what is about these participants (sub-01) alone."""
        kept = tuple(f for f in self.differences if f.participant not in participants)
        sessions = tuple(s for s in self.sessions if s.partition("_")[0] not in participants)
        earlier = tuple(p for p in self.earlier if p.partition("/")[0] not in participants)
        return replace(self, differences=kept, sessions=sessions, earlier=earlier)

    @property
    def summary(self) -> str:
        """One line, as 68 of 68 sessions verified, seal 3fa9c1d2."""
        wrong = {Path(one.place).name for one in self.differences}
        sound = sum(not any(w.startswith(f"{s}_") for w in wrong) for s in self.sessions)
        said = f"{sound} of {counted(len(self.sessions), 'session')} verified"
        if not self.with_source:
            said += " by the hashes in their sidecars (there is no source data)"
        if self.seal:
            said += f", seal {self.seal}"
        if self.unsealed:
            said += f", {len(self.unsealed)} without seals (of an earlier version)"
        if self.earlier:
            said += f", {counted(len(self.earlier), 'file')} made by an earlier version"
        if self.running:
            said += f", {len(self.running)} still running"
        if self.differences:
            said += f"; {counted(len(self.differences), 'difference')}"
        return said


def verify_data(data_folder: str | Path) -> Verified:
    """Compare everything in a data set with what its sessions must have stored.

    docs/method/verification.md says what is compared with what.

    Parameters
    ----------
    data_folder : path
        Root of the data set. Nothing is written.

    Raises
    ------
    InputError
        If there is no such folder, or it is not that of a study.
    """
    root = Path(data_folder)
    require_data_folder(root)
    if not sessions_in(root) and not Roster(root).path.exists():  # else all withdrew
        return _published(root)
    held, damaged = held_sessions(root)
    ended = [one for one in held if one.state.events and not one.running]
    found = [
        Difference(place=_in(root, one), sentence=one.sentence, participant=one.files.participant)
        for one in damaged
    ]
    for one in ended:
        found += _of_session(root, one)
    differing, earlier = differing_tables(root, held, damaged)
    found += _tables(root, differing)
    found += _strangers(root, held, damaged)
    found += _people(root, held)
    found += _description(root, held)
    found += _texts(root, held)
    found += _chains(root, held, damaged)
    found += [
        Difference(place=_in(root, one), sentence=sentence, participant=one.files.participant)
        for one, sentence in copied(ended)
    ]
    seals = {one.files.stem: _seal(one) for one in ended}
    sealed = {stem: seal for stem, seal in seals.items() if seal}
    return Verified(
        differences=tuple(found),
        sessions=(*seals, *(one.files.stem for one in damaged)),
        running=tuple(one.files.stem for one in held if one.running),
        unsealed=tuple(stem for stem, seal in seals.items() if not seal),
        seal=seal_over(sealed) if sealed else "",
        manifests=tuple(one.manifest for one in held),
        earlier=tuple(path.relative_to(root).as_posix() for path in earlier),
    )


def _published(root: Path) -> Verified:
    """Data without sessions' own files: only what sidecars state can be compared."""
    differences, sessions = check_sidecars(root)
    if not sessions:
        raise InputError(
            f"expected the data folder of a study, got {root}, in which there is no session; name "
            "the one that holds sourcedata or sub-01."
        )
    return Verified(differences=differences, sessions=sessions, with_source=False)


def _in(root: Path, one: StoredSession | Damaged) -> str:
    return one.files.log.relative_to(root).as_posix()


def _seal(one: StoredSession) -> str:
    return str(one.state.events[-1].get("seal", ""))


def _of_session(root: Path, one: StoredSession) -> Iterator[Difference]:
    """Its order drawn again, its hashes, its log replayed, and the files beside it."""
    who, log = one.files.participant, _in(root, one)
    manifest = one.files.manifest.relative_to(root).as_posix()

    def differs(place: str, sentence: str, trial: int | None = None) -> Difference:
        return Difference(place=place, sentence=sentence, trial=trial, participant=who)

    try:
        study, task = Study.from_dict(one.manifest.study), task_named(one.manifest.task)
        facts = one.manifest
        drawn = drawn_trials(facts, study, task)
    except InputError as error:
        yield differs(manifest, f"expected a study by which its order can be drawn, got {error}")
        return
    for wanted, got in zip(drawn, facts.trials, strict=False):
        if wanted != got:
            names = [n for n in {**wanted, **got} if wanted.get(n) != got.get(n)]
            yield differs(
                manifest,
                f"expected {names[0]} {shown(wanted.get(names[0]))}, as study, seed and slot give "
                f"it, got {shown(got.get(names[0]))}",
                wanted["trial"],
            )
    if len(drawn) != len(facts.trials):
        yield differs(manifest, f"expected {len(drawn)} trials, got {len(facts.trials)}")
    if plan_sha256(study, facts.models_sha256) != facts.plan_sha256:
        yield differs(manifest, "expected the plan_sha256 of this study and these models")
    stated = {t: [set(group) for group in groups] for t, groups in facts.identical.items()}
    for texture, equal in _equal_sets(facts.models_sha256, study.models_of(facts.task)):
        # Stimuli of one model and condition are identical, too, whatever their files.
        if not any(equal <= group for group in stated.get(texture, [])):
            yield differs(
                manifest,
                f"expected the sets {shown(sorted(equal))} of {texture}, whose "
                "models have one SHA-256, among the identical ones, got them as different",
            )
    for trial, sentence in contradictions(one, task):
        yield differs(log, sentence, trial)
    yield from _beside(root, one)


def _equal_sets(
    models: Mapping[str, Mapping[str, str]], names: Sequence[str]
) -> Iterator[tuple[str, set[str]]]:
    """Each texture with those of a task's sets whose models have the same SHA-256."""
    for texture, hashes in models.items():
        by_hash: dict[str, set[str]] = {}
        for name in names:
            by_hash.setdefault(hashes.get(name, name), set()).add(name)
        yield from ((texture, group) for group in by_hash.values() if len(group) > 1)


def _beside(root: Path, one: StoredSession) -> Iterator[Difference]:
    """The files beside the log, whose hashes its last line holds unless it was killed."""
    *_, last = one.state.events
    if last["event"] != "stored":
        return
    stored: Mapping[str, str] = last.get("files", {})
    there = [path for path in one.files.there() if path != one.files.log]
    hashes = {Path(path).name: sha256 for path, sha256 in sha256_of_paths(there).items()}
    for name in sorted({*stored, *hashes}):
        if stored.get(name) != hashes.get(name):
            got = "none" if name not in hashes else "another"
            expected = "no such file" if name not in stored else "the file that its log names"
            yield Difference(
                place=(one.files.folder / name).relative_to(root).as_posix(),
                sentence=f"expected {expected}, got {'one' if name not in stored else got}",
                participant=one.files.participant,
            )


def _tables(root: Path, differing: Sequence[Path]) -> Iterator[Difference]:
    """Every table that its log does not give."""
    for path in differing:
        got = "another" if path.exists() else "none"
        place = path.relative_to(root).as_posix()
        name = place.partition("/")[0]
        yield Difference(
            place=place,
            sentence=f"expected the table that its log gives, got {got}",
            participant=name if name.startswith("sub-") else "",
        )


def _strangers(
    root: Path, held: Sequence[StoredSession], damaged: Sequence[Damaged]
) -> Iterator[Difference]:
    """Files under the name of a session that no session here made."""
    every: list[StoredSession | Damaged] = [*held, *damaged]
    known = {one.files.stem: one.files for one in every}
    listed = {stem: _listed(files) for stem, files in known.items()}
    for folder in ("sourcedata/sub-*/ses-*", "sub-*/ses-*/beh"):
        for path in sorted(root.glob(f"{folder}/sub-*")):
            match = _OF_A_SESSION.fullmatch(path.name)
            if match is None:
                continue
            stem = next((s for s in known if path.name.startswith(f"{s}_")), None)
            place = path.relative_to(root).as_posix()
            if stem is None or path.parent not in (known[stem].folder, known[stem].beh):
                yield Difference(
                    place=place,
                    sentence="expected a file of a session that has a manifest, got one of none",
                    participant=match[1],
                )
                continue
            names = listed[stem]
            if path.parent == known[stem].beh and names is not None and path.name not in names:
                yield Difference(
                    place=place,
                    sentence="expected a file that its session's sidecar lists, got another",
                    participant=match[1],
                )


def _listed(files: SessionFiles) -> Collection[str] | None:
    """Names of the files that a session's sidecar lists; None where it cannot be read."""
    sidecar = files.answers.with_suffix(".json")
    try:
        return {sidecar.name, *read_json_object(sidecar, advice="").get("Files", {})}
    except (InputError, TypeError):
        return None  # the sidecar itself differs, and is named for it


def _people(root: Path, held: Sequence[StoredSession]) -> Iterator[Difference]:
    """The roster against the sessions: who takes part, with which slot and pseudonym."""
    roster = Roster(root).listed()
    place = Roster(root).path.relative_to(root).as_posix()
    if roster.damaged:
        yield Difference(
            place=place, sentence=f"expected a line of everybody, got damage: {roster.damaged}"
        )
    if roster.broken:
        sentence = f"expected the seal over line {roster.broken} and all before it, got another"
        yield Difference(place=place, sentence=sentence)
    elif not roster.sealed and any(one.manifest.after is not None for one in held):
        sentence = "expected lines with seals, as sessions here write them, got none"
        yield Difference(place=place, sentence=sentence)
    for one in held:
        entry, facts = roster.entries.get(one.files.subject), one.manifest
        if entry is None:
            continue  # said above
        who = one.files.participant
        if entry["left"] == "withdrawn":
            sentence = f"expected no data of {who}, who withdrew, got some"
            yield Difference(place=place, sentence=sentence)
        wanted = {"slot": facts.slot, "code": facts.code, "simulated": facts.simulated_participant}
        for name, value in wanted.items():
            if entry["left"] != "withdrawn" and entry[name] != value:
                yield Difference(
                    place=place,
                    sentence=f"expected {name} {shown(value)} of {who}, as {one.files.stem} says, "
                    f"got {shown(entry[name])}",
                    participant=who,
                )
    yield from _slots(roster.entries, place)


def _slots(entries: Mapping[int, Mapping[str, Any]], place: str) -> Iterator[Difference]:
    held: dict[int, int] = {}
    for subject, entry in entries.items():
        if entry["left"]:
            continue
        if entry["slot"] in held:
            yield Difference(
                place=place,
                sentence=f"expected a slot of its own for subject {subject}, got slot "
                f"{entry['slot']}, which subject {held[entry['slot']]} has",
            )
        held[entry["slot"]] = subject


def _description(root: Path, held: Sequence[StoredSession]) -> Iterator[Difference]:
    """The description against the first session, and every session against the description."""
    begun = [one for one in held if one.state.events]
    if not begun:
        return
    try:
        found = read_json_object(root / DESCRIPTION_NAME, advice="restore the file")
    except InputError as error:
        yield Difference(place=DESCRIPTION_NAME, sentence=f"expected a description, got {error}")
        return
    yield from _by_program(root, found, begun)
    described = [(one, describe_data_set(one.manifest)) for one in begun]
    # That of a session that was deleted with its participant may have been the first.
    if not any(not any(is_other(n, found, made) for n in _FIXED) for _, made in described):
        first, made = min(described, key=lambda pair: pair[0].state.begun_utc)
        name = next(n for n in _FIXED if is_other(n, found, made))
        yield Difference(
            place=DESCRIPTION_NAME,
            sentence=f"expected {name} as {first.files.stem} began with, got another",
        )
        return
    for one, made in described:
        allowed = {record["what"] for record in one.manifest.overrides}
        for name, what in MAY_DIFFER.items():
            if is_other(name, found, made) and what not in allowed:
                yield Difference(
                    place=one.files.manifest.relative_to(root).as_posix(),
                    sentence=f"expected the {what} of the data set, or a reason for another, got "
                    "another without one",
                    participant=one.files.participant,
                )


def _texts(root: Path, held: Sequence[StoredSession]) -> Iterator[Difference]:
    """The files of what participants read, by the hashes in manifests and logs."""
    stated = texts_of_sessions(held)
    there = sha256_of_paths(root / path for path in stated)
    for path, sha256 in stated.items():
        found = there.get(str(root / path))
        if found != sha256:
            yield Difference(
                place=path.as_posix(),
                sentence="expected the texts that sessions name by their hash, got "
                f"{'others' if found else 'none'}",
            )


def _by_program(
    root: Path, found: Mapping[str, Any], begun: Sequence[StoredSession]
) -> Iterator[Difference]:
    """What each version of the program writes into a description by itself."""
    wanted = {"BIDSVersion": BIDS_VERSIONS, "DatasetType": (DATASET_TYPE,)}
    differs = [name for name, values in wanted.items() if found.get(name) not in values]
    if not _is_listed(root, found.get("GeneratedBy"), begun):
        differs.append("GeneratedBy")
    for name in differs:
        yield Difference(
            place=DESCRIPTION_NAME,
            sentence=f"expected {name} as a version of tactileq that ran these sessions writes it, "
            f"got {shown(found.get(name))}",
        )


def _is_listed(root: Path, programs: object, begun: Sequence[StoredSession]) -> bool:
    """Whether the program that ran a session is among those that a description lists."""
    listed = (
        [one for one in programs if isinstance(one, dict)] if isinstance(programs, list) else []
    )
    ran = [generated_by(one.manifest) for one in begun]
    if any(one.get("left") == "withdrawn" for one in Roster(root).listed().entries.values()):
        # The first session may have been deleted with its participant, and of an earlier version.
        return any(one.get("Name") == ran[0]["Name"] for one in listed)
    return any(one in listed for one in ran)


def _chains(
    root: Path, held: Sequence[StoredSession], damaged: Sequence[Damaged]
) -> Iterator[Difference]:
    """Seals that roster and later manifests name must stand in the logs that they name."""
    roster = Roster(root)
    listed = roster.listed()
    seals = {one.files.stem: {event.get("seal") for event in one.state.events} for one in held}
    unread = {one.files.stem for one in damaged}
    withdrawn = {
        f"sub-{n:02d}" for n, entry in listed.entries.items() if entry["left"] == "withdrawn"
    }
    place = roster.path.relative_to(root).as_posix()
    named = [(place, "", one.session, one.seal) for one in listed.seals]
    named += [
        (
            one.files.manifest.relative_to(root).as_posix(),
            one.files.participant,
            one.manifest.after.get("session", ""),
            one.manifest.after.get("seal", ""),
        )
        for one in held
        if one.manifest.after
    ]
    noted = {(one.session, one.seal) for one in listed.seals}
    for where, who, session, seal in named:
        if session in unread or session.partition("_")[0] in withdrawn:
            continue
        # Where the roster says the same of it, it is the log that is not as it was.
        about = session.partition("_")[0] if (session, seal) in noted else who
        if session not in seals:
            sentence = f"expected the session {shown(session)}, which it names, got none"
        elif seal not in seals[session]:
            sentence = f"expected the seal {shown(seal)} in the log of {session}, got another log"
        elif where != place and (session, seal) not in noted:
            sentence = f"expected the seal of {session} in {place}, as this says, got none"
        else:
            continue
        yield Difference(place=where, sentence=sentence, participant=about)
