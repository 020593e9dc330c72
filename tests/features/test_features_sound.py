"""The sound as a feature source: alone, beside phones and visemes, joined, kept, on a device."""

import json
from pathlib import Path

import numpy as np
import pytest
import torch
from features.features_cases import frames_of

from dnnvss.acoustics import LogMel, analyse
from dnnvss.errors import DnnvssError
from dnnvss.features import (
    CodeStore,
    FeatureTable,
    FrameCodes,
    NumericScaler,
    Recording,
    Settings,
    encode,
    encode_recording,
    expand,
    phones_of,
)
from dnnvss.features.stream import FeatureStream
from dnnvss.media import Sound
from dnnvss.timing import Alignment, FrameClock, Tier

CLOCK = FrameClock(100)
SMALL = Settings(units=9, window_before=2, window_after=2, logmel=LogMel(bands=5), logmel_offsets=(-3, 2))
MEL = FeatureTable(("logmel", "logmel_window"), SMALL, "labels=mel")
MIXED = FeatureTable(("phone_span", "logmel_window", "centre_phone", "centre_viseme", "logmel", "viseme_frames"), SMALL)


def sound_of(seconds: float, seed: int = 0) -> Sound:
    swell = np.linspace(0.01, 0.3, round(seconds * 16000))
    return Sound(np.random.default_rng(seed).normal(0, 1, len(swell)) * swell, 16000)


def alignment_of(*ends: float, start: float = 0.0) -> Alignment:
    edges = [start, *ends]
    labels = ["sil", *["AA", "M", "IY"] * 3][: len(ends)]
    words = ["" if label == "sil" else f"w{i}" for i, label in enumerate(labels)]
    units = [str(i % 9) for i in range(len(ends))]
    return Alignment([Tier(name, zip(edges[:-1], edges[1:], tier, strict=True))
                      for name, tier in (("phones", labels), ("words", words), ("visemes", units))])


def utterances() -> list[tuple[str, FrameCodes, np.ndarray]]:
    """Ids, codes, and the energies (T, 5) of each frame."""
    made = []
    for n, ends in enumerate([(0.1, 0.24, 0.31), (0.05, 0.3), (0.2, 0.22, 0.4, 0.55)]):
        sound = sound_of(ends[-1], n)
        codes = encode(alignment_of(*ends), "", MIXED, CLOCK, sound)
        made.append((f"u{n}", codes, analyse(sound, SMALL.logmel, CLOCK, 0, round(100 * ends[-1]))))
    return made


def windowed(energies: np.ndarray) -> np.ndarray:
    """The columns of ``logmel_window`` (T, 10), frame by frame."""
    last = len(energies) - 1
    return np.stack([np.concatenate([energies[min(max(t + o, 0), last)] for o in (-3, 2)]) for t in range(last + 1)])


def test_columns_of_each_utterance_and_of_all_joined() -> None:
    parts = utterances()
    store = CodeStore.join([(name, codes) for name, codes, _ in parts])
    assert store.sources == ("phones", "visemes", "logmel")
    for name, codes, energies in parts:
        for dense in (expand(codes), expand(store, frames_of(store, name))):
            np.testing.assert_array_equal(dense[:, MIXED.slices["logmel"]], energies)
            np.testing.assert_array_equal(dense[:, MIXED.slices["logmel_window"]], windowed(energies))
            np.testing.assert_array_equal(dense, expand(codes))
    mixed = np.random.default_rng(0).integers(0, len(store), 200)
    np.testing.assert_array_equal(store.numeric(mixed), store.numeric(np.arange(len(store)))[mixed])


def test_the_table_says_what_it_reads() -> None:
    assert (MEL.sources, MEL.needs) == (("logmel",), {"sound"})
    assert (MEL.width, MEL.numeric_width, MEL.binary_width, MEL.active_width) == (15, 15, 0, 0)
    assert MIXED.sources == ("phones", "visemes", "logmel")
    assert MIXED.needs == {"phones", "words", "visemes", "sound"}
    assert FeatureTable(("centre_phone",)).needs == {"phones", "words"}
    assert MEL.columns[:6] == (*(f"logmel/mel0{k}" for k in range(1, 6)), "logmel_window/-3:mel01")
    again = FeatureTable.from_description(json.loads(json.dumps(MIXED.describe())))
    assert again == MIXED
    assert again.hash == MIXED.hash


