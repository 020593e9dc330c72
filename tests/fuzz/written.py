"""Legal ways to write each kind of text file: the same content in another dress."""

import codecs
import random
import struct
from collections.abc import Callable, Sequence

import numpy as np

from dnnvss.timing import Alignment, Tier

Row = tuple[float, float, str]
Dress = Callable[[str], bytes]
"""Text to the bytes that an editor stores."""

_PHONES = ("N", "AW", "AY", "B", "IH", "OW", "S", "T", "ER")
_WORDS = ("now", "I", "don't", "see", "naïve", "co-op", "Zoë", "the")


def alignment(rng: random.Random) -> Alignment:
    """Phones in words with pauses, on ticks of a millisecond, as long as phones are."""
    phones, words, at = list[Row](), list[Row](), 0.0

    def lay(rows: list[Row], seconds: float, label: str) -> float:
        rows.append((round(at, 3), round(at + seconds, 3), label))
        return round(at + seconds, 3)

    words.append((0.0, 0.2, ""))
    at = lay(phones, 0.2, "sil")
    for _ in range(rng.randint(2, 6)):
        begin, previous = at, phones[-1][2]
        for _ in range(rng.randint(1, 4)):
            previous = rng.choice([p for p in _PHONES if p != previous])
            at = lay(phones, rng.randint(40, 200) / 1000, previous)
        words.append((begin, at, rng.choice(_WORDS)))
        if rng.random() < 0.3:
            words.append((at, round(at + 0.15, 3), ""))
            at = lay(phones, 0.15, "sp")
    if words[-1][2] == "":
        words.pop()
        at = phones.pop()[0]
    words.append((at, round(at + 0.3, 3), ""))
    lay(phones, 0.3, "sil")
    return Alignment([Tier("phones", phones), Tier("words", words)])


def dress(rng: random.Random, text: str) -> bytes:
    """A text in an encoding, with marks and line ends, that some editor writes."""
    text = text.replace("\n", rng.choice(("\n", "\r\n", "\r")))
    ways: list[Dress] = [lambda t: t.encode(), lambda t: codecs.BOM_UTF8 + t.encode(), lambda t: t.encode("utf-16"),
                         lambda t: codecs.BOM_UTF16_BE + t.encode("utf-16-be"), lambda t: t.encode("utf-16-le"),
                         lambda t: t.encode("utf-16-be"), lambda t: t.encode("utf-32")]
    if text.encode("cp1252", "replace").decode("cp1252") == text:
        ways.append(lambda t: t.encode("cp1252"))
    return rng.choice(ways)(text)


def number(rng: random.Random, value: float, comma: bool = False) -> str:
    """A number of milliseconds' accuracy as programs write it."""
    shown = rng.choice((f"{value:.3f}", f"{value:.6f}", f"{value:.3e}" if round(value, 3) == float(f"{value:.3e}")
                        else f"{value:.4f}"))
    return shown.replace(".", ",") if comma else shown


def textgrid(rng: random.Random, found: Alignment) -> bytes:
    """A TextGrid: long, short or binary, its tiers in any order under any of their names."""
    names = {"phones": ("phones", "Phones", "phone", "segments"), "words": ("words", "Words", "word")}
    tiers = [(rng.choice(names[t.name]), list(t)) for t in rng.sample(found.tiers, len(found.tiers))]
    if rng.random() < 0.3:
        return _binary(found.end, tiers)
    long = rng.random() < 0.5
    lines = [] if long else ['File type = "ooTextFile"', 'Object class = "TextGrid"', ""]
    if long:
        lines = ['File type = "ooTextFile"', 'Object class = "TextGrid"', "", "xmin = 0 ", f"xmax = {found.end} ",
                 "tiers? <exists> ", f"size = {len(tiers)} ", "item []: "]
    else:
        lines += ["0", f"{found.end}", "<exists>", f"{len(tiers)}"]
    for k, (name, rows) in enumerate(tiers, 1):
        label = '""'
        if long:
            lines += [f"    item [{k}]:", '        class = "IntervalTier" ', f'        name = "{name}" ',
                      "        xmin = 0 ", f"        xmax = {found.end} ", f"        intervals: size = {len(rows)} "]
        else:
            lines += ['"IntervalTier"', f'"{name}"', "0", f"{found.end}", f"{len(rows)}"]
        for n, (start, end, text) in enumerate(rows, 1):
            label = '"' + text.replace('"', '""') + '"'
            a, b = number(rng, start), number(rng, end)
            lines += ([f"        intervals [{n}]:", f"            xmin = {a} ", f"            xmax = {b} ",
                       f"            text = {label} "] if long else [a, b, label])
    return dress(rng, "\n".join(lines) + "\n")


