"""What tactileq import tells, and what it leaves behind."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
from scipy.io import wavfile

from tactileq.modeling import RecordingSet
from tests.refusals import check_refusal

NOISE = np.random.default_rng(1).uniform(-0.5, 0.5, (4000, 2)).astype(np.float32)


def test_a_set_keeps_wav_files_and_tells_of_its_imports_side_by_side(main, tmp_path: Path) -> None:
    wavfile.write(tmp_path / "a.wav", 10_000, NOISE)
    labels = ["--force", 1, "--texture", "oak", "--out", "set"]
    refused = main("import", "wav", "a.wav", "--speed", 1, *labels)
    assert refused.returncode == 1
    assert "with --channel" in refused.stderr
    assert not (tmp_path / "set").exists()
    sizes = []
    for speed in range(10, 60, 10):
        options = ["--speed", speed, "--channel", 2, "--g-per-fullscale", 4]
        added = main("import", "wav", "a.wav", *options, *labels)
        assert added.returncode == 0, added.stderr
        sizes.append((tmp_path / "set/provenance.json").stat().st_size)
    assert added.stdout.splitlines()[-1] == "1 recording added at 10000 Hz, 5 in set"
    records = RecordingSet.load(tmp_path / "set").recordings
    assert len(records) == 5
    assert all(np.array_equal(record.samples, 4 * NOISE[:, 1].astype(float)) for record in records)
    assert (tmp_path / "set/0005.wav").read_bytes() == (tmp_path / "a.wav").read_bytes()
    # Every import adds as much to the provenance as the one before it.
    assert np.unique(np.diff(sizes[1:])).size == 1
    told = json.loads((tmp_path / "set/provenance.json").read_text())
    assert [one["settings"].get("added to") for one in told["settings"]["added to"]] == [None] * 4
    assert all(one["command"] == "tactileq import wav" for one in told["settings"]["added to"])


def test_provenance_within_provenance_is_kept_side_by_side(main, tmp_path: Path) -> None:
    """As sets of before have it."""
    wavfile.write(tmp_path / "a.wav", 10_000, NOISE[:, 0])
    options = ["--force", 1, "--texture", "oak", "--out", "set"]
    assert main("import", "wav", "a.wav", "--speed", 10, *options).returncode == 0
    first = {"command": "tactileq record", "settings": {"texture": "oak"}}
    second = {"command": "tactileq import csv", "settings": {"unit": "g", "added to": first}}
    third = {"command": "tactileq import wav", "settings": {"added to": second}}
    (tmp_path / "set/provenance.json").write_text(json.dumps(third))
    assert main("import", "wav", "a.wav", "--speed", 20, *options).returncode == 0
    told = json.loads((tmp_path / "set/provenance.json").read_text())["settings"]["added to"]
    assert [one["command"].split(maxsplit=1)[1] for one in told] == [
        *("record", "import csv", "import wav")
    ]


def test_what_is_left_out_and_decided_stands_in_the_provenance(main, tmp_path: Path) -> None:
    time_s = np.arange(2000) / 2000 + np.where(np.arange(2000) < 800, 0.0, 10.0)
    rows = [f"{t!r},{x!r}" for t, x in zip(time_s.tolist(), NOISE[:2000, 0].tolist(), strict=True)]
    (tmp_path / "a.csv").write_text("\n".join(["time_s,z (raw)", *rows]) + "\n")
    (tmp_path / "b.csv").write_text("nothing of use\n")
    options = ["--force", 1, "--texture", "oak", "--unit", "g", "--out", "set"]
    for changed in (("--speed", 100), ("--speed", 200, "--rate", 2000)):
        added = main("import", "csv", "a.csv", "b.csv", *changed, *options)
        assert added.returncode == 0, added.stderr
        told = json.loads((tmp_path / "set/provenance.json").read_text())["settings"]["notes"]
        for sentence, facts in zip(told, (["10 s", "row 800"], "'raw'", "b.csv"), strict=True):
            check_refusal(sentence, names=facts)
            assert sentence in added.stderr
    for record in RecordingSet.load(tmp_path / "set").recordings:
        assert record.samples.size == 1200


def test_eighty_files_of_one_fault_give_one_warning(main, tmp_path: Path) -> None:
    time_s = np.arange(400) / 400 + np.random.default_rng(2).normal(0, 2e-4, 400)
    rows = [f"{t!r},{x!r}" for t, x in zip(time_s.tolist(), NOISE[:400, 0].tolist(), strict=True)]
    names = [f"run{n}.csv" for n in range(12)]
    for number, name in enumerate(names):
        jittered = rows if number else [*rows[:-1], rows[-1] + "1"]  # other numbers
        (tmp_path / name).write_text("\n".join(["time_s,x_g", *jittered]))
    labels = "".join(f"{name}\t{50 + 10 * n}\t1\n" for n, name in enumerate(names))
    (tmp_path / "labels.tsv").write_text("file\tspeed_mm_s\tforce_n\n" + labels)
    added = main("import", "csv", *names, "--labels", "labels.tsv", "--out", "oak")
    assert added.returncode == 0, added.stderr
    uneven, unended = sorted(added.stderr.splitlines(), key=lambda line: "no line end" in line)
    for line in (uneven, unended):
        check_refusal(line, names=["run0.csv", 11, "run1.csv", "run5.csv"])
        assert "run6.csv" not in line


def test_columns_of_other_words_and_volts(main, tmp_path: Path) -> None:
    rows = [f"{n};{n / 400:.4f};{x:.5f}".replace(".", ",") for n, x in enumerate(NOISE[:800, 0])]
    (tmp_path / "log.csv").write_text("\n".join(["Nr;Zeit;Beschl_Z (V)", *rows]) + "\n")
    words = ["--speed", 100, "--force", 1, "--out", "oak", "--axis", "z", "--mv-per-g", 100]
    added = main("import", "csv", "log.csv", *words, "--map", "time=Zeit,z=Beschl_Z")
    assert added.returncode == 0, added.stderr
    (record,) = RecordingSet.load(tmp_path / "oak")
    assert (record.unit, record.rate_hz) == ("g", 400.0)
    np.testing.assert_allclose(record.samples, 10 * NOISE[:800, 0], atol=1e-4)
    refused = main("import", "csv", "log.csv", *words, "--time-column", "Zeit", "--map", "time=Nr")
    assert refused.returncode == 1
    check_refusal(refused.stderr, expected="column", got=["--time-column", "--map"])


def test_what_may_be_wrong_with_files_is_told_once_they_are_read(main, tmp_path: Path) -> None:
    wavfile.write(tmp_path / "a.wav", 10_000, 8 * NOISE[:, 0])
    (tmp_path / "labels.tsv").write_text(
        "file\tspeed_mm_s\tforce_n\na.wav\t50\t1\n"
        + "".join(f"{n}.wav\t{n}\t1\n" for n in range(7))
    )
    added = main("import", "wav", "a.wav", "--labels", "labels.tsv", "--out", "set")
    assert added.returncode == 0
    assert "warning: a.wav: holds samples up to 3.999, beyond the full scale of 1" in added.stderr
    note = "note: rows of labels.tsv for files that were not given: 0.wav, 1.wav, 2.wav, 3.wav, 4."
    assert f"{note}wav and 2 more" in added.stdout
    (tmp_path / "labels.tsv").write_text("file\tspeed\tforce_n\na.wav\t50\t1\n")
    refused = main("import", "wav", "a.wav", "--labels", "labels.tsv", "--out", "set")
    assert "add speed_mm_s" in refused.stderr


def test_a_rate_that_contradicts_the_time_column_is_refused(main, tmp_path: Path) -> None:
    rows = [f"{n / 3200!r},{value!r}" for n, value in enumerate(NOISE[:, 0].tolist())]
    (tmp_path / "a.csv").write_text("\n".join(["time_s,x_g", *rows]))
    labels = ["--speed", 100, "--force", 1, "--out", "set"]
    refused = main("import", "csv", "a.csv", *labels, "--rate", 5000)
    assert refused.returncode == 1
    assert "got 5000 Hz and by its column 'time_s' 3200 Hz" in refused.stderr
    added = main("import", "csv", "a.csv", *labels, "--rate", 3200)
    assert added.returncode == 0
    assert "warning: a.csv: has no line end after its last row" in added.stderr


def test_what_cannot_be_meant_is_refused_and_taken_where_it_is(main, tmp_path: Path) -> None:
    wavfile.write(tmp_path / "a.wav", 10_000, NOISE[:, 0])
    wavfile.write(tmp_path / "b.wav", 10_000, NOISE[:, 1])
    (tmp_path / "labels.tsv").write_text(
        "file\tspeed_mm_s\tforce_n\na.wav\t1.5\t160\nb.wav\t3.5\t100\n"
    )
    words = ["import", "wav", "a.wav", "b.wav", "--labels", "labels.tsv", "--out", "set"]
    refused = main(*words, "--g-per-fullscale", 4)
    assert refused.returncode == 1
    assert "got 1.5 mm/s and 160 N, or 160 mm/s and 1.5 N with the columns" in refused.stderr
    assert "--yes if it is intended" in refused.stderr
    assert refused.stderr.endswith(" (1 more like it).\n")
    assert not (tmp_path / "set").exists()
    taken = main(*words, "--g-per-fullscale", 4, "--yes")
    assert taken.returncode == 0
    check_refusal(taken.stderr, names=["a.wav", "b.wav"], got=["1.5 mm/s", "160 N"])
    told = json.loads((tmp_path / "set/provenance.json").read_text())["settings"]["doubts"]
    assert [doubt.split(":")[0] for doubt in told] == ["a.wav", "b.wav"]
    assert len(RecordingSet.load(tmp_path / "set").recordings) == 2
