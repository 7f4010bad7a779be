"""Tables of any experiment: what people bring is read, what cannot be meant is refused."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tactileq.analysis.answers.imported import ImportedAnswers, load_imported
from tactileq.analysis.answers.table_map import parse_map
from tactileq.modeling import InputError
from tactileq.modeling.errors import shown
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


def mean_by(found: ImportedAnswers, *columns: str) -> dict[object, float]:
    """Mean of the measure, each trial counting once, by a column or under "all"."""
    rows = found.answers.loc[found.answers.index.repeat(found.answers["count"])]
    groups = rows.groupby(list(columns)) if columns else [(("all",), rows)]
    return {key[0]: pytest.approx(own[found.measure].mean()) for key, own in groups}


def test_true_and_false_and_codes(tmp_path: Path) -> None:
    for right, wrong in (("true", "false"), ("TRUE", "FALSE"), ("True", '"False"')):
        found = load(tmp_path, f"a,b\nx,{right}\nx,{wrong}\ny,{right}\n", "correct=b,factor=a")
        assert mean_by(found, "a") == {"x": 0.5, "y": 1.0}
    text = "a,b\nx,1\nx,2\ny,1\ny,3\ny,\n"
    with refused(InputError, expected=["0 or 1", "line 3"], got=["'2'", "--right"]):
        load(tmp_path, text, "correct=b,factor=a")
    (tmp_path / "P01.csv").write_text(text)
    found = load_imported([tmp_path / "P01.csv"], parse_map("correct=b,factor=a", right="1"))
    assert mean_by(found, "a") == {"x": 0.5, "y": 0.5}
    assert found.missed == 1
    assert any("1 (2), 2 (1), 3 (1)" in note for note in found.notes)


def test_only_lines_that_fit_are_trials(tmp_path: Path) -> None:
    (tmp_path / "P01.csv").write_text(
        "phase,block,hit\nmain,1,1\nmain,2,0\ntraining,1,x\nmain,3,0\n"
    )
    where = [("phase", "MAIN"), ("block", "1"), ("block", "2.0")]
    found = load_imported([tmp_path / "P01.csv"], parse_map("correct=hit", where=where))
    assert found.answers["correct"].tolist() == [1.0, 0.0]
    assert any("2 lines" in note and "--where" in note for note in found.notes)
    with refused(InputError, expected=["'phase'", "pilot"], got="training"):
        load_imported([tmp_path / "P01.csv"], parse_map("correct=hit", where=[("phase", "pilot")]))


def test_lines_that_are_no_trials_are_counted(tmp_path: Path) -> None:
    text = "model,hit,key\nfull,1,l\n,,space\nmodel,hit,key\nsimple,0,r\nfull,,\nEND OF FILE,,\n"
    found = load(tmp_path, text, "correct=hit,factor=model")
    assert mean_by(found, "model") == {"full": 1.0, "simple": 0.0}
    assert found.missed == 1
    told = " ".join(found.notes)
    assert all(f"line {number}" in told for number in (3, 4, 7))
    with refused(InputError, expected=["model", "line 2"], got=["none", "--where"]):
        load(tmp_path, "model,hit\n,1\n", "correct=hit,factor=model")
    questions = (
        'ID,Q1\n"Your, ID",How rough?\n"{""ImportId"":""ID""}","{""ImportId"":""QID1""}"\na,3\n'
    )
    found = load(tmp_path, questions, "participant=ID,value=Q1")
    assert found.answers["value"].tolist() == [3.0]


def test_words_that_are_spelt_like_missing_values_are_names(tmp_path: Path) -> None:
    text = "p,a\ncork,cork\nfelt,none\nfelt,None\nnone,none\nNaN,\n"
    found = load(tmp_path, text, "presented=p,answered=a")
    assert mean_by(found) == {"all": 0.5}
    assert found.presented == ("cork", "felt", "none")
    assert mean_by(load(tmp_path, "f,c\nNone,1\nForce,0\n", "correct=c,factor=f"), "f") == {
        "Force": 0.0,
        "None": 1.0,
    }
    for word in ("NA", "null", "."):
        with refused(InputError, expected="line 3", got=[f"'{word}'", "or"]):
            load(tmp_path, f"p,a\ncork,felt\nfelt,{word}\n", "presented=p,answered=a")


def test_an_answer_that_was_never_presented_is_no_alternative(tmp_path: Path) -> None:
    text = "p,a\n" + "".join(f"{c},{c}\n{c},don't know\n" for c in "abcd")
    found = load(tmp_path, text, "presented=p,answered=a")
    assert found.presented == tuple("abcd")
    assert found.classes == (*"abcd", "don't know")
    assert any("4 times" in note for note in found.notes)


@pytest.mark.parametrize("sums", ["All", "Total", "row total"])
def test_sums_are_no_class(tmp_path: Path, sums: str) -> None:
    rows = {"a": (7, 1, 2), "b": (3, 5, 2), "c": (2, 4, 4)}
    whole = [*(f"{name},{','.join(map(str, row))},{sum(row)}" for name, row in rows.items())]
    whole = [f"x,a,b,c,{sums}", *whole, f"{sums},12,10,8,30"]
    for lines in (whole, whole[:-1], [line.rpartition(",")[0] for line in whole]):
        found = load(tmp_path, "\n".join(lines) + "\n", "")
        assert found.presented == ("a", "b", "c")
        assert mean_by(found) == {"all": 16 / 30}
        assert any(sums in note for note in found.notes)
    with refused(InputError, expected="class", got=f"'{sums}'"):
        load(tmp_path, "\n".join(whole).replace(",30", ",31"), "")
    found = load(tmp_path, "\n".join(whole).replace(sums, "d"), "")
    assert mean_by(found) == {"all": 16 / 30}  # a row and a column of sums are no chance
    with refused(InputError, expected="class", got=["'d'", "not called so"]):
        load(tmp_path, "\n".join(whole[:-1]).replace(sums, "d"), "")


def test_cells_stay_under_their_names(tmp_path: Path) -> None:
    found = load(tmp_path, ",a,,b,c\na,7,,1,2\nb,3,,5,2\nc,2,,4,4\n", "")
    counts = found.answers.set_index(["presented", "answered"])["count"]
    assert counts["a"].to_dict() == {"a": 7, "b": 1, "c": 2}
    with refused(InputError, expected="above each column", got=["'9'", "line 2"]):
        load(tmp_path, ",a,,b,c\na,7,9,1,2\nb,3,,5,2\nc,2,,4,4\n", "")


@pytest.mark.parametrize(
    ("text", "mapping", "mean"),
    [
        ("rt;m\n980.5;a\n1,020;a\n", "value=rt", 1000.25),
        ("rt;m\n980,5;a\n1.020;a\n", "value=rt", 1000.25),
        ('rt,m\n"1\'000",a\n900,a\n', "value=rt", 950.0),
        ("rt\tm\n1 000\ta\n900\ta\n", "value=rt", 950.0),
        ("rt\tm\n-1.5e3\ta\n+.5\ta\n", "value=rt", -749.75),
        ("rt\tm\n\u22121,5\ta\n2,5\ta\n", "value=rt", 0.5),
        ("rt\tm\n1,020\ta\n980\ta\n", "value=rt,decimal=point", 1000.0),
        ("rt\tm\n1,020\ta\n980\ta\n", "value=rt,decimal=comma", 490.51),
    ],
)
def test_the_decimal_sign_is_decided_for_the_column(
    tmp_path: Path, text: str, mapping: str, mean: float
) -> None:
    assert mean_by(load(tmp_path, text, mapping)) == {"all": mean}


@pytest.mark.parametrize(
    ("text", "mapping", "readings"),
    [
        ("rt\tm\n900\ta\n1,020\ta\n", "value=rt", ["'1,020'", "1020", "1.02"]),
        ("f;c\n1;1\n10;1\n1.000;0\n", "correct=c,factor=f", ["'1.000'", "1000", "is 1 "]),
        ('f,c\n1,1\n10,1\n"1,000",0\n', "correct=c,factor=f", ["'1,000'", "1000", "is 1 "]),
    ],
)
def test_what_may_be_a_thousand_is_refused_with_both_readings(
    tmp_path: Path, text: str, mapping: str, readings: list[str]
) -> None:
    with refused(InputError, expected="one reading", got=[*readings, "decimal=point"]):
        load(tmp_path, text, mapping)
    levels = load(tmp_path, text, f"{mapping},decimal={'comma' if '.' in text else 'point'}")
    assert len(levels.answers) == text.count("\n") - 1


@pytest.mark.parametrize("cell", ["1_1", "inf", "0x10", "\uff11\uff12", "1,0,0", "1 2 3", "--1"])
def test_what_only_a_program_reads_is_no_number(tmp_path: Path, cell: str) -> None:
    with refused(InputError, expected=["number", "line 3"], got=repr(cell)):
        load(tmp_path, f"v;m\n1;a\n{cell};a\n", "value=v")


def test_a_quote_that_nobody_closed_swallows_no_lines(tmp_path: Path) -> None:
    rows = "".join(f'101,{c},"too rough,{h}\n102,{c},ok,{h}\n' for c in "ab" for h in (0, 1))
    with refused(InputError, expected=["quotes", "line 2"], got="not closed"):
        load(tmp_path, "id,c,note,hit\n" + rows, "participant=id,correct=hit,factor=c")
    closed = 'id,c,note,hit\n1,a,"too rough,0\n1,b,fine,1\n1,b,too smooth",1\n'
    with refused(InputError, expected=["one reading", "line 2"], got="either"):
        load(tmp_path, closed, "participant=id,correct=hit,factor=c")
    whole = 'id,c,note,hit\n1,a,"too rough,\n""really""",0\n1,b,5" wide,1\n'
    found = load(tmp_path, whole, "participant=id,correct=hit,factor=c")
    assert found.answers["correct"].tolist() == [0.0, 1.0]


