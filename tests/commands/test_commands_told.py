"""What messages and helps tell to run is there in a wheel as in a clone: dnnvss, not the programs beside it."""

import re

from conftest import ROOT

_OF_A_CLONE = re.compile(r"python (?:\S*/)?(?:train|synth)\.py|python -m data_prep")


def test_commands_that_are_told_are_those_of_the_package() -> None:
    told = [path for room in ("dnnvss", "conf") for kind in ("py", "yaml", "js", "html")
            for path in (ROOT / room).rglob(f"*.{kind}")]
    assert len(told) > 400
    assert [str(path) for path in told if _OF_A_CLONE.search(path.read_text("utf-8"))] == []
