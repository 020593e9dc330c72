"""The one parser of flags: argparse, with our words for mistakes."""

import argparse
import difflib
import re
import shlex
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NoReturn

from dnnvss.commands.usage import UsageError
from dnnvss.errors import DnnvssError
from dnnvss.settings import at_home


class Flags(argparse.ArgumentParser):
    """A parser of the options of ``dnnvss COMMAND``, whose mistakes are :class:`UsageError`.

    Its description may be a module's docstring: a terminal shows it without the marks of code.
    """

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        kwargs.setdefault("formatter_class", argparse.RawDescriptionHelpFormatter)
        kwargs["description"] = (kwargs.get("description") or "").replace("``", "")
        super().__init__(*args, **kwargs)

    def read(self, arguments: Sequence[str]) -> argparse.Namespace:
        """The options that arguments give; what is left over is a mistake."""
        for word in arguments:
            if "=" in word and not word.startswith("-") and not Path(word).exists():
                self._refuse_setting(word)
        options, left = self.parse_known_args(arguments)
        if left:
            raise self._left_over(left)
        for name, value in vars(options).items():
            if isinstance(value, Path):
                setattr(options, name, at_home(value))
            elif isinstance(value, list):
                setattr(options, name, [at_home(each) if isinstance(each, Path) else each for each in value])
        return options

    def commands(self) -> Callable[[str, Callable[[argparse.Namespace], None], str], "Flags"]:
        """What adds a command below this one: its name, what it does with the options (``work``), and its help."""
        below = self.add_subparsers(required=True, metavar="COMMAND")

        def add(name: str, work: Callable[[argparse.Namespace], None], text: str) -> Flags:
            added: Flags = below.add_parser(name, help=text, description=text)
            added.set_defaults(work=work)
            return added

        return add

    def error(self, message: str) -> NoReturn:
        """Refuse a command line in one line."""
        raise UsageError(_reworded(message), remedy=f"{self.prog} --help lists the options")

    def _refuse_setting(self, word: str) -> None:
        """Refuse ``name=value`` where ``--name value`` is meant."""
        name, _, value = word.partition("=")
        option = f"--{name.replace('_', '-')}"
        if option in (known for action in _actions(self) for known in action.option_strings):
            raise UsageError(f"{word} is no option of {self.prog}",
                             remedy=f"Did you mean {option} {shlex.quote(value)}?")

    def _left_over(self, left: list[str]) -> UsageError:
        word = left[0]
        name, equals, value = word.partition("=")
        known = [option for action in _actions(self) for option in action.option_strings]
        near = difflib.get_close_matches(name if name.startswith("-") else f"--{name}", known, 1, 0.7)
        problem = f"{word} is no option of {self.prog}" if word.startswith("-") else f"{word} is one word too many"
        if not near or not (word.startswith("-") or equals):
            return UsageError(problem, remedy=f"{self.prog} --help lists the options")
        meant = f"{near[0]} {shlex.quote(value)}" if equals and value else near[0]
        return UsageError(problem, remedy=f"Did you mean {meant}?")


def whole(least: int | None = None, most: int | None = None, nonzero: bool = False) -> Callable[[str], int]:
    """A type of option: a whole number in a range, 0 left out where ``nonzero``."""

    def parse(text: str) -> int:
        try:
            value = int(text)
        except ValueError as error:
            raise argparse.ArgumentTypeError(f"={text} is no whole number") from error
        if (least is not None and value < least) or (most is not None and value > most):
            span = f"{least} to {most}" if most is not None else f"{least} or more"
            raise argparse.ArgumentTypeError(f"={text} is out of range: {span}")
        if nonzero and value == 0:
            raise argparse.ArgumentTypeError("=0 means nothing")
        return value

    return parse


def number(least: float, most: float, above: bool = False) -> Callable[[str], float]:
    """A type of option: a number in a range, ``least`` itself left out where ``above``."""

    def parse(text: str) -> float:
        try:
            value = float(text)
        except ValueError as error:
            raise argparse.ArgumentTypeError(f"={text} is no number") from error
        if not least <= value <= most or (above and value == least):
            span = f"above {least:g}, at most {most:g}" if above else f"{least:g} to {most:g}"
            raise argparse.ArgumentTypeError(f"={text} is out of range: {span}")
        return value

    return parse


def given_as(kind: Callable[[str], Any]) -> Callable[[str], Any]:
    """A type of option: what ``kind`` makes of the text, its complaint in our words."""

    def parse(text: str) -> Any:
        try:
            return kind(text)
        except DnnvssError as error:
            raise argparse.ArgumentTypeError(f"={text}: {error.problem}") from error

    return parse


def _actions(parser: argparse.ArgumentParser) -> list[argparse.Action]:
    """The options of a parser and of the commands below it."""
    found = list(parser._actions)
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            found += [inner for below in action.choices.values() for inner in _actions(below)]
    return found


def _reworded(message: str) -> str:
    if match := re.match(r"the following arguments are required: (.*)", message):
        return f"{match[1]} is missing"
    if match := re.match(r"argument (\S+?)(?:/\S+)?: =(.*)", message, re.DOTALL):
        return f"{match[1]}={match[2]}"
    if match := re.match(r"argument (.+?): invalid choice: (.*) \(choose from (.*)\)", message, re.DOTALL):
        return f"{match[1]}: {match[2]} is unknown; there are {match[3]}"
    if match := re.match(r"argument (.+?): (.*)", message, re.DOTALL):
        return f"{match[1]}: {match[2]}"
    return message