def test_names_of_rows(tmp_path: Path) -> None:
    lines = ['"id"\t"m"\t"rt"', '"1"\t101\t"a"\t1.9', '"2"\t101\t"b"\t0.7', '"3"\t102\t"a"\t1.25']
    found = load(tmp_path, "\n".join(lines), "participant=id,value=rt")
    assert mean_by(found, "participant_id") == {"101": 1.3, "102": 1.25}
    assert any("name of a row" in note for note in found.notes)
    blank = [lines[0] + '\t"note"', *(f'{line}\t""' for line in lines[1:])]
    with refused(InputError, expected="line 2", got=["either", "or"]):
        load(tmp_path, "\n".join(blank), "participant=id,value=rt")
    with refused(InputError, expected=["3 cells", "line 2"], got=4):
        load(
            tmp_path, "id,m,rt\n1,really, rough,2\n2,really, smooth,3\n", "participant=id,value=rt"
        )


def test_the_same_file_under_two_names(tmp_path: Path) -> None:
    files = []
    for name in ("P01", "P02", "copy of P01"):
        rows = "".join(f"{'ab'[i % 2]},{(i + ord(name[-1])) % 3 % 2}\n" for i in range(12))
        files.append(tmp_path / f"{name}.csv")
        files[-1].write_text("m,hit\n" + rows)
    files[-1].write_bytes(files[0].read_bytes().replace(b"\n", b"\r\n"))
    load_imported(files[:2], parse_map("correct=hit,factor=m"))
    with refused(InputError, expected="different", got=[files[0], files[2]]):
        load_imported(files, parse_map("correct=hit,factor=m"))
    for path in (files[0], files[2]):
        path.write_text("m,hit\na,1\nb,1\n")  # as everybody may answer
    assert any("1 pair" in n for n in load_imported(files, parse_map("correct=hit")).notes)


