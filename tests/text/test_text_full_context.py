"""HTS full-context labels of a sentence worked by hand, and back."""

from pathlib import Path

from dnnvss.formats import read_alignment
from dnnvss.text.full_context import full_context, write_full_context
from dnnvss.timing import Alignment, Tier

PHONES = ["sil", "HH", "AH", "L", "OW", "sp", "N", "AW", "sil"]
TIER = Tier("phones", [(k / 10, (k + 1) / 10, p) for k, p in enumerate(PHONES)])
WORDS = Tier("words", [(0, 0.1, ""), (0.1, 0.5, "hello"), (0.5, 0.6, ""), (0.6, 0.8, "now"), (0.8, 0.9, "")])
SAID = Alignment([TIER, WORDS])


def test_hand_worked_labels() -> None:
    labels = full_context(SAID, "Hello, now.")
    assert labels[3] == ("hh^ah-l+ow=ssil@1_2/A:0_xx_2/B:1-xx-2@2-1&2-1#0-0$xx-xx!0-0;xx-xx|ow/C:1+xx+2/D:xx_xx"
                         "/E:xx+2@1+1&xx+xx#xx+xx/F:xx_1/G:xx_xx/H:2=1^1=2|xx/I:1=1/J:3+2-2")
    assert labels[2] == ("pau^hh-ah+l=ow@2_1/A:xx_xx_xx/B:0-xx-2@1-2&1-2#0-1$xx-xx!0-1;xx-xx|ah/C:1+xx+2/D:xx_xx"
                         "/E:xx+2@1+1&xx+xx#xx+xx/F:xx_1/G:xx_xx/H:2=1^1=2|xx/I:1=1/J:3+2-2")
    assert labels[5] == ("l^ow-ssil+n=aw@xx_xx/A:1_xx_2/B:xx-xx-xx@xx-xx&xx-xx#xx-xx$xx-xx!xx-xx;xx-xx|x/C:1+xx+2"
                         "/D:xx_2/E:xx+xx@xx+xx&xx+xx#xx+xx/F:xx_1/G:2_1/H:xx=xx^xx=xx|xx/I:1=1/J:3+2-2")


def test_one_phrase_counts_stress_on_both_sides() -> None:
    labels = full_context(SAID, "hello now")
    assert "&3-1#1-0$xx-xx!1-0;" in labels[7]
    assert labels[7].endswith("/G:xx_xx/H:3=2^1=1|xx/I:xx=xx/J:3+2-1")


def test_phones_and_times_come_back(tmp_path: Path) -> None:
    path = write_full_context(tmp_path / "one.lab", SAID, "Hello, now.")
    assert path.read_text().startswith("0 1000000 x^x-pau+hh=ah@xx_xx/A:")
    assert read_alignment(path)["phones"] == TIER
