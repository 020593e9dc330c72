"""Which of the processes that share a fit this one is."""

import os

_NUMBERS = ("RANK", "SLURM_PROCID")
"""Where torchrun and Slurm tell a process its number."""
_PARTS = ("NODE_RANK", "GROUP_RANK", "LOCAL_RANK")
"""Where Lightning's own launcher tells the number of the machine, and of the process on it."""


def process_number() -> int:
    """Return a number that is 0 in the first of the processes that share a fit, and where a process is alone."""
    whole = next((int(os.environ[name]) for name in _NUMBERS if name in os.environ), None)
    return whole if whole is not None else max(int(os.environ.get(name, 0)) for name in _PARTS)
