"""Tables of any experiment: what people bring is read, what cannot be meant is refused."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tactileq.analysis.answers.imported import ImportedAnswers, load_imported, parse_map
from tactileq.modeling import InputError
from tests.refusals import refused


def load(folder: Path, text: str | bytes, mapping: str, name: str = "P01.csv") -> ImportedAnswers:
    data = text.encode() if isinstance(text, str) else text
    (folder / name).write_bytes(data)
    return load_imported([folder / name], parse_map(mapping))


def test_a_table_of_a_spreadsheet(tmp_path: Path) -> None:
    lines = ("\ufeffVP ; Size;Rating", "1;klein;3,5", "P02; Klein ;", "1.0;GROSS;NaN")
    text = "\r\n".join((*lines, "1;gross;4", ";;", "", ""))
    found = load(tmp_path, text, "participant=vp,value=rating,factor=Size")
    assert list(found.answers["participant_id"]) == ["1", "1"]
    assert list(found.answers["Size"]) == ["klein", "GROSS"]
    assert list(found.answers["value"]) == [3.5, 4.0]
    assert (found.missed, found.measure) == (2, "value")


@pytest.mark.parametrize("header", ["x" * 5000, ",".join(f"column {n}" for n in range(500))])
def test_a_missing_column_is_told_in_one_short_sentence(tmp_path: Path, header: str) -> None:
    with pytest.raises(InputError) as told:
        load(tmp_path, f"{header}\n1\n", "value=rating")
    assert "'rating'" in str(told.value)
    assert header[:100] in str(told.value).replace(", ", ",")
    assert len(str(told.value)) < 400


def test_the_file_names_the_participant(tmp_path: Path) -> None:
    found = load(tmp_path, "hit\tx\n1\ta\n0\tb\n", "correct=hit")
    assert list(found.answers["participant_id"]) == ["P01", "P01"]
    assert list(found.answers["correct"]) == [1.0, 0.0]


def test_a_class_never_answered_stays(tmp_path: Path) -> None:
    found = load(
        tmp_path,
        "p,a,n\nfelt,felt,3\nmdf,Felt,2\ncork,mdf,0\nCork,mdf,1\n",
        "presented=p,answered=a,count=n",
    )
    assert found.classes == ("cork", "felt", "mdf")
    assert list(found.answers["count"]) == [3, 2, 1]
    assert list(found.answers["correct"]) == [1.0, 0.0, 0.0]


def test_a_matrix_has_its_condition_in_its_name(tmp_path: Path) -> None:
    text = "x,a,b,c\na,2,1,\nb,0,3,0\nc,1,0,0\n"
    found = load(tmp_path, text, "factor=model,factor=day", name="VP_3_full_1.csv")
    assert found.answers.iloc[0][["participant_id", "model", "day"]].tolist() == [
        "VP_3",
        "full",
        "1",
    ]
    assert found.answers["count"].sum() == 7
    assert (found.answers["count"] * found.answers["correct"]).sum() == 5


@pytest.mark.parametrize(
    ("text", "mapping", "expected", "got"),
    [
        ("A,B\n1,1\n", "correct=C", ["C", "line 1"], ["no", "A, B"]),
        ("A,A\n1,1\n", "correct=A", "A", "2 columns"),
        ("A\n1\n0.5\n", "correct=A", [1, 0, "line 3"], "'0.5'"),
        ("A\n1.1\n", "share=A", [0, 1, "line 2"], 1.1),
        ("A\n-0.1\n", "share=A", [0, 1, "line 2"], -0.1),
        ("A\nmany\n", "value=A", ["number", "line 2"], "'many'"),
        ("A\ninf\n", "value=A", ["number", "line 2"], "'inf'"),
        ("A,N\n1,-1\n", "correct=A,count=N", ["count", 0, "line 2"], -1),
        ("A,N\n1,1.5\n", "correct=A,count=N", ["count", 0, "line 2"], 1.5),
        ("A,F\n1,\n", "correct=A,factor=F", ["F", "line 2"], "none"),
        ("A,F\n0.5,x\n0.5,X\n", "share=A,factor=F", "participant", ["P01", "line 3"]),
        ("A,B\n1,1\n1,1\n", "presented=A,answered=B", ["2 to 16", "P01.csv"], 1),
        (
            "A,B\n" + "".join(f"{i},{i}\n" for i in range(17)),
            "presented=A,answered=B",
            ["2 to 16", "P01.csv"],
            17,
        ),
        ("A,B\n1,1,1\n", "correct=A", ["2 cells", "line 2"], 3),
        ("A\nNaN\n", "correct=A", "answers", "none"),
        ("A\n", "correct=A", "P01.csv", "1 line"),
        (b"A,F\n1,\xff\n", "correct=A,factor=F", ["UTF-8", "line 2"], "code pages"),
        ("x,a,b,c\na,1,1,1\nb,1,1,1\nd,1,1,1\n", "", "classes", ["a, b, c", "a, b, d"]),
        ("x,a\na,1\n", "", ["2 to 16", "P01.csv"], 1),
        ("x,a,b,c\na,1,1,1\nb,1,1,1\nc,1,1,1\n", "factor=model", "PARTICIPANT_model", "P01"),
    ],
)
def test_what_cannot_be_meant_is_refused(
    tmp_path: Path, text: str | bytes, mapping: str, expected: object, got: object
) -> None:
    with refused(InputError, expected=expected, got=got) as caught:
        load(tmp_path, text, mapping)
    assert "\n" not in str(caught.value)


def test_a_participant_in_two_files_and_other_classes(tmp_path: Path) -> None:
    for name, classes in (("P01", "abc"), ("p01", "abc"), ("P02", "abd")):
        lines = [f"{c},1,1,1" for c in classes]
        (tmp_path / f"{name}.csv").write_text("\n".join([",".join("x" + classes), *lines]))
    one, again, other = (tmp_path / f"{name}.csv" for name in ("P01", "p01", "P02"))
    with refused(InputError, expected="participant", got=["P01", tmp_path / "p01.csv", "line 2"]):
        load_imported([one, again], parse_map(""))
    with refused(InputError, expected=["a, b, c", tmp_path / "P02.csv"], got="a, b, d"):
        load_imported([one, other], parse_map(""))


@pytest.mark.parametrize(
    ("text", "expected", "got"),
    [
        ("right=A", ["factor", "correct", "="], "'right=A'"),
        ("correct", ["factor", "correct", "="], "'correct'"),
        ("correct=", ["factor", "correct", "="], "'correct='"),
        ("correct=A,correct=B", "once", "'correct=B'"),
        ("factor=A,factor=A", "once", "'factor=A'"),
        ("presented=A", ["presented", "answered"], "one"),
        ("correct=A,share=B", "one", ["correct", "share"]),
        ("participant=A", ["correct", "share", "value", "presented"], "none"),
        ("correct=A,factor=mean", ["factors", "mean"], "mean"),
    ],
)
def test_a_map_that_cannot_be_meant_is_refused(text: str, expected: object, got: object) -> None:
    with refused(InputError, expected=expected, got=got):
        parse_map(text)


@settings(
    max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None
)
@given(text=st.text(alphabet='A,;\t\n"01.x -', max_size=40))
def test_any_text_is_read_or_refused(tmp_path: Path, text: str) -> None:
    try:
        found = load(tmp_path, "A,B\n" + text, "correct=A")
    except InputError:
        return
    assert found.answers["correct"].isin([0.0, 1.0]).all()
    assert len(found.answers) > 0
