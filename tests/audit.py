"""Asks the index of advisories about every pinned version (make audit).

    python tests/audit.py [PROGRAM]     pip-audit, in an environment of its own, so that nothing is pinned for it

Status 1 where an advisory concerns a pinned version. Where pip-audit is missing, no index that can be reached knows the
packages, or the index has no advisories, nothing was checked: that is said, and the status is 0. Whether it has any is
asked of a version about which advisories have been public for years: a mirror may know packages and nothing of them.
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
PROGRAM = ROOT / ".venv-audit" / "bin" / "pip-audit"
PINNED = ROOT / "constraints.txt"
CONTROL = "pyyaml", "5.1"
"""A version that runs code out of a file (CVE-2020-1747, CVE-2020-14343), never pinned here."""

Packages = list[dict[str, Any]]


def audit(program: Path) -> tuple[int, str]:
    """The status to end with, and what to say."""
    if not program.is_file():
        return 0, "NOT CHECKED: pip-audit could not be installed here"
    packages = asked(program, PINNED)
    if isinstance(packages, str):
        return 0, packages
    with tempfile.TemporaryDirectory() as folder:
        control = Path(folder) / "control.txt"
        control.write_text("==".join(CONTROL) + "\n")
        known = asked(program, control)
    return judged(packages, [] if isinstance(known, str) else known)


def asked(program: Path, pinned: Path) -> Packages | str:
    """What pip-audit says of each package of a list, or why it says nothing."""
    command = [str(program), "--requirement", str(pinned), "--no-deps", "--disable-pip", "--progress-spinner", "off",
               "--timeout", "20", "--format", "json"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    try:
        found: Packages = json.loads(done.stdout)["dependencies"]
    except (ValueError, KeyError):
        last = (done.stderr.strip().splitlines() or ["no message"])[-1]
        return f"NOT CHECKED: no index of advisories can be reached from here ({last[:200]})"
    return found


def judged(packages: Packages, control: Packages) -> tuple[int, str]:
    """The status and the words for what pip-audit found of each package, and of :data:`CONTROL`."""
    checked = [package for package in packages if "skip_reason" not in package]
    known = [f"{p['name']} {p['version']}: {v['id']}, mended in {', '.join(v['fix_versions']) or 'no version'}"
             for p in checked for v in p["vulns"]]
    if not checked:
        return 0, f"NOT CHECKED: the index that can be reached knows none of {len(packages)} packages"
    if not known and not any(package.get("vulns") for package in control):
        return 0, (f"NOT CHECKED: the index that can be reached has no advisories (it has none about "
                   f"{' '.join(CONTROL)}, of which several are public)")
    skipped = f"; {len(packages) - len(checked)} are unknown to the index" if len(checked) < len(packages) else ""
    return int(bool(known)), "\n".join([*known, f"{len(checked)} packages checked, {len(known)} advisories{skipped}"])


if __name__ == "__main__":
    status, text = audit(Path(sys.argv[1]) if len(sys.argv) > 1 else PROGRAM)
    print(text)
    sys.exit(status)
