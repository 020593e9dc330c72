"""Phone error rate of the network for unknown words, on words of the lexicon as if it lacked them.

    python benchmarks/g2p.py                            # 10,000 words drawn by chance

The error of a word is its edit distance to the nearest of its pronunciations in the dictionary, without stress. The
network is the one that g2p-en ships; the words are held out from the lookup, not from its authors' training.
"""

import argparse
import re

import numpy as np
from tqdm import tqdm

from dnnvss.phones import strip_stress
from dnnvss.text.lexicon import dictionary
from dnnvss.text.network import spell

Phones = tuple[str, ...]


def distance(a: Phones, b: Phones) -> int:
    """Return the least number of phones to replace, put in or leave out."""
    row = list(range(len(b) + 1))
    for i, x in enumerate(a, 1):
        above, row[0] = row[0], i
        for j, y in enumerate(b, 1):
            above, row[j] = row[j], min(row[j] + 1, row[j - 1] + 1, above + (x != y))
    return row[-1]


def main() -> None:
    """Print the rate."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--words", type=int, default=10_000)
    known: dict[str, list[Phones]] = {}
    for name, phones in dictionary().items():
        known.setdefault(re.sub(r"\(\d+\)$", "", name), []).append(tuple(phones.split()))
    words = sorted(word for word in known if re.fullmatch("[a-z]{2,}", word))
    drawn = np.random.default_rng(0).permutation(words)[: parser.parse_args().words]
    errors = total = whole = 0
    for word in tqdm(drawn):
        said = tuple(map(strip_stress, spell(str(word))[0]))
        wrong, length = min((distance(said, phones), len(phones)) for phones in known[str(word)])
        errors, total, whole = errors + wrong, total + length, whole + (wrong > 0)
    print(f"{len(drawn)} words: phone error rate {100 * errors / total:.2f} %, words with an error "
          f"{100 * whole / len(drawn):.1f} %")


if __name__ == "__main__":
    main()