def test_a_table_that_was_joined_with_itself_is_named(tmp_path: Path) -> None:
    rows = "101,a,1\n101,b,0\n102,a,0\n"
    found = load(tmp_path, "id,m,hit\n" + rows * 2, "participant=id,correct=hit,factor=m")
    assert any("2 times" in note and "lines 2 to 7" in note for note in found.notes)


def test_files_are_sessions_of_a_participant(tmp_path: Path) -> None:
    files = []
    for who, day in (("P01", "mon"), ("P02", "mon"), ("P01", "tue"), ("P02", "tue")):
        files.append(tmp_path / f"{who}_{day}.csv")
        files[-1].write_text(f"id,hit\n{who},{int(day == 'tue')}\n{who},1\n")
    with refused(InputError, expected="once", got=["P01", "factor=session"]):
        load_imported(files, parse_map("participant=id,correct=hit"))
    for factor, levels in (("session", ("1", "2")), ("file", ("mon", "tue"))):
        found = load_imported(files, parse_map(f"participant=id,correct=hit,factor={factor}"))
        assert mean_by(found, factor) == dict(zip(levels, (0.5, 1.0), strict=True))


def test_without_a_right_answer_the_share_of_one_is_read(tmp_path: Path) -> None:
    text = "level,a\n1,test\n1,standard\n2,test\n2,test\n"
    (tmp_path / "P01.csv").write_text(text)
    for right, shares in (("standard", (0.5, 0.0)), ("test", (0.5, 1.0)), ("", (0.5, 1.0))):
        mapping = parse_map("answered=a,factor=level", right=right)
        found = load_imported([tmp_path / "P01.csv"], mapping)
        assert found.response == (right or "test")
        assert mean_by(found, "level") == dict(zip("12", shares, strict=True))
    (tmp_path / "P01.csv").write_text(text + "2,neither\n")
    with refused(InputError, expected=["neither", "test", "--right"], got="3 answers"):
        load_imported([tmp_path / "P01.csv"], parse_map("answered=a,factor=level"))


