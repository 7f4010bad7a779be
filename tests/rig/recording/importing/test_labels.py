"""Tables of labels in the dialects of spreadsheets and editors."""

from __future__ import annotations

import unicodedata
from pathlib import Path

import pytest

from tactileq.modeling import InputError
from tactileq.rig.recording.importing.labels import Label, labels_from_table
from tests.refusals import refused

PATHS = [Path("a.wav"), Path("\u30ac.wav")]
EXPECTED = [Label("oak, planed", 80.5, 0.6), Label("\u30ac", 1000.0, 1.0, repeat=2)]
NAMES = ("file", "speed_mm_s", "force_n", "texture", "repeat")
ROWS = (
    NAMES,
    ("a.wav", "80.5", "0.6", "oak, planed", ""),
    ("\u30ac.wav", "1000", "1", "\u30ac", "2"),
)
TABS = "".join("\t".join(row) + "\n" for row in ROWS)
QUOTED = "".join(",".join(f'"{cell}"' for cell in row) + "\n" for row in ROWS)


@pytest.mark.parametrize(
    "data",
    [
        TABS.encode(),
        QUOTED.encode("utf-8-sig"),
        QUOTED.replace('","', '"\t"').encode("utf-16"),
        TABS.replace("\t", ";").replace(".5", ",5").replace("0.6", "0,6").encode(),
        unicodedata.normalize("NFD", TABS).encode(),
        TABS.replace("\n", "\t\r\n").encode(),
        ("# of mine\n\n" + TABS).encode(),
    ],
    ids=["tabs", "quotes", "utf-16", "decimal commas", "decomposed", "blank ends", "comments"],
)
def test_labels_in_every_dialect(tmp_path: Path, data: bytes) -> None:
    (tmp_path / "labels.tsv").write_bytes(data)
    for paths in (PATHS, [Path(unicodedata.normalize("NFD", str(path))) for path in PATHS]):
        found, unused = labels_from_table(tmp_path / "labels.tsv", paths, texture="none")
        assert (found, unused) == (EXPECTED, ())


def test_labels_that_cannot_be_meant_are_refused(tmp_path: Path) -> None:
    table = tmp_path / "labels.tsv"
    for text, expected, got in (
        (TABS.replace("repeat", "repeet"), "repeat", "'repeet'"),
        (TABS.replace("80.5", "1,020").replace("0.6", "1"), "one reading", ["1020", "1.02"]),
        (TABS.replace("oak", '"oak'), "line 2", "not closed"),
    ):
        table.write_text(text, encoding="utf-8")
        with refused(InputError, expected=expected, got=got):
            labels_from_table(table, PATHS, texture="none")
    table.write_bytes(TABS.replace("oak", "\u00e9b\u00e8ne").encode("utf-8").replace(b"\xc3", b""))
    with refused(InputError, expected=table, got="UTF-8"):
        labels_from_table(table, PATHS, texture="none")
