"""The one error that a user can cause, and its kind that is nobody's fault: a shortage of the system's."""

from os import PathLike

_CONTROLS = {code: f"\\x{code:02x}" for code in (*range(32), *range(127, 160)) if chr(code) not in "\t\n"}
_CONTROLS |= {code: f"\\u{code:04x}" for code in (*range(0x202A, 0x202F), *range(0x2066, 0x206A))}
"""What would change the colours, the title or the order of letters of a terminal, as escapes."""
_LONGEST = 1000  # letters of a problem or remedy; a damaged file may quote itself without end


class DnnvssError(Exception):
    """A mistake in the input, said so that it can be mended.

    The message reads ``FILE: utterance ID: problem. Remedy.``; parts that do not apply are left out. What steers a
    terminal is escaped in it: names and values may be those of a foreign file.

    Args:
        problem: what is wrong, with the offending value.
        file: the file in which it was found.
        utterance: the id of the utterance.
        remedy: what the user can do about it.
    """

    def __init__(
        self,
        problem: str,
        *,
        file: str | PathLike[str] | None = None,
        utterance: str | None = None,
        remedy: str | None = None,
    ) -> None:
        problem = _short(problem)
        remedy = None if remedy is None else _short(remedy)
        self.problem, self.file, self.utterance, self.remedy = problem, file, utterance, remedy
        where = [str(file)] if file is not None else []
        where += [f"utterance {utterance}"] if utterance is not None else []
        message = ": ".join([*where, problem])
        message = f"{_ended(message)} {_ended(remedy)}" if remedy else message
        super().__init__(message.translate(_CONTROLS))

    def __reduce__(self) -> tuple:
        """Keep the parts when a worker process hands the error back."""
        return _rebuild, (type(self), self.problem, self.file, self.utterance, self.remedy)


class ShortageError(DnnvssError):
    """The system had too little of something: memory, handles, processes. It says nothing about what was read.

    Nothing may be left out, remembered or refused because of it.
    """


def _short(text: str) -> str:
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}..."


def _ended(sentence: str) -> str:
    return sentence if sentence.endswith(("?", "...")) else f"{sentence.rstrip('.')}."


def _rebuild(kind: type[DnnvssError], problem: str, file: str, utterance: str, remedy: str) -> DnnvssError:
    return kind(problem, file=file, utterance=utterance, remedy=remedy)
