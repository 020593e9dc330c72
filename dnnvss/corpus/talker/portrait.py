"""The talker's portrait without a mouth: painted once for a size, kept, and bent by the articulators frame by frame."""

from collections.abc import Callable
from functools import cache

import cv2
import numpy as np

from dnnvss.corpus.talker.geometry import CENTRE, EYE_AT, JAWLINE, SHEET, Points, mirrored, on_sheet
from dnnvss.corpus.talker.paint import Colour, gradient, lay, mask, smooth, stroke

FINER = 2
"""The portrait has this many pixels for one of the picture, so that bending it does not blur."""
LIDS = 8
"""Steps of a blink that are painted."""

SKIN, SKIN_LIGHT, SKIN_SHADE, SKIN_DEEP = (232, 180, 146), (247, 208, 178), (205, 142, 110), (166, 103, 80)
BLUSH = (226, 128, 110)
_HAIR, _HAIR_DARK, _HAIR_LIGHT = (84, 50, 42), (56, 32, 30), (142, 90, 66)
_BACK_TOP, _BACK_LOW, _BACK_GLOW = (120, 168, 168), (176, 206, 198), (206, 226, 214)
_SHIRT, _SHIRT_DARK, _SHIRT_TRIM = (44, 66, 96), (30, 46, 72), (238, 226, 204)
_IRIS, _IRIS_DARK, _LASH = (104, 128, 92), (48, 62, 48), (48, 28, 28)


class Easel:
    """A canvas, or a part of one, in units of the design sheet.

    Args:
        picture: the whole canvas (H, H, 3) float32, painted in place.
        box: left, top, right and bottom of the part to paint, in units.
    """

    def __init__(self, picture: np.ndarray, box: tuple[float, float, float, float] = (0, 0, SHEET, SHEET)) -> None:
        self.unit = picture.shape[0] / SHEET
        left, top, right, bottom = (round(edge * self.unit) for edge in box)
        self.picture = picture[top:bottom, left:right]
        self.origin = np.array([left, top])
        across, down = np.arange(left, right, dtype=np.float32), np.arange(top, bottom, dtype=np.float32)
        self.x, self.y = np.meshgrid((across + 0.5) / self.unit, (down + 0.5) / self.unit)

    def area(self, outline: Points, blur: float = 0.0) -> np.ndarray:
        """Return the coverage of a smooth closed outline."""
        return mask(self.x.shape, smooth(outline) * self.unit - self.origin, blur=blur * self.unit)

    def fill(self, outline: Points, colour: Colour, *, blur: float = 0, alpha: float = 1,
             within: np.ndarray | None = None) -> np.ndarray:  # fmt: skip
        """Fill a smooth closed outline and return its coverage."""
        coverage = self.area(outline, blur)
        lay(self.picture, coverage if within is None else coverage * within, colour, alpha)
        return coverage

    def line(self, points: Points, colour: Colour, width: float, *, blur: float = 0, alpha: float = 1,
             within: np.ndarray | None = None) -> None:  # fmt: skip
        """Draw a smooth open line."""
        path = smooth(points, closed=False) * self.unit - self.origin
        coverage = stroke(self.x.shape, path, width * self.unit, blur=blur * self.unit)
        lay(self.picture, coverage if within is None else coverage * within, colour, alpha)

    def glow(self, at: tuple[float, float], reach: tuple[float, float], colour: Colour, alpha: float,
             within: np.ndarray | None = None) -> None:  # fmt: skip
        """Lay a soft elliptical spot."""
        coverage = np.exp(-(((self.x - at[0]) / reach[0]) ** 2) - ((self.y - at[1]) / reach[1]) ** 2)
        lay(self.picture, coverage if within is None else coverage * within, colour, alpha)


def _both(outline: Points) -> list[np.ndarray]:
    """Return an outline given for the picture's left, about x = 0, and its mirror image."""
    points = np.asarray(outline, dtype=float)
    return [on_sheet(points), on_sheet(points * (-1, 1))]


_EYES = (88, 96, 232, 164)  # the part of the sheet that a blink repaints


@cache
def portrait(size: int, lid: int = 0) -> np.ndarray:
    """Return the painted portrait, uint8 RGB of ``FINER * size`` pixels square; ``lid`` of :data:`LIDS` is shut."""
    picture = _without_eyes(size).copy()
    _eyes(Easel(picture, _EYES), lid / LIDS)
    return picture.round().clip(0, 255).astype(np.uint8)


