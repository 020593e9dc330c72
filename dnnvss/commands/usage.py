"""Mistakes on the command line, and the statuses that every command ends with."""

import functools
import os
import sys
from collections.abc import Callable
from concurrent.futures import BrokenExecutor
from typing import Any, NoReturn

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.shortages import shortage_of

DONE, FAILED, MISUSED, INTERRUPTED = 0, 1, 2, 130
"""Statuses: all went well; something is wrong with what was read or written; the command line cannot be understood;
Ctrl-C."""


class UsageError(DnnvssError):
    """A command line that cannot be understood, or a setting that cannot be."""


def guarded(function: Callable[..., Any]) -> Callable[..., Any]:
    """``function`` with every mistake of the user's turned into one line on standard error and an exit status."""

    @functools.wraps(function)
    def wrapped(*args: Any, **kwargs: Any) -> Any:
        try:
            return function(*args, **kwargs)
        except DnnvssError as error:
            print(f"error: {error}", file=sys.stderr)
            sys.exit(MISUSED if isinstance(error, UsageError) else FAILED)
        except BrokenPipeError:  # who reads what is printed has read enough
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            sys.exit(FAILED)
        except OSError as error:
            if (remedy := files.remedy_for(error)) is None:
                _shortage_or(error)
            print(f"error: {error.filename or 'the disk'}: {error.strerror}. {remedy}.", file=sys.stderr)
            sys.exit(FAILED)
        except (BrokenExecutor, MemoryError):
            print("error: there was too little memory, or the system ended a process of the command. Run fewer side by "
                  "side (jobs=1), then the same command again: what was finished is kept.", file=sys.stderr)
            sys.exit(FAILED)
        except (RuntimeError, ImportError) as error:
            _shortage_or(error)
        except UnicodeEncodeError as error:  # of a name of a file: what is printed escapes the signs that it lacks
            if (system := sys.getfilesystemencoding()) == "utf-8" or error.encoding != system:
                raise
            print(f"error: names of files are {system} here, which has no {error.object[error.start : error.end]!a} "
                  f"({error.object!a}). Set PYTHONUTF8=1, then the same command again.", file=sys.stderr)
            sys.exit(FAILED)
        except KeyboardInterrupt:
            print("interrupted: what was finished is kept; the same command goes on from there", file=sys.stderr)
            sys.exit(INTERRUPTED)

    return wrapped


def _shortage_or(error: Exception) -> NoReturn:
    """End with what the system is short of, if that is what an error comes from; else raise it again."""
    if (short := shortage_of(error)) is None:
        raise error
    print(f"error: {short}", file=sys.stderr)
    sys.exit(FAILED)