def test_names_are_compared_by_what_they_say(tmp_path: Path) -> None:
    text = "\u53c2\u52a0\u8005,\u30ab\u3099\u30e9\u30b9,x\nA,cafe\u0301,1\nA,caf\u00e9,0\n"
    found = load(
        tmp_path, text, "participant=\u53c2\u52a0\u8005,factor=\u30ac\u30e9\u30b9,correct=x"
    )
    assert mean_by(found, "\u30ac\u30e9\u30b9") == {"caf\u00e9": 0.5}
    found = load(tmp_path, "\uff32\uff34,x\n1,a\n", "value=rt")
    assert found.answers["value"].tolist() == [1.0]


def test_a_map_of_a_laboratory(tmp_path: Path) -> None:
    (tmp_path / "roles.toml").write_text(
        'value = "How similar, from 0 to 100?"\nfactor = "model"\n[where]\nphase = "main"\n'
    )
    whole = 'value="How similar, from 0 to 100?"'
    plain = "value=How similar, from 0 to 100?,factor=model"
    expected = parse_map(["factor=model", whole], where=[("phase", "main")])
    assert parse_map(str(tmp_path / "roles.toml")) == expected
    assert parse_map(plain, where=[("phase", "main")]) == expected
    assert parse_map('value="the ""right"" one"').value == 'the "right" one'
    for text, got in (("valeu = 'a'", "valeu"), ("value = ['a', 'b']", "'b'"), ("where = 3", "3")):
        (tmp_path / "roles.toml").write_text(text)
        with refused(InputError, expected=tmp_path / "roles.toml", got=got):
            parse_map(str(tmp_path / "roles.toml"))


def test_columns_by_number(tmp_path: Path) -> None:
    for text in ("full 1 0.5\nsimple 2 0.75\nfull 2 0.25\n", "m c rt\nfull 1 0.5\nsimple 2 0.75\n"):
        found = load(tmp_path, text, "factor=#1,value=#3")
        assert found.answers["value"].tolist()[:2] == [0.5, 0.75]
    with refused(InputError, expected="#7", got="3 columns"):
        load(tmp_path, "full 1 0.5\nfull 2 0.25\n", "value=#7")


@pytest.mark.parametrize(
    ("text", "mapping", "got"),
    [
        ("f,c\n1.1,1\n1.10,0\n", "correct=c,factor=f", ["'1.1'", "'1.10'"]),
        ("id,c\n01,1\n1,0\n", "participant=id,correct=c", ["'01'", "'1'"]),
        ("id,s\nP1,0.5\nTotal,0.5\n", "participant=id,share=s", ["'Total'", "line 3"]),
        ("m,s\na,0.5\nMean,0.5\n", "share=s,factor=m", ["'Mean'", "line 3"]),
        ("p,a,n\nx,x,3\ny,x,2\nx,All,3\n", "presented=p,answered=a,count=n", ["'All'", "line 4"]),
        ("p,a\nx,x\ny,null\n", "presented=p,answered=a", ["'null'", "or"]),
        ("v\n1e400\n", "value=v", "'1e400'"),
        ("a,b\nx,1\nb,a\n1,y\n", "answered=a,value=b", "another order"),
        ("m,n\nx,1e12\n", "correct=m,count=n", "'x'"),
    ],
)
def test_what_may_be_two_things_is_refused(
    tmp_path: Path, text: str, mapping: str, got: object
) -> None:
    with pytest.raises(InputError) as told:
        load(tmp_path, text, mapping)
    for fact in [got] if isinstance(got, str) else list(got):  # type: ignore[call-overload]
        assert fact in str(told.value)


