"""Where the articulators of the talker's face go for each phone, and how strongly the phone insists on it."""

from typing import NamedTuple

import numpy as np

from dnnvss.phones import PHONES


class Articulators(NamedTuple):
    """The state of the face at one moment. Rest is all zeros, with a closed mouth.

    Args:
        jaw: 0 closed to 1 dropped.
        opening: distance between the inner lips, 1 wide open; below 0 the lips are pressed together.
        spread: corners of the mouth outward.
        rounding: corners inward, opening round.
        protrusion: lips pushed forward, which a camera in front sees as fuller, flared lips.
        tuck: lower lip under the upper teeth.
        tongue_height: tip of the tongue, 0 on the floor of the mouth to 1 behind the upper teeth.
        tongue_front: tip of the tongue between the teeth.
        sway_x, sway_y: head moved right and down, in thousandths of the picture's height.
        roll: head turned clockwise about the chin, in degrees.
        blink: eyelids, 0 open to 1 closed.
    """

    jaw: float = 0.0
    opening: float = 0.0
    spread: float = 0.0
    rounding: float = 0.0
    protrusion: float = 0.0
    tuck: float = 0.0
    tongue_height: float = 0.0
    tongue_front: float = 0.0
    sway_x: float = 0.0
    sway_y: float = 0.0
    roll: float = 0.0
    blink: float = 0.0


LIPS = ("jaw", "opening", "spread", "rounding", "protrusion", "tuck")
"""The articulators that gestures are made of; they move together from target to target."""
TONGUE = ("tongue_height", "tongue_front")

SHAPES = ("rest", "closed", "tucked", "round", "flared", "open", "mid", "spread")
"""The mouth shapes that a gesture starts from and ends in."""


class Target(NamedTuple):
    """What a phone asks for.

    Args:
        shape: the mouth shape that it counts as, or ``""`` for a phone that never turns the movement.
        salience: who wins when two phones are too close for a movement each; 1 always wins.
        jaw_weight, lip_weight: dominance over its neighbours in jaw and opening, and in the form of the lips.
        lips: values of :data:`LIPS`.
        tongue: values of :data:`TONGUE`.
    """

    shape: str
    salience: float
    jaw_weight: float
    lip_weight: float
    lips: tuple[float, float, float, float, float, float]
    tongue: tuple[float, float]


