"""Alignments survive a round trip with exact numbers, and bad files are named with line and remedy."""

import pytest

from dnnvss.errors import DnnvssError
from dnnvss.formats import read_alignment, read_grid_align, read_mlf, spanning, write_alignment, write_mlf
from dnnvss.formats.labels import phone_of
from dnnvss.timing import Alignment, Tier

PHONES = [(0.0, 0.25, "sil"), (0.25, 0.31, "B"), (0.31, 0.4, "IH"), (0.4, 0.4567, "N"), (0.4567, 0.5, "sp"),
          (0.5, 0.62, "AH"), (0.62, 0.96, "sil")]
WORDS = [(0.0, 0.25, ""), (0.25, 0.4567, "bin"), (0.4567, 0.5, ""), (0.5, 0.62, "a"), (0.62, 0.96, "")]


@pytest.fixture
def alignment():
    return Alignment([Tier("phones", PHONES), Tier("words", WORDS)])


@pytest.mark.parametrize("suffix", [".TextGrid", ".lab", ".mlf"])
def test_phones_and_words_come_back_as_written(tmp_path, alignment, suffix):
    path = write_alignment(tmp_path / f"one{suffix}", alignment)
    back = read_alignment(path)
    for name in ("phones", "words"):
        assert back[name].labels == alignment[name].labels
        assert back[name].edges == pytest.approx(alignment[name].edges, abs=1e-9)
    again = write_alignment(tmp_path / f"two{suffix}", back)
    assert again.read_text().replace("two", "one") == path.read_text()


@pytest.mark.parametrize("suffix", [".TextGrid", ".lab", ".mlf", ".align"])
@pytest.mark.parametrize("word", ["silence", "2", "New York"])
def test_words_that_look_like_something_else_come_back(tmp_path, alignment, suffix, word):
    named = alignment.with_tier(alignment["words"].renamed(["", word, "", "7", ""]))
    path = write_alignment(tmp_path / f"one{suffix}", named)
    assert read_alignment(path)["words"].labels == ("", word, "", "7", "")


def test_scores_of_htk_stand_on_every_line_and_words_may_follow(tmp_path):
    path = tmp_path / "one.lab"
    path.write_text("0 1e6 sil -3.5\n1e6 2e6 B -7 bin -20\n2e6 3e6 IH 4\n3e6 4e6 N 5e-1\n")
    assert read_alignment(path)["words"].labels == ("", "bin")
    path.write_text("0 1e6 T 2\n1e6 2e6 UW\n")
    assert read_alignment(path)["words"].labels == ("2",)


def test_grid_align_holds_words_in_units_of_25_kilohertz(tmp_path, alignment):
    path = write_alignment(tmp_path / "one.align", alignment)
    assert path.read_text().splitlines() == [
        "0 6250 sil", "6250 11418 bin", "11418 12500 sp", "12500 15500 a", "15500 24000 sil"]
    assert read_grid_align(path).edges == pytest.approx([0, 0.25, 0.45672, 0.5, 0.62, 0.96])
    assert read_alignment(path)["words"].labels == ("", "bin", "", "a", "")


def test_words_csv(tmp_path, alignment):
    path = write_alignment(tmp_path / "one.csv", alignment)
    assert path.read_text() == "start,end,word\n0.2500,0.4567,bin\n0.5000,0.6200,a\n"
    back = read_alignment(path)["words"]
    assert list(back) == WORDS[:-1]  # silence at the end is not written


def test_the_lab_file_is_what_htk_expects(tmp_path, alignment):
    lines = write_alignment(tmp_path / "one.lab", alignment).read_text().splitlines()
    assert lines[:3] == ["0 2500000 sil sil", "2500000 3100000 B bin", "3100000 4000000 IH"]


def test_lab_in_seconds_with_scores_and_full_context_labels(tmp_path):
    path = tmp_path / "hts.lab"
    path.write_text("0.0 0.2 x^x-pau+hh=ax@1_1/A:0 -3.5\n0.2 0.3 x^pau-hh+ax=l@1_2/A:1 -7\n"
                    "0.3 0.5 pau^hh-ax+l=ow@2_1 1e3\n")
    tier = read_alignment(path)["phones"]
    assert tier.labels == ("sil", "HH", "AH")
    assert tier.edges.tolist() == [0.0, 0.2, 0.3, 0.5]
    assert "words" not in read_alignment(path)