def test_names_that_look_the_same_are_one(tmp_path: Path) -> None:
    text = "f,c\nvery rough,1\nvery\u00a0rough,0\nvery  rough\u200b,0\n\uff21\uff12,1\nA2,1\n"
    found = load(tmp_path, text, "correct=c,factor=f")
    assert mean_by(found, "f") == {"very rough": 1 / 3, "\uff21\uff12": 1.0}
    assert any("\\xa0" in note for note in found.notes)
    found = load(tmp_path, "f,c\n10\u00b2,1\n102,0\n", "correct=c,factor=f")
    assert mean_by(found, "f") == {"10\u00b2": 1.0, "102": 0.0}


@pytest.mark.parametrize(
    ("files", "right", "got"),
    [
        (("hit", "miss"), "hits", "hit, miss"),
        (("x", ""), "x", "1 blank cell"),
        (("1", "0", "hit"), "1", "hit"),
    ],
)
def test_a_code_that_cannot_be_that_of_right_answers(
    tmp_path: Path, files: tuple[str, ...], right: str, got: str
) -> None:
    (tmp_path / "P01.csv").write_text("id,c\n1,{}\n1,{}\n".format(*files[:2]))
    paths = [tmp_path / "P01.csv"]
    if files[2:]:
        paths.append(tmp_path / "P02.csv")
        paths[1].write_text(f"id,c\n2,{files[2]}\n2,miss\n")
    with refused(InputError, expected=shown(right), got=got):
        load_imported(paths, parse_map("participant=id,correct=c", right=right))


@pytest.mark.parametrize(
    ("column", "cells"), [("hits", (7, 5, 4)), ("% correct", (70, 50, 40)), ("n", (20, 20, 20))]
)
def test_a_column_of_hits_is_no_answer(
    tmp_path: Path, column: str, cells: tuple[int, int, int]
) -> None:
    rows = ("a,7,1,2", "b,3,5,2", "c,2,4,4")
    lines = [f"{row},{cell}" for row, cell in zip(rows, cells, strict=True)]
    with refused(InputError, expected="answers", got=f"'{column}'"):
        load(tmp_path, "\n".join((f",a,b,c,{column}", *lines)), "")
    with refused(InputError, expected="presented", got="'answered'"):
        load(tmp_path, "\n".join(("answered,a,b,c", *rows)), "")
    titled = load(tmp_path, "\n".join(("Confusion matrix", "", ",a,b,c", *rows)), "")
    assert titled.answers["count"].sum() == 30
    counted = load(tmp_path, "\n".join((",a,b", 'a,"1,200",800', "b,3,5")), "")
    assert counted.answers["count"].tolist() == [1200, 800, 3, 5]


def test_a_header_that_is_there_again_is_no_trial(tmp_path: Path) -> None:
    for again in ("Id,A,Rt", "\ufeffid,a,rt", "id,a,"):
        found = load(tmp_path, f"id,a,rt\nP1,x,3\n{again}\nP2,y,4\n", "participant=id,answered=a")
        assert list(found.answers["participant_id"]) == ["P1", "P2"]
        assert any("line 3" in note for note in found.notes)


def test_copies_are_found_by_what_was_answered(tmp_path: Path) -> None:
    rows = [f"{'ab'[i % 2]},{(i * i + 1) % 3 % 2},{i}.5" for i in range(12)]
    (tmp_path / "P01.csv").write_text("\n".join(("m,hit,rt", *rows)))
    changed = ["m;hit;rt;note", *(f"{row.replace(',', ';').replace('.5', ',50')};" for row in rows)]
    (tmp_path / "P02.csv").write_text("\n".join(changed))
    files = [tmp_path / "P01.csv", tmp_path / "P02.csv"]
    with refused(InputError, expected="different", got=files):
        load_imported(files, parse_map("correct=hit,factor=m"))


def test_a_file_is_given_once(tmp_path: Path) -> None:
    path = tmp_path / "P01.csv"
    path.write_text("m,hit\na,1\nb,0\n")
    with refused(InputError, expected="once", got=path):
        load_imported([path, tmp_path / "." / "P01.csv"], parse_map("correct=hit"))


