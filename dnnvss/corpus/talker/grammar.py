"""The talker's sentences: a small phrase grammar, and a choice that gives rare words and phones their turn.

A rule's alternatives are strings of words, names of rules and names of word classes (both in braces). A comma asks the
talker for a pause.
"""

import re
from collections import Counter
from itertools import pairwise

import numpy as np

from dnnvss.corpus.talker.vocabulary import spoken_forms, word_classes
from dnnvss.phones import SPOKEN, VOWELS, strip_stress

RULES: dict[str, tuple[str, ...]] = {
    "sentence": (
        "{who} {moved} {what}, {and_then}",
        "{who} {moved} {what} {there}",
        "{fronted}, {who} {went} {slowly} {there}",
        "{fronted}, {who} {moved} {what}",
        "{beast} {went} {there}, {and_then}",
        "{who} {ate} {dish} with {whose} {person}",
        "we {usually} {eat} {dish} {habit}",
        "they {usually} {move} {what} {habit}",
        "please {move} {what} {when}",
        "please {move} {what}, but {eat} {dish}",
        "could you {move} {what} for {whose} {person}",
        "would they {eat} {dish} at the {place}",
        "why did {who} {move} {what}",
        "where did {beast} find {what}",
        "what if {who} {moved} {what} {when}",
        "{who} saw {beast} {there}",
        "both {people} thought that {one} {state}",
        "i thought {one} {state}, but {who} {knew}",
        "if {who} gave you {what}, {order}",
        "it was {whose} {idea} to {move} {what}",
        "she found {mass} in {what}, and he had {mass} at home",
        "there is {mass} in {where}, and {mass} in {where}",
        "{number} {people} {went} {along} {where}",
        "each {person} {went} home {slowly}, and {beast} {went} away",
    ),
    "who": ("the {person}", "the {humour} {person}", "a {humour} {person}", "{whose} {person}", "{number} {people}",
            "every {person}", "{whose} {humour} {person}"),
    "what": ("the {thing}", "the {look} {thing}", "a {look} {thing}", "{whose} {thing}", "{number} {things}",
             "{number} {look} {things}", "{whose} {look} {thing}"),
    "one": ("the {thing}", "{whose} {thing}", "the {look} {thing}"),
    "beast": ("the {animal}", "a {coat} {animal}", "the {coat} {animal}", "{whose} {animal}"),
    "dish": ("the {food}", "the {flavour} {food}", "{flavour} {food}", "{whose} {food}", "{food} and {food}"),
    "where": ("the {place}", "a {air} {place}", "the {air} {place}", "{whose} {place}"),
    "there": ("{near} {where}", "{along} {where}"),
    "when": ("{nowadays}", "{habit}", "this {season}", "together", "again"),
    "habit": ("every {day}", "in {month}", "after {meal}", "before {hour}", "in the {season}", "at {hour}", "{slowly}"),
    "fronted": ("when the {weather} {passed}", "before the {weather} {passed}", "after {meal}", "every {season}",
                "while they {ate} {dish}", "after the {weather}", "at {hour}"),
    "and_then": ("and {beast} {went} away", "but {who} {ate} {dish}", "and {who} {went} home",
                 "while {who} {went} {there}"),
    "order": ("please {move} it {slowly}", "{eat} {dish}", "{move} {what}"),
    "state": ("was very {look}", "was too {look}", "was {look}"),
    "knew": ("knew why", "{usually} knew", "{moved} it"),
}

PHONES_PER_SENTENCE = (19, 29)
_CANDIDATES = 16
_NAMES = rf"\b(i|{'|'.join(word_classes()['day'] + word_classes()['month'])})\b"


def compose(count: int, seed: int = 0) -> list[str]:
    """Return ``count`` different sentences, capitals and punctuation included; the same for the same seed.

    Each is the best of 16 that the grammar offers: the one whose words, phones and phone pairs were used least so
    far, a share a phone. All 39 phones occur within the first six sentences of seed 0.
    """
    random = np.random.default_rng([seed, 1])
    used: Counter[str | tuple[str, str]] = Counter()
    chosen: dict[str, None] = {}
    while len(chosen) < count:
        offers = [offer for _ in range(_CANDIDATES) if (offer := _offer(random)) not in chosen]
        if offers:
            best = max(offers, key=lambda offer: _novelty(offer, used))
            used.update(_units(best))
            chosen[best] = None
    return [_written(plain) for plain in chosen]


def spoken_words(text: str) -> list[list[str]]:
    """Return the lower-case words of each phrase of a sentence; commas part phrases."""
    return [re.findall(r"[a-z]+", phrase) for phrase in text.lower().split(",")]


def _offer(random: np.random.Generator) -> str:
    low, high = PHONES_PER_SENTENCE
    while True:
        plain = _articles(_expanded("sentence", random))
        content = [word for word in re.findall(r"[a-z]+", plain) if len(word) > 3]
        phones = sum(len(spoken_forms()[word]) for phrase in spoken_words(plain) for word in phrase)
        if low <= phones <= high and len(set(content)) == len(content):
            return plain


def _expanded(name: str, random: np.random.Generator) -> str:
    options = RULES.get(name) or word_classes()[name]
    option = options[int(random.integers(len(options)))]
    return re.sub(r"\{(\w+)\}", lambda slot: _expanded(slot[1], random), option)


def _articles(plain: str) -> str:
    return re.sub(r"\ba (?=(\w+))", lambda article: "an " if _begins_with_vowel(article[1]) else "a ", plain)


def _begins_with_vowel(word: str) -> bool:
    return strip_stress(spoken_forms()[word][0]) in VOWELS


def _units(plain: str) -> list[str | tuple[str, str]]:
    words = [word for phrase in spoken_words(plain) for word in phrase]
    phones = [strip_stress(phone) for word in words for phone in spoken_forms()[word]]
    return [*words, *phones, *pairwise(phones)]


def _novelty(plain: str, used: Counter[str | tuple[str, str]]) -> float:
    units = _units(plain)
    return sum((3 if unit in SPOKEN else 1) / (1 + used[unit]) ** 2 for unit in units) / len(units)


def _written(plain: str) -> str:
    mark = "?" if plain.split()[0] in ("why", "where", "what", "could", "would") else "."
    return re.sub(_NAMES, lambda name: name[0].capitalize(), plain[0].upper() + plain[1:]) + mark
