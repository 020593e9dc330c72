"""The mouth, painted over the portrait for every frame: lips, teeth, tongue and the dark between them."""

from dataclasses import dataclass, replace

import cv2
import numpy as np

from dnnvss.corpus.talker.geometry import CENTRE, JAW_DROP, LIP_LINE, SHEET, head_turn, mouth_outlines
from dnnvss.corpus.talker.paint import Colour, gradient, lay, mask, stroke
from dnnvss.corpus.talker.portrait import SKIN_DEEP, SKIN_LIGHT, SKIN_SHADE
from dnnvss.corpus.talker.targets import Articulators

PATCH = (104, 172, 216, 278)
"""Left, top, right and bottom of the part of the design sheet that is painted over."""
_FINE = 2

_UPPER_LIP = [(0.0, (190, 92, 92)), (0.6, (172, 70, 76)), (1.0, (140, 50, 58))]  # from the bow to the opening
_LOWER_LIP = [(0.0, (158, 58, 66)), (0.45, (204, 100, 102)), (1.0, (180, 84, 84))]  # from the opening down
UPPER_LIP_COLOUR, LOWER_LIP_COLOUR = _UPPER_LIP[1][1], _LOWER_LIP[1][1]
_CONTACT, _GLOSS = (92, 28, 36), (255, 222, 210)
_CAVITY = [(0.0, (34, 8, 14)), (1.0, (92, 26, 34))]
_TEETH, _TEETH_SHADE = (250, 246, 238), (196, 176, 166)
_TONGUE = [(0.0, (196, 92, 98)), (0.35, (218, 118, 120)), (1.0, (170, 70, 80))]
_TONGUE_UNDER = [(0.0, (206, 110, 112)), (0.5, (184, 84, 90)), (1.0, (140, 52, 62))]


@dataclass(frozen=True)
class _Sheet:
    """The patch being painted: its colours, where its pixels lie on the design sheet, and how to get there."""

    picture: np.ndarray
    x: np.ndarray
    y: np.ndarray
    articulators: Articulators
    turn: tuple[np.ndarray, np.ndarray]
    origin: np.ndarray
    unit: float

    def place(self, outline: np.ndarray) -> np.ndarray:
        """Return an outline of the unmoved head in pixels of the patch."""
        return (outline @ self.turn[0] + (self.turn[1] - self.origin)) * self.unit

    def area(self, outline: np.ndarray, blur: float = 0.0) -> np.ndarray:
        """Return the coverage of a closed outline of the unmoved head."""
        return mask(self.picture.shape[:2], self.place(outline), fine=_FINE, blur=blur * self.unit)

    def line(self, points: np.ndarray, width: float, blur: float = 0.0) -> np.ndarray:
        """Return the coverage of a line of the unmoved head."""
        return stroke(self.picture.shape[:2], self.place(points), width * self.unit, fine=_FINE, blur=blur * self.unit)

    def dab(self, at: tuple[float, float], reach: tuple[float, float], colour: Colour, alpha: float,
            within: np.ndarray | None = None) -> None:  # fmt: skip
        """Lay a soft elliptical spot about a point of the unmoved head."""
        x, y = np.array(at) @ self.turn[0] + self.turn[1]
        column, row = (x - self.origin[0]) * self.unit, (y - self.origin[1]) * self.unit
        wide, high = 2.4 * reach[0] * self.unit, 2.4 * reach[1] * self.unit
        part = (slice(max(int(row - high), 0), max(int(row + high) + 1, 0)),
                slice(max(int(column - wide), 0), max(int(column + wide) + 1, 0)))  # fmt: skip
        across = np.exp(-(((self.x[0, part[1]] - x) / reach[0]) ** 2))
        down = np.exp(-(((self.y[part[0], 0] - y) / reach[1]) ** 2))
        coverage = down[:, None] * across
        lay(self.picture[part], coverage if within is None else coverage * within[part], colour, alpha)

    def around(self, outline: np.ndarray, margin: float) -> "_Sheet":
        """Return the part of the sheet within ``margin`` units of an outline; painting it paints this sheet."""
        seen = self.place(outline)
        left, top = np.maximum(np.floor(seen.min(axis=0) - margin * self.unit), 0).astype(int)
        right, bottom = np.ceil(seen.max(axis=0) + margin * self.unit).astype(int) + 1
        part = (slice(top, bottom), slice(left, right))
        origin = self.origin + np.array([left, top]) / self.unit
        return replace(self, picture=self.picture[part], x=self.x[part], y=self.y[part], origin=origin)


