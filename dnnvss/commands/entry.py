"""What all commands share: a mistake of the user ends in one clear line, not in a traceback."""

import functools
import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.runs.bundle import is_bundle

if TYPE_CHECKING:
    from omegaconf import DictConfig

_TEXTS = ("text", "wav", "alignment", "out", "run", "import_keys", "export_keys", "export_alignment", "export_curves",
          "into",
          "render", "overrides")
"""Settings whose values are text or paths."""


def command(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return ``function`` with :class:`DnnvssError` and Ctrl-C turned into a message and an exit status (1 and 130)."""

    @functools.wraps(function)
    def wrapped(*args: Any, **kwargs: Any) -> Any:
        try:
            return function(*args, **kwargs)
        except DnnvssError as error:
            print(f"error: {error}", file=sys.stderr)
            sys.exit(1)
        except OSError as error:
            if (remedy := files.remedy_for(error)) is None:
                raise
            print(f"error: {error.filename or 'the disk'}: {error.strerror}. {remedy}.", file=sys.stderr)
            sys.exit(1)
        except KeyboardInterrupt:
            print("interrupted: what was finished is kept; the same command goes on from there", file=sys.stderr)
            sys.exit(130)

    return wrapped


def helped(conf: Path, name: str, arguments: list[str]) -> bool:
    """Print the settings of a command with what they mean, if its arguments ask for help, and return whether they did.

    The settings and their comments are ``<name>.yaml``; groups are folders beside it. ``--hydra-help`` tells of hydra's
    own options.
    """
    if not {"-h", "--help"} & set(arguments):
        return False
    text = (conf / f"{name}.yaml").read_text(encoding="utf-8")
    print(text[: text.index("\nhydra:")] if "\nhydra:" in text else text)
    for group in sorted(set(re.findall(r"^  - (\w+):", text, re.MULTILINE)) & {p.name for p in conf.iterdir()}):
        print(f"# {group}=... one of: {', '.join(sorted(p.stem for p in (conf / group).glob('*.yaml')))}")
    print("# conf/GROUP/NAME.yaml says what the settings of a group mean; give one as GROUP.SETTING=VALUE.\n"
          "# --cfg job prints all settings with their values, --hydra-help hydra's own options.")
    return True


def quoted(arguments: list[str], keys: tuple[str, ...] = _TEXTS) -> list[str]:
    """Return command-line arguments in which the values of ``keys`` are quoted for hydra.

    Hydra gives commas, colons, braces and quotes a meaning of their own, OmegaConf gives one to ``${``; in a sentence
    or a path they are just text.
    """

    def quote(argument: str) -> str:
        key, equals, value = argument.partition("=")
        if key not in keys or not equals or value == "null":
            return argument
        plain = re.sub(r"(\\*)\$\{", r"\1\1\\${", value)
        escaped = re.sub(r"(\\*)('|$)", lambda m: m[1] * 2 + (m[2] and "\\'"), plain)
        return f"{key}='{escaped}'"

    return [quote(argument) for argument in arguments]


def grouped(arguments: list[str]) -> list[str]:
    """Return command-line arguments in which ``+experiment=X`` means ``experiment=X``, and ``+debug=X`` likewise.

    Both groups are in the defaults, empty; hydra would refuse the plus, which its manual recommends for such groups.
    """
    return [a[1:] if a.startswith(("+experiment=", "+debug=")) else a for a in arguments]


@command
def bundle_settings(conf: Path, arguments: list[str]) -> "DictConfig | None":
    """Return the settings of ``synth.py`` where its arguments name a bundle, None where they do not.

    A bundle starts without hydra; see :mod:`dnnvss.runs.bundle`.
    """
    named = [a.removeprefix("run=") for a in arguments if a.startswith("run=")]
    if not named or not is_bundle(Path(named[-1])):
        return None
    from dnnvss.commands.compose import compose

    return compose(conf, "synth", arguments, _TEXTS)