def test_another_analysis_is_another_table() -> None:
    for other in (Settings(units=9, logmel=LogMel(bands=5, window=30), logmel_offsets=(-3, 2)),
                  Settings(units=9, logmel=LogMel(bands=5, floor=1e-6), logmel_offsets=(-3, 2)),
                  Settings(units=9, logmel=LogMel(bands=5), logmel_offsets=(-3, 3))):
        table = FeatureTable(MEL.names, other)
        assert table.hash != MEL.hash
        with pytest.raises(DnnvssError, match=r"block 'logmel(_window)?' means something else in the run"):
            table.check(MEL.describe())
    codes = utterances()[0][1]
    assert expand(codes.with_table(MEL)).shape == (31, 15)
    with pytest.raises(DnnvssError, match="its logmel were worked out with other settings"):
        codes.with_table(FeatureTable(MEL.names, Settings(logmel=LogMel(bands=5, window=30))))


def test_kept_on_disk_and_on_a_device(tmp_path: Path) -> None:
    store = CodeStore.join([(name, codes) for name, codes, _ in utterances()])
    opened = CodeStore.open(store.save(tmp_path / "codes"))
    assert opened.sources == store.sources
    assert opened.arrays["logmel"].dtype == np.float32
    np.testing.assert_array_equal(expand(opened), expand(store))
    np.testing.assert_array_equal(expand(CodeStore.open(tmp_path / "codes", MEL)), expand(store.with_table(MEL)))
    frames = np.random.default_rng(1).integers(0, len(store), 100)
    tensors = store.to("cpu")
    assert len(tensors) == len(store)
    numeric = tensors.numeric(torch.as_tensor(frames))
    assert numeric.dtype == torch.float32
    np.testing.assert_array_equal(numeric.numpy(), store.numeric(frames))
    np.testing.assert_array_equal(tensors.active(torch.as_tensor(frames)).numpy(), store.active(frames))


def test_the_scaler_makes_all_columns_alike() -> None:
    store = CodeStore.join([(name, codes.with_table(MEL)) for name, codes, _ in utterances()])
    scaled = NumericScaler.fit(store)(store.numeric(np.arange(len(store))))
    np.testing.assert_allclose(scaled.mean(0), 0, atol=1e-5)
    np.testing.assert_allclose(scaled.std(0), 1, rtol=1e-4)
    assert store.active(np.arange(4)).shape == (4, 0)


def test_the_sound_alone_needs_no_times() -> None:
    sound = sound_of(0.4)
    codes = encode_recording(Recording(None, sound=sound), MEL, CLOCK)
    assert (len(codes), codes.utterances, codes.sources) == (40, 1, ("logmel",))
    np.testing.assert_array_equal(codes.with_table(MEL).numeric(np.arange(40))[:, :5],
                                  analyse(sound, SMALL.logmel, CLOCK, 0, 40))
    joined = CodeStore.join([("a", codes), ("b", encode(alignment_of(0.1, 0.2), "", MEL, CLOCK, sound_of(0.2)))])
    assert joined.sources == ("logmel",)
    assert joined.arrays["utterance_start"].tolist() == [0, 40] and len(joined) == 60
    with pytest.raises(DnnvssError, match="feature block 'centre_phone' needs phones, and there are none"):
        codes.with_table(FeatureTable(("centre_phone",), SMALL))
    with pytest.raises(DnnvssError, match="there are no times of 'phones'"):
        encode_recording(Recording(None, sound=sound), FeatureTable(("centre_phone",)), CLOCK)
    with pytest.raises(DnnvssError, match=r"the sound \(0.0040 s\) is shorter than half a frame"):
        encode_recording(Recording(None, sound=sound_of(0.004)), MEL, CLOCK)
    with pytest.raises(DnnvssError, match="neither alignment nor sound"):
        Recording(None)