@pytest.mark.parametrize(("label", "phone"), [
    ("AH0", "AH"), ("iy1", "IY"), ("sil", "sil"), ("SP", "sp"), ("<eps>", ""), ("", ""), ("pau", "sil"), ("h#", "sil"),
    ("sil-B+IH", "B"), ("ax", "AH"), ("em", "M")])
def test_labels_of_other_tools(label, phone):
    assert phone_of(label) == phone


def test_montreal_forced_aligner_labels(tmp_path):
    intervals = [("phones", ["", "HH", "AH0", "sil", "L", "OW1", "sp", ""], [0, .1, .2, .3, .35, .4, .5, .52, .6]),
                 ("words", ["<eps>", "huh", "", "low", "", ""], [0, .1, .3, .35, .5, .52, .6])]
    blocks = []
    for number, (name, labels, edges) in enumerate(intervals, start=1):
        rows = "".join(f'        intervals [{i}]:\n        xmin = {a}\n        xmax = {b}\n        text = "{text}"\n'
                       for i, (text, a, b) in enumerate(zip(labels, edges[:-1], edges[1:], strict=True), start=1))
        blocks.append(f'    item [{number}]:\n        class = "IntervalTier"\n        name = "speaker1 - {name}"\n'
                      f"        xmin = 0\n        xmax = 0.6\n        intervals: size = {len(labels)}\n{rows}")
    path = tmp_path / "mfa.TextGrid"
    path.write_text('File type = "ooTextFile"\nObject class = "TextGrid"\n\nxmin = 0\nxmax = 0.6\ntiers? <exists>\n'
                    "size = 2\nitem []:\n" + "".join(blocks))
    found = read_alignment(path)
    assert found["phones"].labels == ("sil", "HH", "AH", "sil", "L", "OW", "sil")
    assert found["phones"].edges == pytest.approx([0, .1, .2, .3, .35, .4, .5, .6])
    assert found["words"].labels == ("", "huh", "", "low", "")


def test_every_utterance_of_a_master_label_file(tmp_path, alignment):
    shifted = Alignment([t.moved(1.0) for t in alignment.tiers])
    path = write_mlf(tmp_path / "all.mlf", {"a": alignment, "b": shifted})
    found = read_mlf(path)
    assert list(found) == ["a", "b"]
    assert found["b"]["phones"].edges == pytest.approx(shifted["phones"].edges)
    assert read_alignment(path, "a")["words"].labels == alignment["words"].labels
    with pytest.raises(DnnvssError, match="holds 2 utterances, not 'c'"):
        read_alignment(path, "c")


@pytest.mark.parametrize(("name", "text", "said"), [
    ("x.lab", "0 100000 sil\n100000 200000 QQ\n", "line 2: unknown phone 'QQ'"),
    ("x.lab", "0 100000 sil\n200000 300000 AA\n", "line 2: gap of 0.0100 s"),
    ("x.lab", "0 200000 sil\n100000 300000 AA\n", "line 2: overlap of 0.0100 s"),
    ("x.lab", "0 sil\n", "line 1: '0 sil' is not START END PHONE"),
    ("x.lab", "100000 0 sil\n", "line 1: .*runs from 0.01 to 0.0"),
    ("x.lab", "\n", "holds no label"),
    ("x.mlf", "0 1 sil\n", "line 1 is not #!MLF!#"),
    ("x.mlf", '#!MLF!#\n"a.lab"\n0 1 sil\n.\n"b.lab"\n0 1 sil\n', "line 6: utterance 'b' has no end"),
    ("x.mlf", '#!MLF!#\n"a.lab"\n0 1 sil\n"b.lab"\n0 1 sil\n.\n', "line 3: utterance 'a' has no end"),
    ("x.mlf", '#!MLF!#\n"a.lab"\n0 1 sil\n.\n"b.la', "line 5: utterance '' has no end"),
    ("x.align", "0 100 sil\n100 200\n", "line 2: '100 200' is not START END WORD"),
    ("x.align", "0 100 sil\n25000 50000 bin\n", "line 2: .*gap of 0.9960 s"),
    ("x.csv", "word\n", "line 1 is not start,end,word"),
    ("x.csv", "start,end,word\n", "holds no word"),
    ("x.csv", "start,end,word\n0,0.5,a\n0.4,0.6,b\n", "line 3: 'b' starts at 0.4000 s, before 0.5000 s"),
    ("x.csv", "start,end,word\n0,half,a\n", "line 2: '0,half,a' is not START,END,WORD"),
    ("x.TextGrid", "nonsense", "cannot be read"),
    ("x.doc", "", "not understood"),
])
def test_bad_files_are_named_with_line_and_remedy(tmp_path, name, text, said):
    path = tmp_path / name
    path.write_text(text)
    with pytest.raises(DnnvssError, match=said) as caught:
        read_alignment(path)
    assert str(path) in str(caught.value)
    assert caught.value.remedy


