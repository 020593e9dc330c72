"""Alignments in the labels, columns and times of several tools."""

from pathlib import Path

import pytest

from dnnvss.errors import DnnvssError
from dnnvss.formats import read_alignment
from dnnvss.formats.labels import phone_of, phone_tier, word_of
from dnnvss.timing import Segment


def labels(*written: str) -> list[tuple[float, str]]:
    """What comes of labels that last a tenth of a second each: start and phone."""
    tier = phone_tier([Segment(k / 10, (k + 1) / 10, label) for k, label in enumerate(written)])
    return [(round(s.start, 3), s.label) for s in tier]


def test_closures_of_timit_are_of_their_stops() -> None:
    found = labels("h#", "tcl", "t", "ix", "dcl", "jh", "bcl", "epi", "kcl", "k", "q", "h#")
    assert found == [(0.0, "sil"), (0.1, "T"), (0.3, "IH"), (0.4, "JH"), (0.6, "B"), (0.7, "sp"), (0.8, "K"),
                     (1.0, "T"), (1.1, "sil")]


def test_noises_of_the_penn_aligner_are_silence() -> None:
    assert labels("sp", "br", "HH", "AY1", "lg", "sp") == [(0.0, "sil"), (0.2, "HH"), (0.3, "AY"), (0.4, "sil")]
    assert [word_of(w) for w in ("{BR}", "{lg}", "sp", "HI")] == ["", "", "", "HI"]


def test_pauses_and_noises_in_brackets_are_silence(tmp_path: Path) -> None:
    """Charsiu writes ``[SIL]`` into both tiers, Sphinx ``++BREATH++``, Buckeye ``<LAUGH>``; ``[UNK]`` is no pause."""
    assert labels("[SIL]", "HH", "AY1", "<LAUGH>", "++BREATH++") == [(0.0, "sil"), (0.1, "HH"), (0.2, "AY"),
                                                                     (0.3, "sil")]
    assert [word_of(w) for w in ("[SIL]", "<NOISE>", "+COUGH+", "[UNK]", "noise")] == ["", "", "", "[UNK]", "noise"]
    with pytest.raises(DnnvssError, match=r"unknown phone '\[UNK\]'"):
        labels("[SIL]", "[UNK]", "AY1")


def test_phones_with_one_neighbour_are_those_of_htk(tmp_path: Path) -> None:
    """Triphones within words have one neighbour at either end; a hyphen of TIMIT's own stays."""
    assert [phone for _, phone in labels("sil", "hh+ah", "hh-ah+l", "ah-l+ow", "l-ow", "ax-h", "sil")] == [
        "sil", "HH", "AH", "L", "OW", "AH", "sil"]


def test_times_of_timit_are_samples(tmp_path: Path) -> None:
    path = tmp_path / "SA1.PHN"
    path.write_text("0 3050 h#\n3050 4559 sh\n4559 5723 ix\n5723 9000 h#\n")
    found = read_alignment(path)["phones"]
    assert (found.labels, found.edges.round(4).tolist()) == (("sil", "SH", "IH", "sil"),
                                                             [0, 0.1906, 0.2849, 0.3577, 0.5625])


def test_what_is_wrong_in_labels_of_timit_is_told_in_its_samples(tmp_path: Path) -> None:
    path = tmp_path / "SA1.PHN"
    for text, told in (("MillisecondsPerFrame: 1.0\n0 110 sil\n", "is not START END PHONE. .*16,000 to the second"),
                       ("0 110 h#\n110 200 hh\n200 300 aa\n300 400 t\n", "too small.*TIMIT .* samples")):
        path.write_text(text)
        with pytest.raises(DnnvssError, match=told):
            read_alignment(path)
    for label, told in (("foo-bar", "unknown phone 'foo-bar'"), ("spn+aa", "marks a word that the aligner")):
        with pytest.raises(DnnvssError, match=told):
            phone_of(label)


