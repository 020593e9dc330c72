"""Alignments and landmarks as programs and editors of other countries and years write them."""

import struct
from pathlib import Path

import numpy as np
import pytest

from dnnvss.errors import DnnvssError
from dnnvss.formats import (
    Landmarks,
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


@pytest.mark.parametrize("nothing", ["-nan(ind)", "nan", "-nan", "NaN", "1.#QNAN", "-1.#IND", "inf", "", "NA"])
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


def test_points_with_decimal_commas_are_read(tmp_path: Path) -> None:
    points = np.array([[1.5, 2.25], [3.0, 4.125]], np.float32)
    path = write_pts(tmp_path / "a_1.pts", points)
    head, body = path.read_text().split("{")
    path.write_text(head + "{" + body.replace(".", ","))
    np.testing.assert_allclose(read_landmarks(path).points[0], points)