@cache
def _without_eyes(size: int) -> np.ndarray:
    picture = np.zeros((FINER * size, FINER * size, 3), np.float32)
    easel = Easel(picture)
    for paint in (_background, _hair_behind, _body, _ears, _head, _nose, _fringe):
        paint(easel)
    return picture


def _background(easel: Easel) -> None:
    easel.picture[:] = gradient(easel.y / SHEET, [(0, _BACK_TOP), (1, _BACK_LOW)])
    easel.glow((128, 120), (150, 140), _BACK_GLOW, 0.75)


_HAIR_OUTLINE = mirrored(on_sheet([(-62, 236), (-80, 238), (-90, 214), (-93, 176), (-93, 134), (-87, 92), (-70, 54),
                                   (-40, 26), (0, 16)]))  # fmt: skip


def _hair_behind(easel: Easel) -> None:
    hair = easel.fill(_HAIR_OUTLINE, gradient(easel.y, [(16, _HAIR), (240, _HAIR_DARK)]))
    for outline in _both([(-84, 100), (-88, 150), (-86, 200), (-78, 228)]):
        easel.line(outline, _HAIR_LIGHT, 5, blur=3.5, alpha=0.5, within=hair)
    for outline in _both([(-70, 236), (-60, 200), (-62, 170)]):
        easel.line(outline, (34, 18, 20), 16, blur=7, alpha=0.7, within=hair)


def _body(easel: Easel) -> None:
    neck = mirrored(on_sheet([(-66, 324), (-54, 298), (-41, 282), (-35.5, 262), (-36, 230), (0, 226)]))
    neck_area = easel.fill(neck, SKIN)
    across = np.abs(easel.x - CENTRE - 4)
    lay(easel.picture, neck_area * np.clip((across - 8) / 34, 0, 1), SKIN_SHADE, 0.8)
    shadow = mirrored(JAWLINE * (0.9, 1) + (0.1 * CENTRE, 15))
    easel.fill(shadow, SKIN_DEEP, blur=5, alpha=0.75, within=neck_area)
    for outline in _both([(-24, 304), (-12, 312), (-3, 318)]):
        easel.line(outline, SKIN_DEEP, 2.5, blur=1.8, alpha=0.4, within=neck_area)
    shirt = [(-140, 345), (-142, 326), (-118, 306), (-80, 294), (-46, 283), (-40, 296), (-24, 312), (0, 318)]
    outline = mirrored(on_sheet(shirt))
    area = easel.fill(np.concatenate([outline, [(220, 360), (100, 360)]]),
                      gradient(easel.y, [(284, _SHIRT), (330, _SHIRT_DARK)]))  # fmt: skip
    easel.glow((100, 306), (38, 12), (86, 112, 146), 0.5, area)
    collar = mirrored(on_sheet([(-47, 284), (-41, 297), (-25, 313), (0, 319)]))
    easel.line(collar, _SHIRT_TRIM, 4.5)


def _ears(easel: Easel) -> None:
    for side, outline in enumerate(_both([(-72, 116), (-82, 116), (-86, 132), (-84, 154), (-79, 168), (-72, 168)])):
        ear = easel.fill(outline, SKIN if side == 0 else SKIN_SHADE)
        inner = _both([(-75, 132), (-80, 134), (-81, 146), (-77, 160)])[side]
        easel.line(inner, SKIN_DEEP, 2.2, blur=1.0, alpha=0.55, within=ear)
        easel.glow((CENTRE + (-79.5, 79.5)[side], 171), (2.4, 2.4), (240, 206, 120), 1.0)
        easel.glow((CENTRE + (-80.3, 78.7)[side], 170), (0.9, 0.9), (255, 246, 214), 1.0)


_CROWN = on_sheet([(0, 38), (-36, 46), (-60, 70), (-71, 100), (-74.5, 130)])
HEAD = mirrored(np.concatenate([_CROWN, JAWLINE]))[:-1]


