"""Which of the processes that share a fit this one is."""

import os

_NUMBERS = ("RANK", "SLURM_PROCID", "LOCAL_RANK")
"""Where torchrun, Slurm and Lightning's own launcher tell a process its number."""


def process_number() -> int:
    """Return the number of this process among those that share a fit; 0 where it is the first or alone."""
    return next((int(os.environ[name]) for name in _NUMBERS if name in os.environ), 0)
