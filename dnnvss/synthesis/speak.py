"""From text, a voice or an alignment to a rendered talking face."""

import json
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from omegaconf import DictConfig, OmegaConf

from dnnvss import files
from dnnvss.corpus import Corpus, Utterance
from dnnvss.curves import resample
from dnnvss.errors import DnnvssError
from dnnvss.formats import read_alignment, spanning, write_alignment
from dnnvss.media import Sound, read_audio, write_wav
from dnnvss.phones import SILENCES, nearest
from dnnvss.runs.naming import newest
from dnnvss.runs.run import Run
from dnnvss.runs.voice import Voice
from dnnvss.style import read_keys, sample_keys, write_keys
from dnnvss.style.generator import functionals, make_style
from dnnvss.synthesis.checks import beside, check_request
from dnnvss.synthesis.risks import find_risks, summary, word_risks
from dnnvss.systems import Example
from dnnvss.timing import Alignment, FrameClock
from dnnvss.visemes import TIER

if TYPE_CHECKING:
    from dnnvss.speech.durations import Expected
    from dnnvss.synthesis.stage import Stage
    from dnnvss.text.sentence import Sentence

_ALIGNER_RATE, _SOUND_RATE = 16000, 48000


@dataclass(frozen=True)
class Plan:
    """What is said, when, and the sound of it.

    Args:
        text: the words.
        alignment: tiers ``phones`` and ``words``.
        samples: mono sound in [-1, 1], or None.
        rate: samples a second.
        notes: what the user should know: sources of pronunciations, engine, replaced phones.
    """

    text: str
    alignment: Alignment
    samples: np.ndarray | None = None
    rate: int = _SOUND_RATE
    notes: dict[str, Any] = field(default_factory=dict)


def synthesise(config: DictConfig) -> None:
    """Write the video that ``config`` asks for, and its trajectory, alignment, plot and report beside it."""
    from dnnvss.synthesis.stage import open_stage, read_request

    check_request(config)
    folder = Path(config.run) if config.run else newest(Path(config.runs))
    print(f"run: {folder}")
    run = Run.open(folder)
    voice = run.voice
    request = read_request(config, run)
    plan = make_plan(config, run, voice)
    alignment, replaced = replace_unseen(plan.alignment, voice.phones, voice.pauses)
    for phone, other in replaced.items():
        print(f"the talker never spoke {phone}: {other} stands in for it")
    sound = None if plan.samples is None else Sound(plan.samples, plan.rate)
    example = run.example(Utterance("synthesis", plan.text, alignment), sound)
    if run.units:
        whence = "given with the alignment" if TIER in alignment else "predicted from text"
        print(f"dynamic visemes: {whence}")
        visemes = plan.alignment.with_tier(example.alignment[TIER])
        plan = replace(plan, alignment=visemes, notes={**plan.notes, "visemes": whence})
    trajectory = generate(config, run, example, plan)
    spans = find_risks(plan.alignment, run.task.clock, replaced, voice.triphones, word_risks(
        plan.notes.get("pronunciation", ()), plan.notes.get("alignment_scores", ())))
    print(summary(spans, len(trajectory)))
    risks = {"frames": len(trajectory), "rate": str(run.task.clock.rate), "spans": [s.to_json() for s in spans]}
    exported = [_export_keys(config, run, trajectory, plan)] if config.export_keys else []
    if config.export_alignment:
        exported.append(export_alignment(Path(config.export_alignment), plan))
    trajectory = ahead(trajectory, run.task.clock, config.anticipation / 1000)
    stage = open_stage(config, run, request, voice.rate, len(trajectory) / float(run.task.clock.rate))
    style = OmegaConf.to_container(config.style, resolve=True)
    notes = {"run": str(run.folder), "text": plan.text, **plan.notes, "replaced_phones": replaced, "risks": risks,
             "style": style, "keys": config.import_keys, "model": run.model.report(example), "credit": voice.credit,
             **stage.notes}
    if config.export_curves:
        frames = resample(trajectory, run.task.clock, stage.clock)
        exported.append(_export_curves(config, run, frames, stage.clock))
    written = write_outputs(stage, Path(config.out), trajectory, plan, notes) + exported
    print("wrote " + ", ".join(str(p) for p in written))


def make_plan(config: DictConfig, run: Run, voice: Voice) -> Plan:
    """Return what to say: from an alignment file, the user's voice, or text alone.

    Raises:
        DnnvssError: none of them is given, or one cannot be used.
    """
    if config.alignment:
        return _from_alignment(config, voice)
    if not config.text or not str(config.text).strip():
        raise DnnvssError("nothing to say: text is empty", remedy='Give text="...", or alignment=FILE')
    return _from_voice(config, voice) if config.wav else _from_text(config, run, voice)


def _parsed(config: DictConfig, voice: Voice, text: str | None = None) -> "Sentence":
    from dnnvss.text.overrides import read_overrides
    from dnnvss.text.sentence import parse

    overrides = read_overrides(config.overrides) if config.overrides else None
    return parse(text or str(config.text), variant=voice.variant, overrides=overrides)


