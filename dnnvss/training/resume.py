"""Where a fit that was killed goes on."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from dnnvss.errors import DnnvssError
from dnnvss.staging import sweep
from dnnvss.training.checkpoints import load_checkpoint
from dnnvss.training.devices import process_number


@dataclass(frozen=True)
class Start:
    """The checkpoint from which a fit goes on.

    Args:
        path: of it; None where the fit begins.
        state: what it holds.
    """

    path: Path | None = None
    state: dict[str, Any] = field(default_factory=dict)

    def of(self, callback: str) -> dict[str, Any]:
        """What a callback had left in it, by the callback's key."""
        return self.state.get("callbacks", {}).get(callback, {})


def resume_point(checkpoints: Path) -> Start:
    """Where a fit goes on: the last checkpoint, or an earlier one where the last is damaged.

    A fit depends on its seed and its epoch alone, so that it ends with the same weights from either.

    Raises:
        DnnvssError: there is a checkpoint and none is whole.
    """
    if process_number() == 0:
        sweep(checkpoints)  # what a killed fit was writing
    found = [path for name in ("last.ckpt", "best.ckpt") if (path := checkpoints / name).exists()]
    problem: DnnvssError | None = None
    for path in found:
        try:
            kept = load_checkpoint(path)
        except DnnvssError as error:
            problem = problem or error
            continue
        if problem is not None:
            print(f"{problem.file} is damaged: the fit goes on from {path.name} (epoch {kept.get('epoch')})")
        else:
            print(f"{path}: epoch {kept.get('epoch')} was the last")
        return Start(path, kept)
    if problem is not None:
        raise problem
    return Start()