def _binary(end: float, tiers: Sequence[tuple[str, Sequence[Row]]]) -> bytes:
    def text(value: str) -> bytes:
        if value.isascii():
            return struct.pack(">H", len(value)) + value.encode()
        return struct.pack(">HH", 0xFFFF, len(value)) + value.encode("utf-16-be")

    data = b"ooBinaryFile\x08TextGrid" + struct.pack(">dd?i", 0.0, end, True, len(tiers))
    for name, rows in tiers:
        data += b"\x0cIntervalTier" + text(name) + struct.pack(">ddi", 0.0, end, len(rows))
        for start, stop, label in rows:
            data += struct.pack(">dd", start, stop) + text(label)
    return data


def labels(rng: random.Random, found: Alignment) -> list[str]:
    """Lines of HTK labels: units or seconds, with scores, as phones or as states of phones."""
    seconds, comma, scores = rng.random() < 0.4, rng.random() < 0.5, rng.random() < 0.3
    begins = {round(s.start, 3): "_".join(s.label.split()) or "sil" for s in found["words"]}
    states = 5 if not seconds and rng.random() < 0.3 else 1
    lines = []
    for s in found["phones"]:
        edges = np.linspace(s.start, s.end, states + 1)
        for k in range(states):
            a, b = float(edges[k]), float(edges[k + 1])
            times = (f"{number(rng, a, comma)} {number(rng, b, comma)}" if seconds
                     else f"{round(a * 1e7)} {round(b * 1e7)}")
            stress = rng.choice(("", "1")) if s.label in ("AW", "AY", "IH", "OW", "ER") and states == 1 else ""
            name = s.label.lower() if rng.random() < 0.2 and states == 1 else s.label
            parts = [times, f"{name}{stress}" if states == 1 else f"{name}[{k + 2}]"]
            parts += [f"{-rng.random() * 50:.2f}"] if scores else []
            parts += [begins[round(s.start, 3)]] if k == 0 and round(s.start, 3) in begins else []
            lines.append(rng.choice((" ", "  ", "\t")).join(parts))
    return lines


def word_table(rng: random.Random, found: Alignment) -> bytes:
    """A CSV of words: parted by any of three signs, quoted or not, blank rows between."""
    sign = rng.choice((",", ";", "\t"))
    comma = sign != "," and rng.random() < 0.5
    lines = [f"sep={sign}"] if rng.random() < 0.2 else []
    lines.append(sign.join(rng.choice((n, n.capitalize(), f" {n}")) for n in ("start", "end", "word")))
    for s in found["words"]:
        if s.label:
            word = f'"{s.label}"' if rng.random() < 0.3 else s.label
            lines.append(sign.join([number(rng, s.start, comma), number(rng, s.end, comma), word]))
        if rng.random() < 0.1:
            lines.append(rng.choice(("", "  ", sign * 2)))
    return dress(rng, "\n".join(lines) + rng.choice(("", "\n", "\n\n")))


def openface(rng: random.Random, points: np.ndarray, valid: np.ndarray) -> bytes:
    """An OpenFace CSV: columns in any order, more of them, frames that were lost written in any way."""
    sign = rng.choice((",", ", ", ";", "\t"))
    comma = sign not in (",", ", ") and rng.random() < 0.5
    count = points.shape[1]
    names = ["frame", "success", *[f"{a}_{i}" for a in "xy" for i in range(count)]]
    names += rng.sample(["face_id", "timestamp", "confidence", "gaze_0_x", "AU01_r"], rng.randint(0, 5))
    rng.shuffle(names)
    lost = rng.choice(("-nan(ind)", "nan", "0", "1.#QNAN", ""))
    first = rng.choice((0, 1))
    lines = [sign.join(names)]
    for k, (shape, known) in enumerate(zip(points, valid, strict=True)):
        values = {"frame": str(k + first), "success": str(int(known)), "face_id": "0", "timestamp": f"{k / 25:.3f}",
                  "confidence": "0.98", "gaze_0_x": "0.1", "AU01_r": "0.5"}
        for i, (x, y) in enumerate(shape):
            values[f"x_{i}"], values[f"y_{i}"] = (f"{x:.6f}", f"{y:.6f}") if known else (lost, lost)
        row = [values[name].replace(".", ",") if comma else values[name] for name in names]
        lines.append(sign.join(row) + (sign.strip(" ") if rng.random() < 0.1 else ""))
        if rng.random() < 0.05:
            lines.append("")
    return dress(rng, "\n".join(lines) + "\n")


def points_file(rng: random.Random, points: np.ndarray) -> bytes:
    """A ``.pts`` file."""
    comma = rng.random() < 0.3
    head = ["version: 1", f"n_points:{rng.choice((' ', '  ', ''))}{len(points)}"][rng.choice((0, 1)):]
    rows = [" ".join(f"{v:.6f}".replace(".", "," if comma else ".") for v in point) for point in points]
    body = [line for row in rows for line in ([row, ""] if rng.random() < 0.1 else [row])]
    return dress(rng, "\n".join([*head, "{", *body, "}"]) + rng.choice(("", "\n")))