def _from_alignment(config: DictConfig, voice: Voice) -> Plan:
    alignment = _with_words(read_alignment(config.alignment), config, voice)
    text = str(config.text) if config.text else " ".join(w for w in alignment["words"].labels if w)
    if config.wav:
        samples = read_audio(config.wav, _SOUND_RATE)
        try:
            alignment = spanning(alignment, len(samples) / _SOUND_RATE)
        except DnnvssError as error:
            raise DnnvssError(error.problem, file=config.alignment, remedy=error.remedy) from error
        return Plan(text, alignment, samples, notes={"engine": "the given recording"})
    return _spoken(config, voice, Plan(text, alignment), None)


def _with_words(alignment: Alignment, config: DictConfig, voice: Voice) -> Alignment:
    """Return an alignment that has the tier ``words``: its own, or the words of ``text`` laid over its phones."""
    names = [tier.name for tier in alignment.tiers]
    if "phones" not in names:
        raise DnnvssError(f"has no tier 'phones' (it has {', '.join(names)})", file=config.alignment,
                          remedy='Give phone times; or a recording: wav=FILE text="..."')
    if "words" in names:
        return alignment
    if not config.text:
        raise DnnvssError("has phones and no tier 'words'", file=config.alignment, remedy='Add text="..."')
    from dnnvss.speech.align_words import words_over

    words = [(w.spoken, w.choices(voice.variant)) for w in _parsed(config, voice).words]
    return alignment.with_tier(words_over(alignment["phones"], words))


def _from_voice(config: DictConfig, voice: Voice) -> Plan:
    from dnnvss.speech.align import align

    sentence = _parsed(config, voice)
    words = [(w.spoken, w.choices(voice.variant)) for w in sentence.words]
    aligned = align(read_audio(config.wav, _ALIGNER_RATE), words)
    notes = {"engine": "the given recording", "pronunciation": sentence.report(), "alignment_scores": aligned.scores}
    return Plan(sentence.text, aligned.alignment, read_audio(config.wav, _SOUND_RATE), notes=notes)


def _from_text(config: DictConfig, run: Run, voice: Voice) -> Plan:
    sentence = _parsed(config, voice)
    alignment = run.durations.predict(sentence, rate=config.speed, total=config.total, lead_in=config.lead_in / 1000,
                                      lead_out=config.lead_out / 1000, expected=_expected(config, run))
    plan = Plan(sentence.text, alignment, notes={"pronunciation": sentence.report()})
    return _spoken(config, voice, plan, sentence)


def _expected(config: DictConfig, run: Run) -> "Expected | None":
    if config.durations not in ("corpus", "model"):
        raise DnnvssError(f"unknown durations={config.durations!r}", remedy="Use durations=corpus or durations=model")
    return model_durations(run) if config.durations == "model" else None


def model_durations(run: Run) -> "Expected":
    """Return what tells how long phones last by the run's own model, whatever the times of an alignment are.

    Raises:
        DnnvssError: when asked, if the model has learnt no durations.
    """
    def seconds(alignment: Alignment, text: str) -> np.ndarray:
        frames = run.model.phone_durations(run.example(Utterance("synthesis", text, alignment)))
        if frames is None:
            raise DnnvssError(f"{run.settings.model_name} has learnt no durations", file=run.folder,
                              remedy="Use durations=corpus, or a run of model=hsmm")
        spoken = [label not in SILENCES for label in alignment["phones"].labels]
        return frames[spoken] / float(run.task.clock.rate)

    return seconds


def _spoken(config: DictConfig, voice: Voice, plan: Plan, sentence: "Sentence | None") -> Plan:
    if config.speech.engine == "none":
        return plan
    from dnnvss.speech.engines import find_engine, with_silences

    if sentence is None:
        sentence = _parsed(config, voice, plan.text)
    timed = bool(config.alignment or config.total or config.speed != 1 or config.durations == "model")
    engine = find_engine(config.speech.engine, imposing=timed, voice=config.speech.get("voice"))
    speech = engine.speak(sentence, plan.alignment)
    if not engine.imposes:
        speech = with_silences(speech, config.lead_in / 1000 + sentence.pause_before,
                               config.lead_out / 1000 + sentence.pause_after)
    print(f"speech: {engine.name}")
    alignment = speech.alignment.with_tier(plan.alignment[TIER]) if TIER in plan.alignment else speech.alignment
    return Plan(plan.text, alignment, speech.samples, speech.rate, {**plan.notes, "engine": engine.name})


