"""Rules of normalisation for times of day, from one to another, with their zone."""

import re

from dnnvss.text import numbers
from dnnvss.text.amounts import END, Rule, Said, rule_of, unit_pattern

HALF = r"[ap]\.?m\b\.?"
_ZONE = r"(?:\s(?P<zone>(?-i:[ECMP][SD]?T|GMT|UTC|B?C?E?ST|CET|IST|JST|A[EW]ST))(?!\w))?"
_CLOCK = rf"(?P<h{{0}}>\d{{{{1,2}}}})(?:[:.](?P<min{{0}}>[0-5]\d))?(?!\d|\.\d)(?:\s?(?P<half{{0}}>{HALF}))?"


def _half(written: str | None) -> str:
    return written[0].lower() + "m" if written else ""


def _zone(m: re.Match[str]) -> list[str]:
    return list((m["zone"] or "").upper())


def _time(m: re.Match[str], british: bool) -> Said:
    hours, minutes = int(m["h"]), int(m["min"] or 0)
    if hours > 24 or (m["min"] is None and not m["half"]):
        return None
    return [*numbers.time_of_day(hours, minutes, int(m["s"]) if m["s"] else None, _half(m["half"])), *_zone(m)]


def _range(m: re.Match[str], british: bool) -> Said:
    """Two times: of each is known that it is one, by its minutes or by *am* or *pm*."""
    first, last = int(m["h1"]), int(m["h2"])
    if first > 24 or not (m["half2"] or (m["min1"] and ":" in m[0])) or (m["half2"] and max(first, last) > 12):
        return None
    start, end = ([*numbers.cardinal(int(m[f"h{i}"]))] if m[f"min{i}"] is None and not m[f"half{i}"]
                  else numbers.time_of_day(int(m[f"h{i}"]), int(m[f"min{i}"] or 0), None, _half(m[f"half{i}"]))
                  for i in (1, 2))
    return [*start, "to", *end, *_zone(m)]


def _of_four_digits(m: re.Match[str], british: bool) -> Said:
    """A time as soldiers write it: *0830 hours*."""
    minutes = int(m["min"])
    return ["oh", *numbers.cardinal(int(m["h"])),
            *(["hundred"] if not minutes else ["oh"] if minutes < 10 else []),
            *(numbers.cardinal(minutes) if minutes else []), "hours"]


def rules() -> list[Rule]:
    """Return the rules in the order in which they are tried."""
    return [
        rule_of(rf"{_CLOCK.format(1)}\s?(?:[-\u2013\u2014]|to(?=\s\d))\s?{_CLOCK.format(2)}{_ZONE}{END}",
                _range, ignore_case=True),
        rule_of(rf"(?P<h>\d{{1,2}}):(?P<min>[0-5]\d)(?::(?P<s>[0-5]\d)Z?)?(?:\s?(?P<half>{HALF}))?{_ZONE}{END}", _time,
                ignore_case=True),
        rule_of(rf"(?P<h>\d{{1,2}})(?:\.(?P<min>[0-5]\d))?(?P<s>)\s?(?P<half>{HALF}){_ZONE}{END}", _time,
                ignore_case=True),
        rule_of(rf"(?<=\bat\s)(?P<h>\d{{1,2}})\.(?P<min>[0-5]\d)(?!\d|\.\d|{unit_pattern()}){END}",
                lambda m, british: numbers.time_of_day(int(m["h"]), int(m["min"])) if british else None,
                ignore_case=True),
        rule_of(r"0(?P<h>[1-9])(?P<min>[0-5]\d)\s?(?:hours|hrs)(?!\w)", _of_four_digits),
    ]
