"""Damaged files that commands left behind, and words of a command line: an answer or an error of ours.

The kinds are found by what the commands make; ``make fuzz`` tries many damages of each.
"""

import random
import traceback
import warnings

import pytest
from fuzz.damage import damaged
from fuzz.inputs_made import Made, all_made
from fuzz.test_fuzz import EXAMPLES, tried

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Made]:
    """Every kind of file, a right one."""
    return all_made(tmp_path_factory.mktemp("fuzz made"))


def test_damage_of_what_commands_made_ends_in_an_answer_or_an_error_of_ours(made: dict[str, Made]) -> None:
    found = {name: problem for name, kind in made.items() if (problem := _tried(name, kind))}
    assert not found, "\n\n".join(f"{name}: {problem}" for name, problem in found.items())


def _tried(name: str, kind: Made) -> str:
    """What is wrong with how damages of a kind end, nothing where nothing is."""
    right = kind.path.read_bytes()
    kind.read(kind.path)
    problems: dict[str, str] = {}
    rights = right if kind.path.read_bytes() == right else kind.path.read_bytes()
    for number in range(max(2, EXAMPLES // kind.share)):
        rng = random.Random(f"{name} {number}")
        kind.path.write_bytes(damaged(rights, rng))
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                tried(kind)
        except BaseException as error:
            said = traceback.format_exception(error)
            problems.setdefault("".join(said[-2:]), f"damage {number}: {''.join(said[-7:])}")
        finally:
            kind.path.parent.mkdir(parents=True, exist_ok=True)
            kind.path.write_bytes(rights)
    return "\n".join(list(problems.values())[:5])