def _head(easel: Easel) -> None:
    head = easel.area(HEAD)
    easel.fill(np.add(HEAD, (0, 2)), SKIN_DEEP, blur=2.5, alpha=0.35)
    lay(easel.picture, head, gradient(easel.y, [(60, SKIN_LIGHT), (150, SKIN), (262, (226, 170, 136))]))
    rim = np.clip((np.abs(easel.x - CENTRE + 6) - 40) / 42, 0, 1) ** 1.6
    lay(easel.picture, head * rim * np.where(easel.x > CENTRE, 1.0, 0.55).astype(np.float32), SKIN_SHADE, 0.85)
    soft = cv2.GaussianBlur(head, (0, 0), 8 * easel.unit)
    below = np.clip((easel.y - 170) / 60, 0, 1)
    lay(easel.picture, head * np.clip(2 * (1 - soft) - 0.3, 0, 1) * below, SKIN_SHADE, 0.8)
    easel.glow((136, 88), (52, 34), SKIN_LIGHT, 0.6, head)  # forehead
    for side, at in enumerate(((112, 178), (208, 178))):
        easel.glow((at[0], at[1]), (22, 15), BLUSH, (0.34, 0.30)[side], head)
        easel.glow((at[0] + (2, -6)[side], at[1] - 12), (16, 8), SKIN_LIGHT, (0.55, 0.25)[side], head)
    easel.glow((155, 246), (17, 9), SKIN_LIGHT, 0.5, head)  # chin
    easel.glow((160, 233), (20, 4.5), SKIN_SHADE, 0.45, head)  # fold under the lower lip
    easel.glow((160, 71), (70, 14), SKIN_DEEP, 0.45, head)  # shadow of the fringe
    for outline in _both([(-19, 186), (-29, 196), (-35, 208)]):
        easel.line(outline, SKIN_SHADE, 2.4, blur=2.4, alpha=0.25, within=head)


def _nose(easel: Easel) -> None:
    easel.line([(169, 128), (168, 146), (171, 168), (174, 178)], SKIN_SHADE, 7, blur=4.5, alpha=0.6)
    easel.line([(150, 118), (151.5, 130), (152, 140)], SKIN_SHADE, 6, blur=4.5, alpha=0.4)
    easel.line([(158, 128), (158, 150), (158, 170)], SKIN_LIGHT, 6, blur=3.5, alpha=0.8)
    easel.glow((157.5, 175.5), (5.5, 4.5), (255, 226, 202), 0.85)
    easel.glow((160, 189), (17, 4.2), SKIN_DEEP, 0.40)
    for outline in _both([(-12.5, 173), (-17, 179), (-15.5, 184.5), (-9.5, 186)]):
        easel.line(outline, SKIN_DEEP, 1.8, blur=1.1, alpha=0.55)
    for outline in _both([(-10.5, 184.8), (-7, 182.6), (-2.8, 185.2), (-6.5, 187.0)]):
        easel.fill(outline, (112, 58, 48), blur=0.5, alpha=0.9)
    easel.line([(150, 187), (155, 187.6), (160, 189.4), (165, 187.6), (170, 187)], SKIN_DEEP, 1.2, blur=0.7, alpha=0.5)
    easel.line([(157, 191), (156.4, 196), (156, 200)], SKIN_SHADE, 1.8, blur=1.3, alpha=0.35)  # philtrum
    easel.line([(163.6, 191), (164, 196), (164.4, 200)], SKIN_SHADE, 1.8, blur=1.3, alpha=0.42)
    easel.line([(160, 192), (160, 199)], SKIN_LIGHT, 1.8, blur=1.3, alpha=0.3)


def _eyes(easel: Easel, shut: float) -> None:
    """Draw eyes and brows; the upper lid comes down over the eye as ``shut`` goes from 0 to 1."""
    for side, at in enumerate((CENTRE - EYE_AT, CENTRE + EYE_AT)):
        sign = (1, -1)[side]

        def place(points: Points, sign: int = sign, at: float = at) -> np.ndarray:
            return np.asarray(points, dtype=float) * (sign, 1) + (at, 0)

        _eye(easel, place, at, shut)
        brow = [(-24, 118), (-14, 110.5), (0, 106.5), (12, 108), (19.5, 112.5), (19, 116.5), (8, 113), (-6, 112),
                (-16, 115)]  # fmt: skip
        easel.fill(place(brow), _HAIR_DARK, blur=0.6, alpha=0.92)


_IRIS_AT = 139.6


def _circle(at: float, radius: float) -> np.ndarray:
    angle = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    return np.stack([at + radius * np.cos(angle), _IRIS_AT + radius * np.sin(angle)], axis=1)