def test_phones_are_there_though_no_block_asks_for_them() -> None:
    codes = encode(alignment_of(0.1, 0.2, 0.4), "", MEL, CLOCK, sound_of(0.4))
    assert codes.sources == ("phones", "logmel")
    phones = phones_of(codes)
    assert phones.start.tolist() == [0, 10, 20]
    assert phones.frames.tolist() == [10, 10, 20]
    assert phones.code.dtype == np.int64


def test_frames_begin_where_the_alignment_begins() -> None:
    sound = sound_of(0.6)
    codes = encode(alignment_of(0.3, 0.5, start=0.2), "", MEL, CLOCK, sound)
    np.testing.assert_array_equal(codes.numeric(np.arange(30))[:, :5], analyse(sound, SMALL.logmel, CLOCK, 20, 30))


def test_what_is_missing_is_named() -> None:
    with pytest.raises(DnnvssError, match=r"labels=mel reads the sound, and there is none.*wav="):
        encode(alignment_of(0.1, 0.2), "", MEL, CLOCK)
    with pytest.raises(DnnvssError, match=r"the sound lasts 0.20 s and the alignment 0.50 s"):
        encode(alignment_of(0.1, 0.5), "", MEL, CLOCK, sound_of(0.2))
    with pytest.raises(DnnvssError, match="feature block 'logmel' needs the sound"):
        encode(alignment_of(0.1, 0.2), "", FeatureTable(("centre_phone",)), CLOCK).with_table(MEL)


@pytest.mark.parametrize(("settings", "message"), [
    ({"logmel": {"bands": "many"}}, "labels.logmel.bands=many is no whole number"),
    ({"logmel": {"band": 3}}, "labels.logmel.band is no setting. Did you mean labels.logmel.bands"),
    ({"logmel_offsets": [1, 0]}, "names a frame twice, or the current one"),
    ({"logmel_offsets": 4}, "labels.logmel_offsets=4 is no list"),
])
def test_settings_are_checked(settings: dict, message: str) -> None:
    with pytest.raises(DnnvssError, match=message):
        FeatureTable.from_config({"blocks": ["logmel"], **settings})


@pytest.mark.parametrize("name", ["mfcc", "lpc", "lsf", "formants", "energy", "voicing"])
@pytest.mark.parametrize("causal", [False, True])
def test_each_analysis_is_a_source(name: str, causal: bool) -> None:
    made = {"blocks": [name, f"{name}_window"], name: {"causal": causal}, "sound_offsets": [-2, 1, 3]}
    table, sound = FeatureTable.from_config(made), sound_of(0.3)
    codes = encode(alignment_of(0.1, 0.3), "", table, CLOCK, sound)
    analysis = getattr(table.settings, name)
    rows = analyse(sound, analysis, CLOCK, 0, 30)
    around = [rows[np.clip(np.arange(30) + offset, 0, 29)] for offset in (-2, 1, 3)]
    np.testing.assert_array_equal(expand(codes), np.concatenate([rows, *around], axis=1))
    assert (table.sources, table.needs) == ((name,), {"sound"})
    assert table.columns[0] == f"{name}/{analysis.columns[0]}"
    other = FeatureTable.from_config({**made, name: {"causal": not causal}})
    with pytest.raises(DnnvssError, match=f"its {name} were worked out with other settings"):
        codes.with_table(other)
    with pytest.raises(DnnvssError, match=r"labels.sound_offsets=\[0\] names a frame twice, or the current"):
        FeatureTable.from_config({"blocks": [name], "sound_offsets": [0]})


