"""Asks the index of advisories about every pinned version (make audit).

    python tests/audit.py [PROGRAM]     pip-audit, in an environment of its own, so that nothing is pinned for it

Status 1 where an advisory concerns a pinned version. Where pip-audit is missing, or no index that can be reached knows
the packages, nothing was checked: that is said, and the status is 0.
"""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
PROGRAM = ROOT / ".venv-audit" / "bin" / "pip-audit"
PINNED = ROOT / "constraints.txt"
def audit(program: Path) -> tuple[int, str]:
    """The status to end with, and what to say."""
    if not program.is_file():
        return 0, "NOT CHECKED: pip-audit could not be installed here"
    command = [str(program), "--requirement", str(PINNED), "--no-deps", "--disable-pip", "--progress-spinner", "off",
               "--timeout", "20", "--format", "json"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    try:
        packages = json.loads(done.stdout)["dependencies"]
    except (ValueError, KeyError):
        last = (done.stderr.strip().splitlines() or ["no message"])[-1]
        return 0, f"NOT CHECKED: no index of advisories can be reached from here ({last[:200]})"
    return judged(packages)


def judged(packages: list[dict[str, Any]]) -> tuple[int, str]:
    """The status and the words for what pip-audit found of each package."""
    asked = [package for package in packages if "skip_reason" not in package]
    known = [f"{p['name']} {p['version']}: {v['id']}, mended in {', '.join(v['fix_versions']) or 'no version'}"
             for p in asked for v in p["vulns"]]
    if not asked:
        return 0, f"NOT CHECKED: the index that can be reached knows advisories of none of {len(packages)} packages"
    skipped = f"; {len(packages) - len(asked)} are unknown to the index" if len(asked) < len(packages) else ""
    return int(bool(known)), "\n".join([*known, f"{len(asked)} packages checked, {len(known)} advisories{skipped}"])


if __name__ == "__main__":
    status, text = audit(Path(sys.argv[1]) if len(sys.argv) > 1 else PROGRAM)
    print(text)
    sys.exit(status)