def _eye(easel: Easel, place: Callable[[Points], np.ndarray], at: float, shut: float) -> None:
    upper = np.array([(-17.5, 140.5), (-11, 134.6), (-1, 131.7), (9.5, 134.4), (16.5, 142)])
    lower = np.array([(16.5, 142), (9, 147.2), (-1, 148.6), (-11, 146.2), (-17.5, 140.5)])
    lid = upper + (lower[::-1] - upper) * 0.92 * shut
    socket = place([(-21, 138), (-10, 127), (2, 124), (14, 128), (20, 140), (10, 152), (-10, 152)])
    easel.fill(socket, SKIN_SHADE, blur=3.5, alpha=0.45)
    opening = easel.area(place(np.concatenate([smooth(lid, False), smooth(lower, False)[1:-1]])))
    lay(easel.picture, opening, gradient(easel.y, [(130, (214, 206, 204)), (140, (250, 246, 242))]))
    iris = easel.area(_circle(at, 8.2))
    lay(easel.picture, iris * opening, gradient(easel.y, [(131, _IRIS_DARK), (139, _IRIS), (147, (150, 166, 112))]))
    easel.line(_circle(at, 7.9), _IRIS_DARK, 1.3, blur=0.4, alpha=0.8, within=opening)
    easel.fill(_circle(at, 3.7), (22, 16, 16), blur=0.35, within=opening)
    easel.fill(place([(-18, 141), (0, 128), (17, 141), (8, 136), (-8, 136)]), (70, 40, 40), blur=1.6,
               alpha=0.35 * (1 - shut), within=opening)  # fmt: skip
    easel.glow((at - 2.8, 135.8), (1.7, 1.7), (255, 255, 255), 1.0, opening)
    easel.glow((at + 3.0, 142.6), (1.1, 1.1), (255, 255, 255), 0.6, opening)
    easel.line(place(lower), SKIN_DEEP, 1.1, blur=0.5, alpha=0.6)
    easel.line(place(np.concatenate([[lid[0] + (-1.6, 1.2)], lid])), _LASH, 2.2, blur=0.35)
    crease = upper + (lid - upper) * 0.25 - [(0, 2.5), (1, 4.6), (0, 5.4), (0, 4.8), (1, 2.5)]
    easel.line(place(crease), SKIN_DEEP, 1.2, blur=0.7, alpha=0.6)


_FRINGE = [(-93, 150), (-92, 104), (-78, 62), (-46, 28), (-4, 14), (40, 22), (74, 50), (91, 96), (93, 150), (86, 168),
           (80, 140), (76, 114), (62, 92), (40, 76), (20, 63), (4, 50), (-14, 67), (-38, 82), (-60, 98), (-73, 119),
           (-79, 144), (-86, 168)]  # fmt: skip

_SHINE: list[tuple[Points, float]] = [
    ([(4, 30), (-30, 46), (-62, 76), (-82, 120)], 0.75),
    ([(8, 38), (44, 54), (72, 84), (85, 126)], 0.6),
    ([(0, 22), (-36, 34), (-70, 66)], 0.35),
    ([(12, 24), (46, 36), (76, 66)], 0.35),
]
_STRANDS: list[Points] = [
    [(4, 50), (-26, 66), (-58, 86), (-78, 118)],
    [(2, 40), (-30, 58), (-66, 84), (-84, 128)],
    [(6, 48), (34, 64), (64, 86), (80, 122)],
    [(8, 32), (50, 50), (78, 82), (88, 130)],
]


def _fringe(easel: Easel) -> None:
    outline = on_sheet(_FRINGE)
    easel.fill(np.add(outline, (1, 4)), SKIN_DEEP, blur=3, alpha=0.4, within=easel.area(HEAD))
    hair = easel.fill(outline, gradient(easel.y, [(14, (98, 60, 48)), (70, _HAIR), (170, _HAIR_DARK)]))
    for points, alpha in _SHINE:
        easel.line(on_sheet(points), _HAIR_LIGHT, 4.5, blur=3.0, alpha=alpha, within=hair)
    for points in _STRANDS:
        easel.line(on_sheet(points), (48, 26, 26), 1.2, blur=0.8, alpha=0.5, within=hair)
    easel.line(on_sheet([(4, 50), (3, 34), (6, 16)]), (44, 24, 24), 1.4, blur=0.8, alpha=0.7)
