"""What is said of the pinned versions: nothing is vouched for that was not looked up."""

import json
import sys
from pathlib import Path
from typing import Any

import pytest
from audit import CONTROL, audit

VULN = {"id": "PYSEC-1", "fix_versions": ["9"]}
SKIPPED = {"name": "a", "skip_reason": "not found"}


@pytest.mark.parametrize(
    ("pinned", "control", "status", "said"),
    [
        ([SKIPPED], [SKIPPED], 0, "NOT CHECKED: the index that can be reached knows none of 1 packages"),
        ([{"name": "a", "version": "1", "vulns": []}], [{"name": "pyyaml", "version": "5.1", "vulns": []}], 0,
         "NOT CHECKED: the index that can be reached has no advisories"),
        ([{"name": "a", "version": "1", "vulns": []}], [SKIPPED], 0, "has no advisories"),
        ([{"name": "a", "version": "1", "vulns": []}, SKIPPED], [{"name": "pyyaml", "vulns": [VULN]}], 0,
         "1 packages checked, 0 advisories; 1 are unknown to the index"),
        ([{"name": "a", "version": "1", "vulns": [VULN]}], [SKIPPED], 1, "a 1: PYSEC-1, mended in 9"),
        (None, None, 0, "NOT CHECKED: no index of advisories can be reached from here (no route)"),
    ])
def test_what_an_index_knows_is_said(pinned: Any, control: Any, status: int, said: str, tmp_path: Path) -> None:
    program = tmp_path / "pip-audit"
    program.write_text(f"""#!{sys.executable}
import json, sys
from pathlib import Path
control = Path(sys.argv[2]).read_text().strip() == {'=='.join(CONTROL)!r}
found = json.loads({json.dumps([pinned, control])!r})[control]
if found is None:
    sys.exit("no route")
print(json.dumps({{"dependencies": found}}))
""")
    program.chmod(0o755)
    found, text = audit(program)
    assert found == status and said in text


def test_without_the_program_nothing_is_checked(tmp_path: Path) -> None:
    assert audit(tmp_path / "none") == (0, "NOT CHECKED: pip-audit could not be installed here")