#        shape  salience jaw  lip     jaw  open sprd rnd  prot tuck     tongue
_TABLE = """
AA       open     0.80  1.0  0.5     0.95 0.95 0.00 0.00 0.00 0.00     0.10 0.00
AE       open     0.80  1.0  0.7     0.85 0.86 0.40 0.00 0.00 0.00     0.20 0.00
AH       mid      0.40  0.6  0.4     0.55 0.55 0.05 0.05 0.00 0.00     0.15 0.00
AO       round    0.75  1.0  1.0     0.55 0.56 0.00 0.75 0.55 0.00     0.05 0.00
EH       mid      0.60  0.9  0.7     0.60 0.58 0.30 0.00 0.00 0.00     0.25 0.00
ER       flared   0.55  0.7  0.9     0.25 0.36 0.00 0.45 0.75 0.00     0.35 0.00
EY       spread   0.70  0.9  0.9     0.35 0.44 0.75 0.00 0.00 0.00     0.35 0.00
IH       mid      0.42  0.6  0.6     0.40 0.44 0.35 0.00 0.00 0.00     0.35 0.00
IY       spread   0.70  0.9  1.0     0.15 0.34 1.00 0.00 0.00 0.00     0.45 0.00
OW       round    0.75  0.9  1.0     0.40 0.42 0.00 0.90 0.70 0.00     0.05 0.00
UH       round    0.55  0.7  0.8     0.28 0.34 0.00 0.75 0.60 0.00     0.10 0.00
UW       round    0.75  0.9  1.0     0.18 0.26 0.00 1.00 0.85 0.00     0.05 0.00
B        closed   1.00  0.8  0.3     0.10 -.34 0.00 0.00 0.00 0.00     0.10 0.00
CH       flared   0.75  0.9  1.0     0.08 0.40 0.00 0.40 1.00 0.00     0.60 0.00
D        -        0.00  0.3  0.1     0.18 0.32 0.10 0.00 0.00 0.00     0.90 0.10
DH       mid      0.30  0.4  0.2     0.32 0.48 0.10 0.00 0.00 0.00     0.60 1.00
F        tucked   1.00  0.9  0.5     0.12 0.20 0.15 0.00 0.00 1.00     0.10 0.00
G        -        0.00  0.2  0.1     0.30 0.38 0.05 0.00 0.00 0.00     0.20 0.00
HH       -        0.00  0.1  0.1     0.40 0.42 0.00 0.00 0.00 0.00     0.15 0.00
JH       flared   0.75  0.9  1.0     0.10 0.40 0.00 0.40 0.95 0.00     0.60 0.00
K        -        0.00  0.2  0.1     0.30 0.38 0.05 0.00 0.00 0.00     0.20 0.00
L        mid      0.30  0.5  0.2     0.45 0.48 0.05 0.00 0.00 0.00     1.00 0.15
M        closed   1.00  0.8  0.3     0.10 -.30 0.00 0.00 0.00 0.00     0.15 0.00
N        -        0.00  0.3  0.1     0.22 0.34 0.10 0.00 0.00 0.00     0.90 0.10
NG       -        0.00  0.2  0.1     0.30 0.38 0.05 0.00 0.00 0.00     0.20 0.00
P        closed   1.00  0.8  0.3     0.10 -.38 0.00 0.00 0.00 0.00     0.10 0.00
R        flared   0.50  0.6  0.8     0.20 0.30 0.00 0.50 0.80 0.00     0.40 0.00
S        spread   0.45  0.9  0.4     0.04 0.38 0.60 0.00 0.00 0.00     0.70 0.00
SH       flared   0.75  0.9  1.0     0.06 0.40 0.00 0.40 1.00 0.00     0.60 0.00
T        -        0.00  0.3  0.1     0.14 0.32 0.10 0.00 0.00 0.00     0.90 0.10
TH       mid      0.40  0.5  0.3     0.32 0.50 0.10 0.00 0.00 0.00     0.60 1.00
V        tucked   1.00  0.9  0.5     0.14 0.20 0.10 0.00 0.00 0.90     0.10 0.00
W        round    0.85  0.9  1.0     0.12 0.20 0.00 1.00 0.85 0.00     0.10 0.00
Y        spread   0.50  0.6  0.7     0.12 0.32 0.75 0.00 0.00 0.00     0.50 0.00
Z        spread   0.45  0.9  0.4     0.04 0.38 0.60 0.00 0.00 0.00     0.70 0.00
ZH       flared   0.75  0.9  1.0     0.08 0.40 0.00 0.40 0.95 0.00     0.60 0.00
sil      rest     1.00  0.6  0.5     0.00 0.00 0.00 0.00 0.00 0.00     0.00 0.00
sp       rest     0.90  0.4  0.3     0.00 0.00 0.00 0.00 0.00 0.00     0.00 0.00
"""

GLIDES: dict[str, tuple[str, str]] = {"AW": ("AA", "UW"), "AY": ("AA", "IY"), "OY": ("AO", "IY")}
"""Diphthongs that travel between two mouth shapes, as their two ends."""


def _parsed(line: str) -> tuple[str, Target]:
    phone, shape, *numbers = line.split()
    salience, jaw_weight, lip_weight, *values = map(float, numbers)
    lips, tongue = values[: len(LIPS)], values[len(LIPS) :]
    shape = "" if shape == "-" else shape
    return phone, Target(shape, salience, jaw_weight, lip_weight, tuple(lips), tuple(tongue))  # type: ignore[arg-type]


TARGETS: dict[str, Target] = dict(_parsed(line) for line in _TABLE.split("\n") if line)
"""The target of every phone; the three diphthongs of :data:`GLIDES` have two."""
assert set(TARGETS) | set(GLIDES) == set(PHONES)


def shape_centre(shape: str) -> np.ndarray:
    """Return the typical :data:`LIPS` values (6,) of a mouth shape: the mean of the phones that count as it."""
    return np.mean([target.lips for target in TARGETS.values() if target.shape == shape], axis=0)
