"""What a viewing test is: what is shown, how it is asked, and who sees what."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

from dnnvss.errors import DnnvssError
from dnnvss.settings import setting

KINDS = ("preference", "dscqs", "single", "turing", "intelligibility")
RUN, ANCHORS = "run", ("recording", "through", "random", "frozen")
"""What a condition shows: a run, the recording, what was measured in it as the face shows that, the movement of
another sentence, a face that stands still."""
SOUNDS = ("recording", "engine", "silent")
_LONG = 4000


@dataclass(frozen=True)
class Condition:
    """One of the things that are compared.

    Args:
        name: in tables; viewers never see it.
        shows: a run, or one of :data:`ANCHORS`.
        run: which of the runs given, counted from 1; of an anchor, whose face shows it.
        style: of the movement: ``plain`` or ``own``, the style that the run was trained with.
        dials: settings of the style that differ, such as ``{articulation: 1.4}``.
        smooth: hertz above which movement is taken out by a smoothing spline (Theobald et al. 2003, section 6.1).
        sound: that of the design where None.

    Raises:
        DnnvssError: a setting that changes nothing of what it shows.
    """

    name: str
    shows: str = setting(RUN, choices=(RUN, *ANCHORS))
    run: int = setting(1, least=1)
    style: str = setting("plain", choices=("plain", "own"))
    dials: Mapping[str, Any] = setting({})
    smooth: float | None = setting(None, above=0)
    sound: str | None = setting(None, choices=SOUNDS)

    def __post_init__(self) -> None:
        idle = {"dials": self.shows != RUN and bool(self.dials), "style": self.shows != RUN and self.style != "plain",
                "smooth": self.shows in ("recording", "frozen") and self.smooth is not None}
        if found := [name for name, given in idle.items() if given]:
            raise DnnvssError(f"{found[0]} changes nothing of the condition {self.name}, which shows {self.shows}",
                              remedy=f"Leave {found[0]} out")

    @property
    def recorded(self) -> bool:
        """Whether it follows the times of a recording, and so has no other sound."""
        return self.shows in ("recording", "through", "random")


@dataclass(frozen=True)
class Question:
    """Something to ask about the viewer, with the answers to choose from; none for free text."""

    text: str
    choices: tuple[str, ...] = ()


@dataclass(frozen=True)
class Design:
    """A file of ``conf/viewing``; what each setting means is said in ``docs/viewing.md``.

    Raises:
        DnnvssError: settings that contradict each other.
    """

    kind: str = setting(choices=KINDS)
    title: str = setting()
    instructions: tuple[str, ...] = setting()
    consent: tuple[str, ...] = setting()
    question: str = setting()
    labels: tuple[str, ...] = ()
    conditions: tuple[Condition, ...] = ()
    anchors: tuple[str, ...] = setting((), choices=ANCHORS)
    style: str = setting("plain", choices=("plain", "own"))
    reference: str | None = None
    material: str = setting("sentences", choices=("sentences", "words"))
    monosyllables: bool = True
    sentences: int = setting(20, least=1, most=1000)
    per_viewer: int = setting(20, least=1, most=500)
    each: str = setting("once", choices=("once", "every"))
    tie: bool = False
    alternatives: int = setting(0, least=0, most=12)
    sound: str = setting("recording", choices=SOUNDS)
    engine: str = "auto"
    noise: float | None = setting(None, least=-40, most=60)
    practice: int = setting(2, least=0, most=10)
    checks: int = setting(2, least=0, most=10)
    rest: int = setting(15, least=0, most=500)
    replays: int = setting(0, least=0, most=100)
    phones: str = setting("refused", choices=("refused", "allowed"))
    screen: bool = True
    headphones: bool = False
    questions: tuple[Question, ...] = ()
    scale: float = setting(1.0, least=0.1, most=8)
    quality: int = setting(18, least=0, most=40)
    seed: int = setting(0, least=0, most=2**31)

    def __post_init__(self) -> None:
        if self.per_viewer > self.sentences:
            raise DnnvssError(f"per_viewer={self.per_viewer} is more than sentences={self.sentences}",
                              remedy="Show a viewer as many sentences as there are at most")
        texts = (self.title, self.question, *self.instructions, *self.consent, *self.labels)
        if any(len(text) > _LONG for text in texts):
            raise DnnvssError(f"a text of the design is longer than {_LONG} letters", remedy="Say it in fewer words")
        buttons = {"preference": 2 + self.tie, "turing": 2}.get(self.kind, 0)
        if 0 < len(self.labels) < buttons:
            raise DnnvssError(f"labels has {len(self.labels)} texts, and there are {buttons} buttons",
                              remedy="Give a text for each, or none")
        if self.kind == "dscqs" and self.reference is None:
            raise DnnvssError("a dscqs test has no reference", remedy="Name one of its conditions: reference: through")
        if self.kind == "intelligibility" and self.material != "words":
            raise DnnvssError("an intelligibility test asks for words", remedy="Set material: words")
        if self.kind == "intelligibility" and self.alternatives == 1:
            raise DnnvssError("one alternative is no choice", remedy="Give 2 or more, or 0 for a word that is typed")
        if self.alternatives > self.sentences:
            raise DnnvssError(f"alternatives={self.alternatives} are more than the words, sentences={self.sentences}",
                              remedy="Ask for more words, or give fewer alternatives")

    @property
    def pairs(self) -> bool:
        """Whether a trial shows two stimuli."""
        return self.kind in ("preference", "dscqs")

    @property
    def scored(self) -> bool:
        """Whether viewers move sliders."""
        return self.kind in ("dscqs", "single")


def conditions_of(design: Design, runs: Sequence[str]) -> tuple[Condition, ...]:
    """The conditions of a test: those that the design lists, else one a run, and the anchors.

    Args:
        design: of the test.
        runs: names of the runs given.

    Raises:
        DnnvssError: conditions of one name, one of a run that was not given, a run that none shows, too few of them,
            a sound that does not fit, or a reference that is none of them.
    """
    listed = design.conditions or tuple(Condition(name, run=k, style=design.style) for k, name in enumerate(runs, 1))
    found = (*listed, *(Condition(name, name) for name in design.anchors if name not in [c.name for c in listed]))
    if len({c.name for c in found}) < len(found) or not all(c.name.strip() for c in found):
        raise DnnvssError("two conditions have one name, or one has none", remedy="Name each condition otherwise")
    for c in found:
        if c.run > len(runs):
            raise DnnvssError(f"the condition {c.name} shows run {c.run}, and {len(runs)} were given",
                              remedy="Name that many run folders")
        if c.recorded and sound_of(design, c) == "engine":
            raise DnnvssError(f"the condition {c.name} moves as the recording does and cannot have an engine's voice",
                              remedy="Give it sound: recording, or leave it out")
    if idle := [name for k, name in enumerate(runs, 1) if k not in {c.run for c in found}]:
        raise DnnvssError(f"the run {idle[0]} is shown by no condition", remedy="Leave it out, or list conditions "
                          "of your own in the design: {name: mine, run: 1}")
    if len(found) < (2 if design.pairs else 1):
        raise DnnvssError(f"a {design.kind} test compares two conditions at least, and there is {len(found)}",
                          remedy="Name more runs, or add anchors such as anchors: [through]")
    if design.kind == "preference" and len({sound_of(design, c) for c in found}) > 1:
        raise DnnvssError("conditions that are seen side by side have one sound", remedy="Leave sound: out of them")
    if design.reference is not None and design.reference not in [c.name for c in found]:
        raise DnnvssError(f"the reference {design.reference} is no condition",
                          remedy=f"Use one of {', '.join(c.name for c in found)}")
    return found


def sound_of(design: Design, condition: Condition) -> str:
    """What is heard with a condition."""
    return condition.sound or design.sound


def treatments(design: Design, conditions: Sequence[Condition]) -> list[tuple[int, ...]]:
    """What may be shown of a sentence: conditions from left to right (or first and second), each way round.

    Every way of a pair stands before any way back, so that neighbours in a Latin square differ in the pair.
    """
    numbers = range(len(conditions))
    if design.kind == "preference":
        ways = list(combinations(numbers, 2))
    elif design.kind == "dscqs":
        reference = [c.name for c in conditions].index(str(design.reference))
        ways = [(reference, k) for k in numbers if k != reference]
    else:
        return [(k,) for k in numbers]
    return [*ways, *((b, a) for a, b in ways)]