def paint_mouth(picture: np.ndarray, articulators: Articulators) -> None:
    """Paint the mouth into ``picture`` (H, H, 3) uint8 RGB in place, where the articulators put it."""
    unit = picture.shape[0] / SHEET
    left, top, right, bottom = (round(edge * unit) for edge in PATCH)
    patch = picture[top:bottom, left:right].astype(np.float32)
    x, y = np.meshgrid((np.arange(left, right) + 0.5) / unit, (np.arange(top, bottom) + 0.5) / unit)
    origin, turn = np.array([left, top]) / unit, head_turn(articulators)
    sheet = _Sheet(patch, x.astype(np.float32), y.astype(np.float32), articulators, turn, origin, unit)
    edges = mouth_outlines(articulators)
    _skin(sheet, edges)
    lips = sheet.around(_ring(edges["upper_outer"], edges["lower_outer"]), margin=2.5)
    _lips(lips, edges)
    hole = _ring(edges["upper_inner"], edges["lower_inner"])
    if (edges["lower_inner"] - edges["upper_inner"])[:, 1].max() > 0.25:
        _inside(sheet.around(hole, margin=1), edges)
    _contact(lips, edges)
    picture[top:bottom, left:right] = patch.round().clip(0, 255).astype(np.uint8)


def _ring(upper: np.ndarray, lower: np.ndarray) -> np.ndarray:
    return np.concatenate([upper, lower[::-1]])


def _lower(line: np.ndarray, by: float) -> np.ndarray:
    return line + np.array([0.0, by])


