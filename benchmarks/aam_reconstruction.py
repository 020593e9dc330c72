"""How good and how fast the active appearance model is on a prepared corpus.

    OMP_NUM_THREADS=1 python benchmarks/aam_reconstruction.py --corpus data/grid [--aam grid] [--clips 200] [--jobs 2]

Prints, for the settings of ``conf/aam`` and for variants of them, the error of reconstruction on the test split (RMS
distance of the points in pixels, RMS difference of the texture in grey levels; with each clip's offset and without),
and how much of each of the first coefficients' variance over speech lies between clips. Then frames a second, on one
core, of warp, encoding, decoding and rendering. ``--clips`` takes fewer training clips.
"""

import argparse
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import joblib
import numpy as np
from hydra import compose, initialize_config_dir
from omegaconf import OmegaConf

from dnnvss.corpus import Corpus
from dnnvss.face.aam import AAMConfig, ActiveAppearanceModel
from dnnvss.face.aam.coding import measure_clip
from dnnvss.face.clips import corpus_clips
from dnnvss.face.encoding import EncodedCorpus, encode_corpus
from dnnvss.render import Renderer, choose_neutral

CONF = Path(__file__).resolve().parents[1] / "conf" / "aam"
SHOWN = 6


def settings(name: str) -> AAMConfig:
    """Return the settings of ``conf/aam/NAME.yaml``."""
    with initialize_config_dir(str(CONF), version_base=None):
        return AAMConfig.from_dict(OmegaConf.to_container(compose(name), resolve=True))  # type: ignore[arg-type]


def variants(config: AAMConfig) -> dict[str, AAMConfig]:
    """Return the settings and what each part of them is compared with."""
    naive = replace(config, clip_means=False, pose_smoothing=0.0,
                    points=replace(config.points, stable=config.points.points))
    return {
        "as configured": config,
        "aligned on the modelled points, clip means kept": naive,
        "clip means kept": replace(config, clip_means=False),
        "shape and texture apart": replace(config, kind="separate"),
        "texture on the mean shape": replace(config, texture_shape="mean"),
    }


def rate(work: Callable[[], int]) -> float:
    """Return frames a second of processor time."""
    work()
    start = time.process_time()
    return work() / (time.process_time() - start)


def speeds(corpus: Corpus, encoded: EncodedCorpus) -> dict[str, float]:
    """Return frames a second on one core of each step."""
    model = encoded.face
    assert isinstance(model, ActiveAppearanceModel)
    clips = corpus_clips(corpus, [corpus.utterances[i] for i in encoded.splits["test"][:4]])
    points, valid = clips[0].read_points(model.layout.needed)
    first = next(iter(clips[0].images()))
    own = points[valid][:, model.layout.rows]
    parameters = np.concatenate([encoded.clip(c.id).parameters for c in clips])
    renderer = Renderer(model, choose_neutral(corpus, encoded))
    return {
        "warp a picture to the texture": rate(lambda: len([model.warp.sample(first, p) for p in own])),
        "read, warp and encode a clip": rate(lambda: sum(len(measure_clip(model, c).shapes) for c in clips)),
        "decode": rate(lambda: len(model.decode(parameters)[0])),
        f"render at {renderer.size[0]} x {renderer.size[1]}": rate(lambda: len(list(renderer.frames(parameters)))),
    }


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--corpus", type=Path, required=True, help="folder of a prepared corpus")
    parser.add_argument("--aam", default=None, help="settings of conf/aam; the corpus's name where not given")
    parser.add_argument("--clips", type=int, default=None, help="training clips; all where not given")
    parser.add_argument("--jobs", type=int, default=-1, help="processes")
    arguments = parser.parse_args()
    corpus = Corpus.open(arguments.corpus)
    splits = {"train": [u.id for u in corpus.split("train")][:arguments.clips],
              "test": [u.id for u in corpus.split("test")]}
    config = settings(arguments.aam or corpus.info.name)
    print(f"{corpus.info.name}: {len(splits['train'])} training clips, {len(splits['test'])} test clips\n")
    print("| settings | pixels | grey levels | pixels, no offset | grey levels, no offset | between clips, speech |")
    print("|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder, joblib.parallel_config(n_jobs=arguments.jobs):
        for name, variant in variants(config).items():
            start = time.perf_counter()
            encoded = encode_corpus(corpus, splits, variant, folder, progress=False)
            seconds = time.perf_counter() - start
            error = encoded.report["reconstruction"]["test"]
            shares = " ".join(f"{100 * s:.0f}" for s in encoded.report["between_clips"]["speech"][:SHOWN])
            print(f"| {name} | {error['pixels']:.3f} | {error['grey_levels']:.2f} | "
                  f"{error['pixels_without_offset']:.3f} | {error['grey_levels_without_offset']:.2f} | {shares} % |",
                  flush=True)
            if variant is config:
                first, took = encoded, seconds
        assert isinstance(first.face, ActiveAppearanceModel)
        print(f"\nfit and encoding of the first row: {took:.0f} s; {first.face.size} parameters, "
              f"{len(first.face.mean_texture)} texture pixels, {len(first.report['outliers'])} clips with outliers, "
              f"{len(first.report['off_colour'])} off-colour")
        print("\n| step | frames a second, one core |\n|---|---|")
        for name, value in speeds(corpus, first).items():
            print(f"| {name} | {value:.0f} |")


if __name__ == "__main__":
    main()
