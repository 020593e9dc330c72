"""From a request to what a face does: a pure function, which reads, prints and writes nothing."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from typing import Any

import numpy as np

from dnnvss.corpus import Utterance
from dnnvss.curves import resample
from dnnvss.errors import DnnvssError
from dnnvss.face.base import Gauge, Textured
from dnnvss.life import Moves, draw_moves, speech_contexts
from dnnvss.phones import SILENCES, nearest
from dnnvss.phones.contexts import spoken_triphones
from dnnvss.runs.run import Run
from dnnvss.style import Key, sample_keys
from dnnvss.style.generator import all_gauges
from dnnvss.style.plain import plain_gauges
from dnnvss.synthesis.plan import Plan, make_plan
from dnnvss.synthesis.request import SpeakRequest
from dnnvss.synthesis.risks import Span, find_risks, key_risks, sound_risks, summary, unfamiliar, word_risks
from dnnvss.synthesis.stage import Stage, open_stage
from dnnvss.systems import Example
from dnnvss.timing import Alignment, FrameClock, Tier
from dnnvss.visemes import TIER

OF_PHONES = ("closures", "contacts", "rest")
"""What a style does where phones are known, and leaves where they are not."""

PART = 4096
"""Frames whose points are worked out at once."""


@dataclass(frozen=True)
class Spoken:
    """What comes of a request. Pictures, curves and keys are made when they are asked for.

    Args:
        run: whose face speaks.
        request: what was asked.
        plan: what is said, when, and the sound of it.
        example: the utterance as the system saw it.
        stand_ins: phones that the talker never spoke, and which phone stands in for each.
        movement: parameters (T, D) on the run's clock, in step with the sound.
        risks: spans of frames that may be wrong, and why.
        report: how the system's prediction came about.
    """

    run: Run
    request: SpeakRequest
    plan: Plan
    example: Example
    stand_ins: Mapping[str, str]
    movement: np.ndarray
    risks: tuple[Span, ...]
    report: Mapping[str, Any]

    @property
    def clock(self) -> FrameClock:
        """The run's clock."""
        return self.run.task.clock

    @cached_property
    def trajectory(self) -> np.ndarray:
        """Parameters (T, D) on the run's clock, as far ahead of the sound as was asked."""
        return ahead(self.movement, self.clock, self.request.anticipation)

    @cached_property
    def face_phones(self) -> Tier | None:
        """The phones as the face forms them, as far ahead of the sound as was asked; None where only a voice is
        known."""
        heard = self.plan.phones
        return None if heard is None else heard.ahead(self.request.anticipation)

    @cached_property
    def stage(self) -> Stage:
        """Where the face is drawn."""
        seconds, life = len(self.movement) / float(self.clock.rate), self.request.style.life > 0
        made = open_stage(self.run, self.request.scene, seconds, life)
        return replace(made, phones=self.face_phones)

    @cached_property
    def shown(self) -> np.ndarray:
        """Parameters (F, D), a row for each picture of the video."""
        return resample(self.trajectory, self.clock, self.stage.clock)

    def points(self) -> Iterator[np.ndarray]:
        """Yield the points in pixels of the pictures, on the run's clock, some frames (F, P, 2) at a time."""
        part = max(len(self.trajectory), 1) if self.request.scene.footage else PART  # footage is spread over the whole
        for start in range(0, len(self.trajectory), part):
            yield self.stage.pictures.points_in_image(self.trajectory[start : start + part])

    @cached_property
    def moves(self) -> Moves | None:
        """How eyes and head move, a row for each picture of the video; None where they do not."""
        life, style = self.run.life, self.request.style
        if self.stage.living is None or life is None:
            return None
        clock, tiers = FrameClock(Fraction(life.tracks.rate).limit_denominator(1001)), self.plan.alignment
        frames = max(1, clock.edge(len(self.movement) / float(self.clock.rate)))
        context = speech_contexts(tiers, self.plan.text, clock, frames)
        moves = draw_moves(life, context, style.seed, self.plan.text, style.life)
        return moves.at(clock, self.stage.clock, len(self.shown))

    def frames(self, part: slice = slice(None), views: tuple[str, ...] | None = None) -> Iterator[np.ndarray]:
        """Yield the pictures of the video, uint8 RGB (H, W_, 3).

        Args:
            part: of the video, whose pictures are wanted.
            views: what is seen; what was asked for where None.

        Raises:
            DnnvssError: faces of this kind have no such view.
        """
        stage = replace(self.stage, views=views) if views else self.stage
        return stage.frames(self.shown[part], self.moves.part(part) if self.moves else None)

    def curves(self) -> dict[str, np.ndarray]:
        """The face's gauges and coefficients by name (F,), a value for each picture of the video."""
        return {name: gauge(self.shown) for name, gauge in all_gauges(self.run.face).items()}

    def keys(self, names: Sequence[str], positions: Sequence[float]) -> list[Key]:
        """Keys that describe the movement, to be edited and held in another request.

        Args:
            names: what is measured: gauges of the face, or coefficients.
            positions: where in each phone, as shares of its duration; where only a voice is known, in each tenth of a
                second.

        Raises:
            DnnvssError: a name of nothing.
        """
        held = named_gauges(self.run, names)
        return sample_keys(self.movement, self.clock, held, self.plan.phones, positions)

    @property
    def visemes(self) -> str | None:
        """Where the dynamic visemes come from, in words; None where the run has none."""
        if self.run.units is None:
            return None
        given = self.request.alignment is not None and TIER in self.request.alignment
        return "given with the alignment" if given else "predicted from text"

    @property
    def remarks(self) -> tuple[str, ...]:
        """What the user is to be told, a line each."""
        engine = self.plan.engine if self.plan.sound is not self.request.recording else None
        unknown = self.run.generator.talker.unknown.items()
        lines = [f"speech: {engine}"] if engine else []
        if not self.plan.phones and (asked := [n for n in OF_PHONES if getattr(self.request.style, n)]):
            lines += [f"a voice alone tells no phones: style.{name} has no effect" for name in asked]
        lines += [f"times are given: {name} has no effect" for name in self.request.idle]
        if self.request.style.life and self.run.life is None and isinstance(self.run.face, Textured):
            lines += ["the run did not learn how eyes and head move: style.life has no effect"]
        lines += [f"the talker never spoke {p}: {other} stands in for it" for p, other in self.stand_ins.items()]
        lines += [f"the talker never spoke {p}: it is borrowed from other talkers" for p in self._borrowed]
        lines += [f"dynamic visemes: {self.visemes}"] if self.visemes else []
        lines += [f"{why}: style.{name} has no effect" for name, why in unknown if getattr(self.request.style, name)]
        beyond = key_risks(self.request.keys, self.run.generator.talker.reach, self.run.face.names, self.plan.tier)
        lines += [f"the key {r['name']} at {time:g} s asks for {r['low']:g} to {r['high']:g}, and the talker showed "
                  f"{r['showed'][0]:g} to {r['showed'][1]:g}: it is obeyed" for time, r in beyond]
        if (share := self.unfamiliar) is not None:
            lines += [f"the talker never spoke {share:.0%} of these triphones, so that single ones are not marked"]
        return (*lines, summary(self.risks, len(self.movement)))

    @property
    def _borrowed(self) -> list[str]:
        """Phones of the utterance that other talkers spoke alone."""
        return [p for p in self.run.voice.borrowed if self.plan.phones and p in self.example.alignment["phones"].labels]

    @property
    def unfamiliar(self) -> float | None:
        """The share of triphones that the talker never spoke, where that is most of them."""
        if not self.plan.phones or not _reads_phones(self.run):
            return None
        return unfamiliar(self.plan.alignment, self.stand_ins, self.run.voice.triphones)


