"""Asks the index of advisories about every pinned version (make audit).

    python tests/audit.py [PROGRAM]     pip-audit, in an environment of its own, so that nothing is pinned for it

Status 1 where an advisory concerns a pinned version. Where pip-audit is missing, or no index of advisories can be
reached, nothing was checked: that is said, and the status is 0.
"""

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
PROGRAM = ROOT / ".venv-audit" / "bin" / "pip-audit"
PINNED = ROOT / "constraints.txt"
UNREACHED = ("ConnectionError", "Connection refused", "Max retries exceeded", "ConnectTimeout", "ReadTimeout", "HTTPError",
             "ServiceError", "Temporary failure in name resolution", "ProxyError", "SSLError", "Forbidden", "Not Found")
"""What pip-audit says where the index does not answer."""


def audit(program: Path) -> tuple[int, str]:
    """The status to end with, and what to say."""
    if not program.is_file():
        return 0, "NOT CHECKED: pip-audit could not be installed here"
    command = [str(program), "--requirement", str(PINNED), "--no-deps", "--disable-pip", "--progress-spinner", "off",
               "--timeout", "20"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    said = f"{done.stdout}{done.stderr}".strip()
    if done.returncode == 0:
        return 0, said
    if any(word in said for word in UNREACHED):
        return 0, f"NOT CHECKED: no index of advisories can be reached from here ({said.splitlines()[-1][:200]})"
    return 1, said


if __name__ == "__main__":
    status, text = audit(Path(sys.argv[1]) if len(sys.argv) > 1 else PROGRAM)
    print(text)
    sys.exit(status)