def _skin(sheet: _Sheet, edges: dict[str, np.ndarray]) -> None:
    """Lay the shadows that the lips throw and the folds beside them."""
    a, low = sheet.articulators, edges["lower_outer"]
    middle = low[len(low) // 2]
    shadow = _ring(_lower(low[8:-8], -3), _lower(low[8:-8], 4.5 - 1.5 * a.spread + 1.5 * a.protrusion))
    under = sheet.around(shadow, margin=6)
    lay(under.picture, under.area(shadow, blur=2.6), SKIN_DEEP, 0.42)
    sheet.dab((CENTRE - 3, middle[1] + 13), (15, 5), SKIN_LIGHT, 0.35)
    for side, corner in ((-1, low[0]), (1, low[-1])):
        sheet.dab((corner[0] + 1.5 * side, corner[1] + 0.6), (3.2, 2.6), SKIN_DEEP, 0.5)
        reach = corner[0] + side * (7.5 + 2.0 * a.spread)
        fold = np.array([(CENTRE + side * 21, 187), (reach - side * 2.0, corner[1] - 12), (reach, corner[1] - 2)])
        beside = sheet.around(fold, margin=5)
        lay(beside.picture, beside.line(fold, 2.2, blur=1.8), SKIN_SHADE, min(max(0.16 + 0.62 * a.spread, 0), 1))


def _lips(sheet: _Sheet, edges: dict[str, np.ndarray]) -> None:
    a = sheet.articulators
    upper, lower = edges["upper_outer"], edges["lower_outer"]
    inner_top, inner_low = edges["upper_inner"], edges["lower_inner"]
    middle = len(upper) // 2
    along = (sheet.y - upper[middle - 6, 1]) / (inner_top[middle, 1] - upper[middle - 6, 1])
    lay(sheet.picture, sheet.area(_ring(upper, lower), blur=0.45), gradient(along, _UPPER_LIP))
    along = (sheet.y - inner_low[middle, 1]) / (lower[middle, 1] - inner_low[middle, 1])
    seam = np.concatenate([upper[:1], inner_low, upper[-1:]])
    lay(sheet.picture, sheet.area(_ring(seam, lower), blur=0.4), gradient(along, _LOWER_LIP))
    full = lower[middle, 1] - inner_low[middle, 1]
    wide = lower[-1, 0] - CENTRE
    shine = (CENTRE - 2.5, inner_low[middle, 1] + 0.45 * full)
    sheet.dab(shine, (0.40 * wide, 0.21 * full), _GLOSS, 0.50 + 0.18 * a.protrusion - 0.2 * a.tuck)
    rim = sheet.line(_lower(upper[8:-8], -0.7), 0.9, blur=0.6)
    lay(sheet.picture, rim, SKIN_LIGHT, 0.45)
    sheet.dab((CENTRE - 5, upper[middle - 6, 1] + 3.0), (6, 1.8), _GLOSS, 0.20 + 0.15 * a.protrusion)


def _inside(sheet: _Sheet, edges: dict[str, np.ndarray]) -> None:
    """Paint what shows between the lips."""
    a, picture = sheet.articulators, sheet.picture
    hole = sheet.area(_ring(edges["upper_inner"], edges["lower_inner"]))
    top, low = edges["upper_inner"][:, 1].min(), edges["lower_inner"][:, 1].max()
    lay(picture, hole, gradient((sheet.y - top) / max(low - top, 6), _CAVITY))
    layers = [_lower_teeth, _tongue] if a.tongue_front > 0.35 else [_tongue, _lower_teeth]
    for paint in (*layers, _upper_teeth):
        paint(sheet, hole)
    lit = sheet.area(_ring(_lower(edges["upper_inner"], 3.2), _lower(edges["lower_inner"], 6)), blur=1.0)
    lay(picture, hole * np.clip(hole - lit, 0, 1), (40, 10, 14), 0.40)
    depth = np.clip((np.abs(sheet.x - CENTRE) - 9) / 17, 0, 1)
    lay(picture, hole * depth, (40, 10, 14), 0.60)
    lay(picture, hole, (40, 10, 14), 0.62 * min(max(a.rounding, 0), 1) ** 2)  # lips that reach forward shade the teeth


def _arch(half: float, edge: float, curve: float, root: float, teeth: np.ndarray) -> np.ndarray:
    """Return a row of teeth as an outline: its biting edge is at ``edge``, its roots at ``root``."""
    x = np.linspace(-half, half, 61)
    nearest = np.abs(x[:, None] - teeth).min(axis=1)
    bite = edge - np.sign(edge - root) * (curve * (x / half) ** 2 + 0.9 * np.exp(-((nearest / 0.8) ** 2)))
    return np.concatenate([np.stack([x + CENTRE, bite], 1), [(CENTRE + half, root), (CENTRE - half, root)]])


_UPPER_GAPS = np.array([-18.5, -13.2, -7.2, 0, 7.2, 13.2, 18.5])
_LOWER_GAPS = np.array([-14, -9.4, -4.7, 0, 4.7, 9.4, 14])


def _upper_teeth(sheet: _Sheet, hole: np.ndarray) -> None:
    edge = LIP_LINE + 3.4 + (1.2 if sheet.articulators.tuck > 0 else 0) * min(sheet.articulators.tuck, 1)
    _row(sheet, hole, _arch(23, edge, 3.6, LIP_LINE - 16, _UPPER_GAPS), _UPPER_GAPS, 1.0)


def _lower_teeth(sheet: _Sheet, hole: np.ndarray) -> None:
    edge = LIP_LINE + 3.9 + 0.84 * JAW_DROP * sheet.articulators.jaw
    _row(sheet, hole, _arch(18, edge, 2.4, edge + 16, _LOWER_GAPS), _LOWER_GAPS, 0.86)


def _row(sheet: _Sheet, hole: np.ndarray, outline: np.ndarray, gaps: np.ndarray, light: float) -> None:
    coverage = sheet.area(outline, blur=0.3) * hole
    across = np.clip(np.abs(sheet.x - CENTRE) / 22, 0, 1) ** 2
    colours = gradient(across, [(0, _TEETH), (1, _TEETH_SHADE)]) * light
    lay(sheet.picture, coverage, colours, 0.97)
    top, low = outline[:, 1].min(), outline[:, 1].max()
    between = np.array([[(CENTRE + gap, top), (CENTRE + gap, low)] for gap in gaps])
    lay(sheet.picture, sheet.line(between, 0.7, blur=0.35) * coverage, (150, 120, 112), 0.38)


def _tongue(sheet: _Sheet, hole: np.ndarray) -> None:
    a = sheet.articulators
    floor = LIP_LINE + 6.5 + 0.50 * JAW_DROP * a.jaw
    height, front = min(max(a.tongue_height, 0), 1), min(max(a.tongue_front, 0), 1)
    top = floor - height * (floor - (LIP_LINE + 1.5)) * (1 - 0.15 * front)
    half = 16 - 5.0 * height + 3.5 * front
    angle = np.linspace(-np.pi, 0, 31)
    dome = np.stack([CENTRE + half * np.sign(np.cos(angle)) * np.abs(np.cos(angle)) ** 0.75,
                     floor + 4 + (floor + 4 - top) * np.sin(angle)], axis=1)  # fmt: skip
    outline = np.concatenate([dome, [(CENTRE + half + 3, floor + 18), (CENTRE - half - 3, floor + 18)]])
    coverage = sheet.area(outline, blur=0.5) * hole
    under = height * (1 - front)
    along = np.clip((sheet.y - top) / 14, 0, 1)
    above, below = gradient(along, _TONGUE), gradient(along, _TONGUE_UNDER)
    colours = above + np.float32(under) * (below - above)
    lay(sheet.picture, coverage, colours)
    sheet.dab((CENTRE, top + 7), (1.6, 7), (150, 58, 68), 0.45 * (1 - 0.6 * front), coverage)
    sheet.dab((CENTRE - 4, top + 3), (6, 1.8), _GLOSS, 0.25 + 0.35 * front, coverage)


def _contact(sheet: _Sheet, edges: dict[str, np.ndarray]) -> None:
    """Draw the dark line where the lips meet, and the soft dark edge of an open mouth."""
    gap = (edges["lower_inner"] - edges["upper_inner"])[:, 1].max()
    closed = float(np.clip(1 - gap / 5, 0, 1))
    line = np.concatenate([edges["upper_outer"][:1], edges["upper_inner"], edges["upper_outer"][-1:]])
    lay(sheet.picture, sheet.line(line, 1.3, blur=0.5), _CONTACT, 0.45 + 0.45 * closed)
    lay(sheet.picture, sheet.line(_lower(edges["lower_inner"], 0.3), 1.0, blur=0.5), _CONTACT, 0.35)
    lay(sheet.picture, cv2.GaussianBlur(sheet.line(line, 1.4), (0, 0), 1.6 * sheet.unit), _CONTACT, 0.35)
