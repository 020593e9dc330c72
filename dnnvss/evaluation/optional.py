"""What a run is finished without: figures, samples."""

from collections.abc import Callable
from typing import Any

from dnnvss.errors import DnnvssError, ShortageError
from dnnvss.shortages import shortage_of


def attempted(what: str, step: Callable[[], Any]) -> bool:
    """Whether a step went well; what went wrong is printed, and costs nothing else.

    Raises:
        ShortageError: the system is short of something, which the next step would be too.
    """
    try:
        step()
    except ShortageError:
        raise
    except Exception as error:  # of a library that draws, encodes or speaks
        if (short := shortage_of(error)) is not None:
            raise short from error
        why = str(error) if isinstance(error, DnnvssError) else f"{type(error).__name__}: {error}"
        print(f"without {what}: {' '.join(why.split())[:300]}")
        return False
    return True