def speak(run: Run, request: SpeakRequest) -> Spoken:
    """What a run's face does to say what is asked.

    Raises:
        DnnvssError: a request that cannot be met; the message says why.
    """
    if request.by_recordings:
        from dnnvss.synthesis.recorded import check_recordings, with_recordings

        check_recordings(run, request)
    plan = make_plan(run, request)
    example, stand_ins = _seen(run, request, plan)
    if request.by_recordings:
        plan = with_recordings(run, plan, example)
        example, stand_ins = _seen(run, request, plan)
    if run.units:
        plan = replace(plan, alignment=plan.alignment.with_tier(example.alignment[TIER]))
    return _moved(run, request, plan, example, stand_ins)


def _seen(run: Run, request: SpeakRequest, plan: Plan) -> tuple[Example, dict[str, str]]:
    """The utterance as the system sees it, and the phones that others stand in for."""
    alignment, stand_ins = plan.alignment, dict[str, str]()
    if plan.phones:
        alignment, stand_ins = replace_unseen(alignment, run.voice.phones, run.voice.pauses)
    sound = plan.sound.heard if plan.sound else None
    told = stand_ins if _reads_phones(run) else {}
    return run.example(Utterance(request.id, plan.text, alignment), sound), told


def _reads_phones(run: Run) -> bool:
    """Whether phones tell the system anything; one that listens does not mind which it never heard."""
    return "phones" in run.needs


