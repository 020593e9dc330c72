"""What a program of this folder claims: numbers with their limits, printed and gathered in one form."""

import json
import os
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from math import log
from pathlib import Path

FILE = "DNNVSS_CLAIMS"
"""Variable that names the file in which claims are gathered."""


@dataclass(frozen=True)
class Claim:
    """One number with its limit.

    Args:
        what: was measured.
        found: the number.
        limit: that it is to keep.
        least: it is to be so much at least, not at most.
    """

    what: str
    found: float
    limit: float
    least: bool = False

    @property
    def row(self) -> tuple[str, str, str, str]:
        """What a table says of it: what, found, limit, whether it is kept."""
        kept = self.found >= self.limit if self.least else self.found <= self.limit
        bound = f"at {'least' if self.least else 'most'} {self.limit:g}"
        return self.what, f"{self.found:.3g}", bound, "yes" if kept else "no"


def tell(claims: Iterable[Claim]) -> None:
    """Print what is claimed; and add it to what is gathered, where something gathers."""
    told = list(claims)
    for claim in told:
        print("claim: {}: {} ({}): {}".format(*claim.row), flush=True)
    if gathered := os.environ.get(FILE):
        with Path(gathered).open("a", encoding="utf-8") as file:
            file.writelines(json.dumps(asdict(claim)) + "\n" for claim in told)


def growth(sizes: Iterable[float], seconds: Iterable[float]) -> float:
    """The exponent with which seconds grow with sizes, from the first to the last: 1 is linear."""
    (small, *_, large), (first, *_, last) = tuple(sizes), tuple(seconds)
    return log(last / first) / log(large / small)