def test_the_encoder_is_a_source_between_its_outputs(monkeypatch: pytest.MonkeyPatch) -> None:
    outputs = {n: np.random.default_rng(n).normal(size=(n, 384)).astype(np.float16) for n in (17, 22)}
    monkeypatch.setattr("dnnvss.features.sources.encoder.encoder_outputs",
                        lambda sound, made: outputs[len(sound.samples) // 320 + 2])
    table = FeatureTable.from_config({"blocks": ["centre_phone", "encoder", "encoder_window"],
                                      "encoder_offsets": [-3, 50]})
    parts = [("a", encode(alignment_of(0.1, 0.3), "", table, CLOCK, sound_of(0.3))),
             ("b", encode(alignment_of(0.1, 0.4), "", table, CLOCK, sound_of(0.4)))]
    store = CodeStore.join(parts)
    for name, codes in parts:
        count = len(codes)
        raw = outputs[count // 2 + 2].astype(np.float32)
        exact = (np.arange(count) + 0.5) / 2  # outputs are 20 ms apart, frames 10 ms
        low = np.floor(exact).astype(int)
        rows = raw[low] + (exact - low)[:, None].astype(np.float32) * (raw[low + 1] - raw[low])
        expected = [rows, *(rows[np.clip(np.arange(count) + o, 0, count - 1)] for o in (-3, 50))]
        for got in (codes.numeric(np.arange(count)), store.numeric(frames_of(store, name)),
                    store.to("cpu").numeric(torch.as_tensor(frames_of(store, name))).numpy()):
            np.testing.assert_allclose(got, np.concatenate(expected, axis=1), atol=1e-6)
    assert (table.numeric_width, table.sources) == (3 * 384, ("phones", "encoder"))
    with pytest.raises(DnnvssError, match="its encoder were worked out with other settings"):
        store.with_table(FeatureTable.from_config({"blocks": ["encoder"], "encoder": {"causal": True}}))
    with pytest.raises(DnnvssError, match="labels=x reads the sound, and there is none"):
        encode(alignment_of(0.1), "", FeatureTable.from_config({"blocks": ["encoder"], "name": "x"}), CLOCK)


@pytest.mark.parametrize("how", ["talker", "recording", "running"])
def test_columns_are_normalised_as_the_labels_say(how: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("dnnvss.features.sources.encoder.encoder_outputs", lambda sound, made: np.random.default_rng(
        len(sound.samples)).normal(5, 3, (len(sound.samples) // 320 + 2, 384)).astype(np.float16))
    sounds = [sound_of(0.4), sound_of(0.3, 1)]
    own = Sound(sounds[0].samples, 16000, None, lambda: sounds)
    made = {"blocks": ["logmel", "encoder"], "logmel": {"bands": 5}}
    plain, table = (FeatureTable.from_config({**made, "sound_norm": n}) for n in ("none", how))
    rows, other, got = (encode_recording(Recording(None, sound=s), t, CLOCK).numeric(np.arange(len_))
                        for s, t, len_ in ((own, plain, 40), (sounds[1], plain, 30), (own, table, 40)))
    both = np.concatenate([rows, other]) if how == "talker" else rows
    if how == "running":
        expected = np.stack([(rows[k, 0] - rows[: k + 1, 0].mean()) / np.sqrt(
            (((rows[: k + 1, 0] - rows[: k + 1, 0].mean()) ** 2).sum() + 400) / (101 + k)) for k in range(40)])
    else:
        expected = (rows[:, 0] - both[:, 0].mean()) / both[:, 0].std()
        assert abs(got[:, 5:].mean()) < 0.1 and got[:, 5:].std() == pytest.approx(0.9, abs=0.2)
    np.testing.assert_allclose(got[:, 0], expected, atol=1e-4)
    assert table.hash != plain.hash
    with pytest.raises(DnnvssError, match="its logmel were worked out with other settings"):
        encode_recording(Recording(None, sound=own), table, CLOCK).with_table(plain)


def test_streams_normalise_as_the_labels_say() -> None:
    sound = sound_of(0.5)
    made = {"blocks": ["logmel", "logmel_window"], "logmel": {"bands": 5, "causal": True}, "logmel_offsets": [-2, 3]}
    table = FeatureTable.from_config({**made, "sound_norm": "running"})
    codes, stream = encode_recording(Recording(None, sound=sound), table, CLOCK), FeatureStream(table, CLOCK)
    rows = [stream.push(part)[1] for part in np.array_split(sound.samples, 7)] + [stream.finish()[1]]
    np.testing.assert_allclose(np.concatenate(rows), codes.numeric(np.arange(50)), atol=1e-6)
    with pytest.raises(DnnvssError, match=r"labels.sound_norm=recording looks at whole recordings.*=running"):
        FeatureStream(FeatureTable.from_config({**made, "sound_norm": "recording"}), CLOCK)
