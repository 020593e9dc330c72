"""Files that the studio shows as they were written: pages, tables and films of runs and corpora."""

from collections.abc import Sequence
from fnmatch import fnmatchcase
from functools import cache
from pathlib import Path

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.pages import only
from dnnvss.studio.page import Asked, Document, Page, Route


@cache
def policy() -> str:
    """What a page out of a folder may do: styles and pictures of its own, films beside it, and the report's script.

    A script that somebody else wrote into it does not run, nor does one of another version of this package.
    """
    from dnnvss.evaluation.page import script

    return ("default-src 'none'; style-src 'unsafe-inline'; img-src 'self' data:; media-src 'self'; "
            f"{only(script())}; base-uri 'none'; form-action 'none'; frame-ancestors 'self'; "
            "sandbox allow-scripts allow-same-origin")


def documents(folder: Path, allowed: Sequence[str]) -> Page:
    """A page that is the files of a folder, those whose names are allowed.

    Args:
        folder: whose files they are.
        allowed: patterns such as ``videos/*.mp4``, at most one folder deep.
    """
    def answer(asked: Asked) -> Path | Document:
        return document(folder, "/".join(asked.names.values()), allowed)

    return Page("", (Route("GET", "/{file}", answer), Route("GET", "/{folder}/{file}", answer)))


def document(folder: Path, name: str, allowed: Sequence[str]) -> Path | Document:
    """A file to answer with.

    Raises:
        DnnvssError: it is none of those that are allowed, leads out of the folder, or is not there.
    """
    if not any(fnmatchcase(name, each) and name.count("/") == each.count("/") for each in allowed):
        raise DnnvssError("there is no such page", remedy="Load the list again")
    path = files.inside(folder, name)
    if path.is_symlink() or not path.is_file():
        raise DnnvssError("it is not there any more", remedy="Load the list again")
    return Document(path, policy()) if path.suffix == ".html" else path


def there(folder: Path, names: Sequence[str]) -> list[str]:
    """Those of some files that a folder has."""
    return [name for name in names if (folder / name).is_file() and not (folder / name).is_symlink()]
