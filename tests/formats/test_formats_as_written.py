"""Alignments and landmarks as programs and editors of other countries and years write them."""

import struct
from pathlib import Path

import numpy as np
import pytest

from dnnvss.errors import DnnvssError
from dnnvss.formats import (
    Landmarks,
    is_words_csv,
    read_alignment,
    read_landmarks,
    read_openface,
    write_alignment,
    write_openface,
    write_pts,
)
from dnnvss.formats.htk import is_transcript
from dnnvss.timing import Alignment, Tier

PHONES = [(0, 0.2, "sil"), (0.2, 0.3, "N"), (0.3, 0.5, "AW"), (0.5, 0.6, "sp"), (0.6, 0.7, "AY"), (0.7, 1, "sil")]
WORDS = [(0, 0.2, ""), (0.2, 0.5, "now"), (0.5, 0.6, ""), (0.6, 0.7, "I"), (0.7, 1, "")]
SPOKEN = Alignment([Tier("phones", PHONES), Tier("words", WORDS)])


def binary(tiers: dict[str, list[tuple[float, float, str]]]) -> bytes:
    """A TextGrid as Praat's "Save as binary file" writes it."""

    def text(value: str) -> bytes:
        if value.isascii():
            return struct.pack(">H", len(value)) + value.encode()
        return struct.pack(">HH", 0xFFFF, len(value.encode("utf-16-be")) // 2) + value.encode("utf-16-be")

    data = b"ooBinaryFile\x08TextGrid" + struct.pack(">dd?i", 0.0, 1.0, True, len(tiers) + 1)
    data += b"\x08TextTier" + text("events") + struct.pack(">ddi", 0, 1, 1) + struct.pack(">d", 0.5) + text("é")
    for name, rows in tiers.items():
        data += b"\x0cIntervalTier" + text(name) + struct.pack(">ddi", 0.0, 1.0, len(rows))
        for start, end, label in rows:
            data += struct.pack(">dd", start, end) + text(label)
    return data


def test_a_binary_textgrid_is_read(tmp_path: Path) -> None:
    path = tmp_path / "a.TextGrid"
    path.write_bytes(binary({"phones": PHONES, "words": [*WORDS[:1], (0.2, 0.5, "naïve"), *WORDS[2:]]}))
    found = read_alignment(path)
    assert found["phones"] == SPOKEN["phones"] and found["words"].labels == ("", "naïve", "", "I", "")
    path.write_bytes(path.read_bytes()[:-9])
    with pytest.raises(DnnvssError, match="is cut short"):
        read_alignment(path)


SHORT = '''File type = "ooTextFile"
Object class = "TextGrid"

0
1
<exists>
1
"IntervalTier"
"Words"
0
1
3
0
0.25
""
0.25
7.5e-1
"say ""item [1]"""
0.75
1
""
'''


def test_short_text_with_quotes_and_exponents_is_read(tmp_path: Path) -> None:
    (tmp_path / "a.TextGrid").write_text(SHORT)
    words = read_alignment(tmp_path / "a.TextGrid")["words"]
    assert words.labels == ("", 'say "item [1]"', "") and words.edges.tolist() == [0, 0.25, 0.75, 1]
    (tmp_path / "b.TextGrid").write_text(SHORT.replace('"ooTextFile"', '"ooTextFile short"').replace(
        'Object class = "TextGrid"', '"TextGrid"') + "! a remark, 5 \"and\"\n")
    assert read_alignment(tmp_path / "b.TextGrid")["words"] == words


def test_states_of_merlin_are_one_phone(tmp_path: Path) -> None:
    labels = ["x^x-sil+l=l", "x^sil-l+l=ow", "sil^l-l+ow=x", "l^l-ow+sil=x", "l^ow-sil+x=x"]
    lines = [f"{(5 * k + s) * 300000} {(5 * k + s + 1) * 300000} {label}@1_1/A:0[{s + 2}]"
             for k, label in enumerate(labels) for s in range(5)]
    (tmp_path / "a.lab").write_text("\n".join(lines))
    phones = read_alignment(tmp_path / "a.lab")["phones"]
    assert phones.labels == ("sil", "L", "L", "OW", "sil")
    assert phones.edges == pytest.approx([0, 0.15, 0.3, 0.45, 0.6, 0.75])
    states = enumerate(("sil", "L[2]", "L[3]", "L[4]", "L[2]", "sil"))
    bare = [f"{k * 500000} {(k + 1) * 500000} {p}" for k, p in states]
    (tmp_path / "b.lab").write_text("\n".join(bare))
    assert read_alignment(tmp_path / "b.lab")["phones"].labels == ("sil", "L", "L", "sil")


SPOKEN_ROWS = [(0, 0.2, "sil"), (0.2, 0.3, "HH"), (0.3, 0.4, "AH"), (0.4, 0.5, "L"), (0.5, 0.7, "OW"),
               (0.7, 0.9, "sil")]


def lab(form: str, states: int = 1, scale: float = 1e7) -> str:
    """A label file with a line for each state of each phone; the form names its start a, end b, phone p, state k."""
    lines = []
    for start, end, phone in SPOKEN_ROWS:
        for k in range(states):
            a, b = (start + (end - start) * n / states for n in (k, k + 1))
            first = phone if k == 0 else ""
            lines.append(form.format(a=round(a * scale), b=round(b * scale), p=phone, k=k, first=first, end=b).rstrip())
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize("text", [
    lab("{a} {b} {p}[{k}]", 5), lab("{a} {b} {p}[{k}] -55.3 {first}", 3), lab("{a} {b} {p}_s{k}", 3),
    lab("{a} {b} {p}.s{k} -1e2", 3), lab("{a} {b} s{k} -70.1 {first}", 3), lab("{a} {b} s{k} {first}", 3),
    lab("{a} {b} {p}", 5), lab("{a} {b} {p}_I"), lab("{a} {b} x^x-{p}+x=x@1_1/A:0"),
    "signal a\nnfields 1\n#\n" + lab("\t{end:.5f} 125 {p}"), "#\n" + lab("{end:.3f} 100 {p} ; x"),
    lab("{a} {b} {p}").replace("HH", "h").replace("AH", "\u0259").replace("L", "\u026b").replace("OW", "o\u028a"),
    lab("{a} {b} {p}").replace("HH", "h").replace("AH", "@").replace("L", "l").replace("OW", "@U")])
def test_label_files_of_all_aligners_are_the_same_phones(tmp_path: Path, text: str) -> None:
    (tmp_path / "a.lab").write_text(text)
    found = read_alignment(tmp_path / "a.lab")
    assert found["phones"].labels == ("sil", "HH", "AH", "L", "OW", "sil") and "words" not in found
    assert found["phones"].edges == pytest.approx([0, 0.2, 0.3, 0.4, 0.5, 0.7, 0.9])


def test_two_equal_phones_stay_two_and_a_sign_may_be_two_phones(tmp_path: Path) -> None:
    states = [f"{k * 500000} {(k + 1) * 500000} T[{2 + k % 3}]" for k in range(6)]
    (tmp_path / "a.lab").write_text("\n".join(states))
    assert read_alignment(tmp_path / "a.lab")["phones"].labels == ("T", "T")
    (tmp_path / "b.lab").write_text("0 1000000 T\n1000000 2000000 T\n2000000 3000000 AH\n")
    assert read_alignment(tmp_path / "b.lab")["phones"].labels == ("T", "T", "AH")
    (tmp_path / "c.lab").write_text("0 1000000 h\n1000000 3000000 \u026a\u0259\n3000000 4000000 sil\n")
    near = read_alignment(tmp_path / "c.lab")["phones"]
    assert near.labels == ("HH", "IH", "AH", "sil") and near.edges == pytest.approx([0, 0.1, 0.2, 0.3, 0.4])


@pytest.mark.parametrize("label", ["QQ", "\u00f8", "xyz"])
def test_labels_of_no_alphabet_are_named(tmp_path: Path, label: str) -> None:
    (tmp_path / "a.lab").write_text(f"0 100000 sil\n100000 200000 {label}\n")
    with pytest.raises(DnnvssError, match=f"line 2: unknown phone '{label}'"):
        read_alignment(tmp_path / "a.lab")


@pytest.mark.parametrize("text", [
    "Begin,End,Label,Type,Speaker\n0.2,0.7,now,words,a\n0.2,0.4,N,phones,a\n0.4,0.7,AW1,phones,a\n",
    "tmin\ttier\ttext\ttmax\n0.2\twords\tnow\t0.7\n0.2\tphones\tN\t0.4\n0.4\tphones\tAW\t0.7\n"])
def test_tables_of_aligners_hold_words_and_phones(tmp_path: Path, text: str) -> None:
    (tmp_path / "a.csv").write_text(text)
    found = read_alignment(tmp_path / "a.csv")
    assert found["words"].labels == ("", "now") and found["phones"].labels == ("sil", "N", "AW")
    assert found["phones"].edges == pytest.approx([0, 0.2, 0.4, 0.7])


@pytest.mark.parametrize("text", [
    "word,start,end\nhi,0.5,1.0\nyou,1.2,1.5\n", "\ufeffStart;End;Word\r\n0,5;1,0;hi\r\n1,2;1,5;you\r\n",
    "start,duration,text,confidence\n0.5,0.5,hi,1\n1.2,0.3,you,.9\n", "0.5,1.0,hi\n1.2,1.5,you\n",
    "begin (ms)\tend (ms)\tlabel\n500\t1000\thi\n1200\t1500\tyou\n",
    "start,end,word\n00:00:00.5,0:1,hi\n1.2,1.5,you\n"])
def test_columns_of_word_tables_are_found_by_their_names(tmp_path: Path, text: str) -> None:
    (tmp_path / "a.csv").write_text(text)
    assert is_words_csv(tmp_path / "a.csv")
    words = read_alignment(tmp_path / "a.csv")["words"]
    assert words.labels == ("", "hi", "", "you") and words.edges == pytest.approx([0, 0.5, 1, 1.2, 1.5])


@pytest.mark.parametrize("head", ["frame, timestamp, x_0\n1, 0.0, 3\n", "0.5,1.0,2.0\n", "Timecode,jawOpen\n0,1\n", ""])
def test_tables_of_other_things_are_no_words(tmp_path: Path, head: str) -> None:
    (tmp_path / "a.csv").write_text(head)
    assert not is_words_csv(tmp_path / "a.csv")


@pytest.mark.parametrize("name, scale, said", [
    ("a.lab", 0.1, "about 10 times"), ("a.lab", 0.0001, "too small"), ("a.TextGrid", 0.001, "too small"),
    ("a.TextGrid", 100, "too large"), ("a.csv", 0.001, "words last"), ("a.align", 0.001, "words last")])
def test_times_in_another_unit_are_refused(tmp_path: Path, name: str, scale: float, said: str) -> None:
    tiers = [Tier("phones", [(a * scale, b * scale, label) for a, b, label in PHONES])]
    words = [(0, .2, ""), (.2, .5, "now"), (.5, .6, "I"), (.6, .8, "see"), (.8, 1, "")]
    tiers.append(Tier("words", [(a * scale, b * scale, label) for a, b, label in words]))
    path = write_alignment(tmp_path / name, Alignment(tiers if name[2:] in ("lab", "TextGrid") else tiers[1:]))
    with pytest.raises(DnnvssError, match=said):
        read_alignment(path)


def test_a_transcript_named_lab_is_told_from_times() -> None:
    assert is_transcript("THREE BOYS RODE ALONG\n") and is_transcript("3 boys rode 4 miles\n")
    assert not is_transcript("0 2000000 sil\n2000000 3000000 AH\n") and not is_transcript("") and not is_transcript(
        "0,5 0,7 AH\n")


@pytest.mark.parametrize("sign, decimal", [(",", "."), (";", ","), (";", "."), ("\t", ",")])
def test_tables_of_other_countries_are_read(tmp_path: Path, sign: str, decimal: str) -> None:
    def table(text: str) -> str:
        return text.replace(",", sign).replace(".", decimal)

    words = Alignment([Tier("words", [(0, 0.25, ""), (0.25, 0.5, "now"), (0.5, 0.75, "I")])])
    path = write_alignment(tmp_path / "a.csv", words)
    text = table(path.read_text()) + f"\n{sign}{sign}\n  \n"
    path.write_text(text)
    assert read_alignment(path)["words"] == words["words"]
    path.write_text(f"sep={sign}\n" + text)
    assert read_alignment(path)["words"] == words["words"]
    points = np.random.default_rng(0).normal(50, 9, (4, 68, 2)).astype(np.float32)
    path = write_openface(tmp_path / "of.csv", Landmarks(points, np.ones(4, bool)))
    path.write_text(table(path.read_text().replace(", ", ",")))
    np.testing.assert_allclose(read_openface(path).points, points, atol=1e-4)


@pytest.mark.parametrize("nothing", ["-nan(ind)", "nan", "-nan", "NaN", "1.#QNAN", "-1.#IND", "inf", "", "NA", "NULL",
                                     "#NUM!", "#DIV/0!", "-"])
def test_frames_without_numbers_are_not_valid(tmp_path: Path, nothing: str) -> None:
    points = np.random.default_rng(0).normal(50, 9, (4, 68, 2)).astype(np.float32)
    path = write_openface(tmp_path / "of.csv", Landmarks(points, np.ones(4, bool)))
    lines = path.read_text().splitlines()
    lines[2] = ", ".join([*lines[2].split(", ")[:4], "0", *[nothing] * 136])
    path.write_text("\n".join(lines) + "\n")
    found = read_openface(path)
    assert found.valid.tolist() == [True, False, True, True]
    np.testing.assert_allclose(found.points[2], points[2], atol=1e-4)


def test_a_small_still_face_on_the_wall_is_not_the_talker(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    large, small = rng.normal(100, 40, (6, 68, 2)), rng.normal(20, 4, (6, 68, 2))
    talker = write_openface(tmp_path / "a.csv", Landmarks(large, np.ones(6, bool))).read_text().splitlines()
    wall = write_openface(tmp_path / "b.csv", Landmarks(small, np.ones(6, bool))).read_text().splitlines()
    rows = [talker[0]]
    for a, b in zip(talker[1:], wall[1:], strict=True):
        rows += [b.replace(" 1.00,", " 0.98,", 1), a.replace(", 0,", ", 1,", 1).replace(" 1.00,", " 0.88,", 1)]
    (tmp_path / "both.csv").write_text("\n".join(rows))
    found = read_openface(tmp_path / "both.csv")
    np.testing.assert_allclose(found.points, large, atol=1e-3)
    assert found.faces == 2 and read_openface(tmp_path / "a.csv").faces == 1


def test_a_face_that_a_tracker_lost_and_numbered_anew_is_one(tmp_path: Path) -> None:
    large = np.random.default_rng(0).normal(100, 40, (6, 68, 2))
    rows = write_openface(tmp_path / "a.csv", Landmarks(large, np.ones(6, bool))).read_text().splitlines()
    anew = [*rows[:4], *(row.replace(", 0,", ", 1,", 1) for row in rows[4:])]
    (tmp_path / "b.csv").write_text("\n".join(anew))
    found = read_openface(tmp_path / "b.csv")
    assert found.faces == 1 and found.valid.all() and found.points == pytest.approx(large, abs=1e-3)
    away = write_openface(tmp_path / "c.csv", Landmarks(large + 300, np.ones(6, bool))).read_text().splitlines()
    (tmp_path / "d.csv").write_text("\n".join([*rows[:4], *(row.replace(", 0,", ", 1,", 1) for row in away[4:])]))
    assert read_openface(tmp_path / "d.csv").faces == 2


def test_points_with_decimal_commas_are_read(tmp_path: Path) -> None:
    points = np.array([[1.5, 2.25], [3.0, 4.125]], np.float32)
    path = write_pts(tmp_path / "a_1.pts", points)
    head, body = path.read_text().split("{")
    path.write_text(head + "{" + body.replace(".", ","))
    np.testing.assert_allclose(read_landmarks(path).points[0], points)