def replace_unseen(alignment: Alignment, known: Sequence[str],
                   pauses: Sequence[str] = SILENCES) -> tuple[Alignment, dict[str, str]]:
    """Return the alignment in phones that the talker spoke, and which phone stands in for which.

    A kind of pause that the talker never made becomes one that was made, silently: it looks the same.
    """
    tier = alignment["phones"]
    unseen = sorted(set(tier.labels) - set(known) - set(SILENCES))
    replaced = {phone: nearest(phone, known)[0][0] for phone in unseen}
    paused = {p: pauses[0] for p in SILENCES if pauses and p not in pauses}
    return alignment.with_tier(tier.renamed(replaced.get(p, paused.get(p, p)) for p in tier.labels)), replaced


def generate(config: DictConfig, run: Run, example: Example, plan: Plan) -> np.ndarray:
    """Return the trajectory (T, D) on the run's clock, in the style and with the keys that ``config`` asks for."""
    style = make_style(OmegaConf.to_container(config.style, resolve=True), run.face)  # type: ignore[arg-type]
    for setting, reason in run.generator.talker.unknown.items():
        if getattr(style, setting):
            print(f"{reason}: style.{setting} has no effect")
    keys = read_keys(config.import_keys) if config.import_keys else []
    held = functionals(run.face)
    return run.generator(example, style, keys, held, plan.alignment["phones"])


def export_alignment(path: Path, plan: Plan) -> Path:
    """Write the times in the format of the suffix, HTS full-context labels for ``.full.lab``; return the path.

    Raises:
        DnnvssError: an unknown suffix.
    """
    from dnnvss.text.full_context import write_full_context

    if path.name.lower().endswith(".full.lab"):
        return write_full_context(path, plan.alignment, plan.text)
    return write_alignment(path, plan.alignment)


def ahead(trajectory: np.ndarray, clock: FrameClock, seconds: float) -> np.ndarray:
    """Return the trajectory (T, D) moved ahead by ``seconds``, to the nearest frame; its ends are held."""
    frames = np.arange(len(trajectory)) + round(seconds * float(clock.rate))
    return trajectory[np.clip(frames, 0, len(trajectory) - 1)]


def _export_keys(config: DictConfig, run: Run, trajectory: np.ndarray, plan: Plan) -> Path:
    known = functionals(run.face)
    if unknown := [name for name in config.key_names if name not in known]:
        raise DnnvssError(f"key_names: nothing is named {unknown[0]!r}", remedy=f"Use some of: {', '.join(known)}")
    held = {name: known[name] for name in config.key_names}
    keys = sample_keys(trajectory, run.task.clock, held, plan.alignment["phones"], config.key_positions)
    return write_keys(config.export_keys, keys)


def _export_curves(config: DictConfig, run: Run, frames: np.ndarray, clock: FrameClock) -> Path:
    """Write the lips' measures and the coefficients of pictures whose parameters are ``frames`` (F, D)."""
    from dnnvss.export.curves import write_curves

    known = functionals(run.face)
    return write_curves(Path(config.export_curves), {name: f(frames) for name, f in known.items()}, clock)


def write_outputs(stage: "Stage", out: Path, trajectory: np.ndarray, plan: Plan, notes: dict[str, Any]) -> list[Path]:
    """Write video, trajectory, alignment, plot and report; return their paths, the video first."""
    from tqdm import tqdm

    from dnnvss.media import write_video
    from dnnvss.render.plots import plot_trajectories

    run = stage.run
    clock = run.task.clock
    columns = np.array(run.face.names)
    written = [out, *beside(out)]
    files.write_arrays(written[1], parameters=trajectory.astype(np.float32), rate=float(clock.rate), columns=columns,
                       points=stage.pictures.points_in_image(trajectory).astype(np.float32))
    write_alignment(written[2], plan.alignment)
    files.write_json(written[4], json.loads(json.dumps(notes, default=str)))
    frames = tqdm(stage.frames(resample(trajectory, clock, stage.clock)), "rendering", unit=" frames", leave=False)
    write_video(out, frames, stage.clock.rate, plan.samples, plan.rate)
    series = {f"coefficient {d + 1}": trajectory[:, d] for d in range(min(5, trajectory.shape[1]))}
    plot_trajectories(written[3], series, clock.rate, plan.alignment["phones"], plan.text)  # last: it loads matplotlib
    if plan.samples is not None:
        written.append(write_wav(out.with_suffix(".wav"), plan.samples, plan.rate))
    return written


def render_utterance(run: Run, corpus: Corpus, utterance: Utterance, out: Path) -> None:
    """Write a video of an utterance of the corpus in the run's style, predicted from the recording's phone times."""
    from dnnvss.synthesis.stage import neutral_stage

    samples = read_audio(corpus.path(utterance, "audio"), _SOUND_RATE) if utterance.audio else None
    plan = Plan(utterance.text, utterance.alignment, samples, _SOUND_RATE)
    notes = {"run": str(run.folder), "utterance": utterance.id, "text": utterance.text, "credit": corpus.info.credit}
    style = make_style(run.settings.style, run.face)
    trajectory = run.generator(run.recorded(corpus, utterance), style)
    write_outputs(neutral_stage(run, utterance.clock), out, trajectory, plan, notes)
