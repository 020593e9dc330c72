"""Parts of a head by name, their colours, and what other tools call them."""

import re

COLOURS = {
    "skin": (224, 178, 152),
    "lips": (190, 108, 100),
    "mouth": (120, 52, 54),
    "socket": (150, 96, 88),
    "eye": (236, 236, 234),
    "iris": (92, 122, 138),
    "pupil": (22, 20, 24),
    "upper_teeth": (238, 232, 220),
    "lower_teeth": (228, 222, 208),
    "tongue": (196, 98, 104),
    "brow": (146, 106, 86),
}
"""Colour of each part, sRGB from 0 to 255; parts of other names have that of skin."""
_LOWER = r"low|bottom|mandib|down"
_GUESSES = (
    (rf"(teeth|tooth|gum|dent).*({_LOWER})|({_LOWER}).*(teeth|tooth|gum|dent)", "lower_teeth"),
    (r"teeth|tooth|gum|dent", "upper_teeth"),
    (r"tongue", "tongue"),
    (r"iris", "iris"),
    (r"pupil", "pupil"),
    (r"eye_?(lash|brow)|lash|brow", "brow"),
    (r"eye_?lid|socket|lacrimal|caruncle", "skin"),
    (r"eye|cornea|sclera", "eye"),
    (r"lips?\b|lip_", "lips"),
    (r"mouth|cavity|oral", "mouth"),
)


def part_colour(name: str) -> tuple[int, int, int]:
    """The colour of a part."""
    return COLOURS.get(name, COLOURS["skin"])


def guessed_part(name: str) -> str:
    """The part that another tool's name of a group or a material means; skin where it means none."""
    if name in COLOURS:
        return name
    return next((part for pattern, part in _GUESSES if re.search(pattern, name.lower())), "skin")