def test_master_labels_of_windows_are_found_by_name(tmp_path: Path) -> None:
    path = tmp_path / "all.mlf"
    lines = ["0 5000000 sil", "5000000 6000000 hh", "6000000 7000000 ay", "7000000 9000000 sil"]
    path.write_text("#!MLF!#\n" + "".join(f'"C:\\data\\{name}.lab"\n' + "\n".join(lines) + "\n.\n" for name in "ab"))
    assert read_alignment(path, "b")["phones"].labels == ("sil", "HH", "AY", "sil")


def test_the_label_that_no_alphabet_has_is_named() -> None:
    with pytest.raises(DnnvssError, match="'6' is no sound"):
        labels("h", "@", "l", "@U", "6", "3:", "tS")
    with pytest.raises(DnnvssError, match="unknown phone 'own'"):
        labels("hh", "ah", "l", "own")
    assert [phone for _, phone in labels("ç", "ə", "t̪", "əw")] == ["HH", "AH", "T", "OW"]


@pytest.mark.parametrize("behind", ["", " 0.000000"])
def test_pauses_without_a_length_are_left_out(tmp_path: Path, behind: str) -> None:
    """HVite writes a line for each ``sp`` that it passed over; Julius names its silences silB and silE."""
    path = tmp_path / "a.lab"
    lines = ["0 5000000 silB", "5000000 6000000 hh", "6000000 7000000 ay", "7000000 7000000 sp", "7000000 9000000 silE"]
    path.write_text("".join(f"{line}{behind}\n" for line in lines))
    found = read_alignment(path)["phones"]
    assert (found.labels, found.edges.round(4).tolist()) == (("sil", "HH", "AY", "sil"), [0, 0.5, 0.6, 0.7, 0.9])
    path.write_text("0 5000000 sil\n5000000 5000000 hh\n5000000 6000000 sil\n")
    with pytest.raises(DnnvssError, match=r"line 2: .* 'hh' runs from 0\.5 to 0\.5 s"):
        read_alignment(path)


def test_whole_seconds_among_others_are_seconds(tmp_path: Path) -> None:
    path = tmp_path / "a.lab"
    path.write_text("0 0.5 sil\n0.5 0.6 hh\n0.6 1 ow\n1 2 sil\n")
    assert read_alignment(path)["phones"].edges.tolist() == [0, 0.5, 0.6, 1, 2]
    path.write_text("0.0 5000000 sil\n5000000 6000000 hh\n6000000 20000000 sil\n")
    assert read_alignment(path)["phones"].edges.tolist() == [0, 0.5, 0.6, 2]


@pytest.mark.parametrize(("head", "unit"), [
    ("start_ms,end_ms,word", 1000), ("start (ms),end (ms),word", 1000), ("start_s,end_s,word", 1),
    ("starts,ends,word", 0),
])
def test_units_in_the_names_of_columns(tmp_path: Path, head: str, unit: int) -> None:
    path = tmp_path / "a.csv"
    path.write_text(f"{head}\n{unit * 0.5},{unit * 1.0},hello\n")
    if unit:
        assert read_alignment(path)["words"].edges.tolist() == [0, 0.5, 1]
    else:
        with pytest.raises(DnnvssError, match="is not start,end,word"):
            read_alignment(path)


def test_names_of_tiers(tmp_path: Path) -> None:
    path = tmp_path / "a.TextGrid"
    path.write_text('File type = "ooTextFile"\nObject class = "TextGrid"\n0\n1\n<exists>\n2\n"IntervalTier"\n"wrd"\n0\n'
                    '1\n1\n0\n1\n"hi"\n"IntervalTier"\n"phn"\n0\n1\n2\n0\n0.5\n"HH"\n0.5\n1\n"AY1"\n')
    assert {tier.name: tier.labels for tier in read_alignment(path).tiers} == {"words": ("hi",), "phones": ("HH", "AY")}


def test_words_of_recognisers_may_overlap_by_a_rounding(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("start,end,word\n0.5,0.9,hello\n0.88,1.2,there\n")
    found = read_alignment(path)["words"]
    assert found.labels == ("", "hello", "there") and found.edges.tolist() == [0, 0.5, 0.9, 1.2]
    path.write_text("start,end,word\n0.5,0.9,hello\n0.88,0.89,there\n")
    with pytest.raises(DnnvssError, match="line 3: 'there' starts at 0"):
        read_alignment(path)