def test_unknown_phone_in_a_textgrid_names_the_tier(tmp_path, alignment):
    path = write_alignment(tmp_path / "one.TextGrid", alignment)
    path.write_text(path.read_text().replace('text = "IH"', 'text = "spn"'))
    with pytest.raises(DnnvssError, match="tier 'phones': phone 'spn'"):
        read_alignment(path)


def test_a_textgrid_that_is_cut_short_is_refused(tmp_path, alignment):
    path = write_alignment(tmp_path / "a.TextGrid", alignment)
    lines = path.read_text().splitlines()
    last = max(i for i, line in enumerate(lines) if "intervals [" in line)
    path.write_text("\n".join(lines[:last]) + "\n")
    with pytest.raises(DnnvssError, match=r"a\.TextGrid: is cut short"):
        read_alignment(path)


def test_overlap_in_a_textgrid(tmp_path, alignment):
    path = write_alignment(tmp_path / "one.TextGrid", alignment)
    path.write_text(path.read_text().replace("xmax = 0.31", "xmax = 0.35"))
    with pytest.raises(DnnvssError, match=r"one\.TextGrid"):
        read_alignment(path)


def test_spanning_pads_and_cuts_silence(alignment):
    longer = spanning(alignment, 1.5)
    assert (longer.end, longer["phones"].labels) == (1.5, alignment["phones"].labels)
    shorter = spanning(alignment, 0.6)
    assert shorter["words"].edges.tolist() == [0.0, 0.25, 0.4567, 0.5, 0.6]
    assert shorter["phones"].labels[-1] == "AH"
    bare = Alignment([Tier("phones", PHONES[1:-1]), Tier("words", WORDS[1:-1])])
    padded = spanning(bare, 0.96)
    assert padded == alignment
    with pytest.raises(DnnvssError, match=r"recording runs from 0 to 0\.400"):
        spanning(alignment, 0.4)


def test_spanning_makes_the_outer_visemes_longer(alignment):
    units = Alignment([Tier("phones", PHONES[1:-1]), Tier("visemes", [(0.25, 0.4, "7"), (0.4, 0.62, "3")])])
    longer = spanning(units, 0.96)["visemes"]
    assert (longer.labels, longer.edges.tolist()) == (("7", "3"), [0.0, 0.4, 0.96])
    silent_end = alignment.with_tier(Tier("visemes", [(0.0, 0.4, "7"), (0.4, 0.96, "3")]))
    assert spanning(silent_end, 0.7)["visemes"].edges.tolist() == [0.0, 0.4, 0.7]


def test_what_a_textgrid_has_before_the_sound_is_cut_off(tmp_path, alignment):
    """Praat counts its times from the beginning of the sound, also in a stretch that begins before it."""
    path = write_alignment(tmp_path / "one.TextGrid", alignment)
    begins = path.read_text().replace("xmin = 0.0", "xmin = 0").replace("xmin = 0 ", "xmin = 0\n")
    path.write_text(begins.replace("xmin = 0\n", "xmin = -0.01\n"))
    assert list(read_alignment(path)["phones"]) == PHONES
    path.write_text(begins.replace("xmin = 0\n", "xmin = -0.5\n"))
    with pytest.raises(DnnvssError, match=r"interval 1 'sil' starts at -0\.5000 s, before the sound does\."):
        read_alignment(path)