def speak_again(spoken: Spoken, request: SpeakRequest) -> Spoken:
    """The same words, times and sound in another style, with other keys, or shown otherwise.

    Args:
        spoken: what was said.
        request: the same in all that the times and the sound depend on.

    Raises:
        DnnvssError: a request that cannot be met; the message says why.
    """
    return _moved(spoken.run, request, spoken.plan, spoken.example, spoken.stand_ins)


def _moved(run: Run, request: SpeakRequest, plan: Plan, example: Example, stand_ins: Mapping[str, str]) -> Spoken:
    style = request.style if plan.phones else replace(request.style, closures=False, contacts=False, rest=False)
    generator = run.generator
    if plan.fragments:
        from dnnvss.systems.fragments import Fragments

        assert isinstance(run.model, Fragments)
        generator = replace(generator, model=run.model.playing(plan.fragments))
    movement = generator(example, style, request.keys, key_gauges(run), plan.tier)
    return Spoken(run, request, plan, example, stand_ins, movement, _risks(run, request, plan, example, stand_ins),
                  generator.model.report(example))


def _risks(run: Run, request: SpeakRequest, plan: Plan, example: Example, stand_ins: Mapping[str, str]
           ) -> tuple[Span, ...]:
    """What may be wrong with phones and words, where they are known, and with the sound, where it is listened to."""
    clock, spans = run.task.clock, list[Span]()
    if plan.phones:
        words = word_risks(plan.pronunciation, plan.scores)
        keys = key_risks(request.keys, run.generator.talker.reach, run.face.names, plan.tier)
        known = run.voice.triphones if _reads_phones(run) else spoken_triphones([plan.alignment])
        spans += find_risks(plan.alignment, clock, stand_ins, known, words, keys)
    if run.heard:
        spans += sound_risks(run.heard.strangeness(example.codes, clock), clock)
    return tuple(sorted(spans, key=lambda span: span[:2]))


def key_gauges(run: Run) -> dict[str, Gauge]:
    """What keys may hold, by name: gauges of the face, plain ones from 0 at rest to 1, and coefficients."""
    return {**plain_gauges(run.face, run.generator.talker), **all_gauges(run.face)}


def named_gauges(run: Run, names: Sequence[str]) -> dict[str, Gauge]:
    """What keys are to be measured by.

    Raises:
        DnnvssError: a name of nothing.
    """
    known = key_gauges(run)
    if unknown := [name for name in names if name not in known]:
        raise DnnvssError(f"key_names: nothing is named {unknown[0]!r}", remedy=f"Use some of: {', '.join(known)}")
    return {name: known[name] for name in names}


def replace_unseen(alignment: Alignment, known: Sequence[str],
                   pauses: Sequence[str] = SILENCES) -> tuple[Alignment, dict[str, str]]:
    """The alignment in phones that the talker spoke, and which phone stands in for which.

    A kind of pause that the talker never made becomes one that was made, silently: it looks the same.
    """
    tier = alignment["phones"]
    unseen = sorted(set(tier.labels) - set(known) - set(SILENCES))
    replaced = {phone: nearest(phone, known)[0][0] for phone in unseen}
    paused = {p: pauses[0] for p in SILENCES if pauses and p not in pauses}
    return alignment.with_tier(tier.renamed(replaced.get(p, paused.get(p, p)) for p in tier.labels)), replaced


def ahead(trajectory: np.ndarray, clock: FrameClock, seconds: float) -> np.ndarray:
    """The trajectory (T, D) moved ahead by ``seconds``, to the nearest frame; its ends are held."""
    if not round(seconds * float(clock.rate)):
        return trajectory
    frames = np.arange(len(trajectory)) + round(seconds * float(clock.rate))
    return trajectory[np.clip(frames, 0, len(trajectory) - 1)]