def test_a_session_without_answers_is_counted(tmp_path: Path) -> None:
    files = []
    for who, hits in (
        (
            "P1",
            ",",
        ),
        ("P1", "1"),
        ("P2", "0"),
        ("P2", "1"),
    ):
        files.append(tmp_path / f"{len(files)}.csv")
        files[-1].write_text(f"id,hit\n{who},{hits.strip(',')}\n{who},{hits.strip(',')}\n")
    found = load_imported(files, parse_map("participant=id,correct=hit,factor=session"))
    levels = found.answers.groupby("participant_id")["session"].unique().map(list).to_dict()
    assert levels == {"P1": ["2"], "P2": ["1", "2"]}
    assert found.missed == 2


def test_a_matrix_needs_lines(tmp_path: Path) -> None:
    with refused(InputError, expected="class", got="none"):
        load(tmp_path, "x,a,b\nx,a,b\n", "")
    with refused(InputError, expected="count", got="'NA'"):
        load(tmp_path, "x,a,b\na,1,NA\nb,1,1\n", "")
    found = load(tmp_path, "x,a,b,\u2211\na,1,,1\nb,2,1,3\n\u2211,3,1,4\n", "")
    assert found.presented == ("a", "b")


def test_rows_that_where_leaves_out_may_hold_anything(tmp_path: Path) -> None:
    text = "phase,f,hit\nmain,10,1\nmain,100,0\ntraining,1.000,x\n"
    (tmp_path / "P01.csv").write_text(text.replace(",", "\t"))
    mapping = parse_map("correct=hit,factor=f", where=[("phase", "main")])
    found = load_imported([tmp_path / "P01.csv"], mapping)
    assert mean_by(found, "f") == {"10": 1.0, "100": 0.0}


def test_what_ordinary_programs_write_is_read(tmp_path: Path) -> None:
    again = "id,p,a\nP1,x,x\nP2,y,x\nid,p,a\nP3,z,z\n"
    found = load(tmp_path, again, "participant=#1,presented=#2,answered=#3")
    assert list(found.answers["participant_id"]) == ["P1", "P2", "P3"]
    comment = '"nice\nsoft, warm, a bit, odd"'
    text = f"id,m,hit,note\nP1,a,1,{comment}\n" + "P1,b,0,no\n" * 5
    found = load(tmp_path, text, "correct=hit,factor=m")
    assert mean_by(found, "m") == {"a": 1.0, "b": 0.0}
    (tmp_path / "P01.csv").write_text("fixation 400\nmain full 1\nmain simple 2\n")
    mapping = parse_map("correct=#3,factor=#2", where=[("#1", "main")], right="1")
    found = load_imported([tmp_path / "P01.csv"], mapping)
    assert mean_by(found, "#2") == {"full": 1.0, "simple": 0.0}
    found = load(tmp_path, ",a,b,don't know\na,2,1,12\nb,2,1,9\n", "")
    assert found.classes == ("a", "b", "don't know")
    german = "wer;was;wert\nP1;a;3,5\nP1;b;4,5\n"
    found = load(tmp_path, german, "participant=#1,factor=#2,value=#3")
    assert mean_by(found, "#2") == {"a": 3.5, "b": 4.5}
    found = load(tmp_path, "m,v\nTotal contact,1\nMean,2\nMean,3\n", "value=v,factor=m")
    assert mean_by(found, "m") == {"Total contact": 1.0, "Mean": 2.5}


def test_a_refusal_names_the_line_that_is_damaged(tmp_path: Path) -> None:
    rows = "".join(f'"{n}" "P{n}" {n / 8} "ok"\n' for n in range(1, 8))
    text = f'"id" "v" "note"\n{rows}"8" "P8" 1 "he said \\"hm\\""\n'
    with refused(InputError, expected=["quotes", "line 9"], got="not closed"):
        load(tmp_path, text, "participant=id,value=v")
    with refused(InputError, expected=["number", "line 2"], got="'0.5'"):
        load(tmp_path, "m;v\na;0.5\nb;1.5\n", "value=v,decimal=comma")
    with refused(InputError, expected="one way", got="0, 1, true"):
        (tmp_path / "P01.csv").write_text("hit\n1\n0\ntrue\n")
        load_imported([tmp_path / "P01.csv"], parse_map("correct=hit", right="1"))
