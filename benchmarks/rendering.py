"""How fast the face is drawn on one core, beside what other packages take for the same warp.

    OMP_NUM_THREADS=1 python benchmarks/rendering.py --corpus data/grid [--clips 40]

Fits a model to some training clips, then draws test clips at the corpus's own size. All rows of the table come from
this one run, in turns, each the best of several rounds of processor time:

- decode, warp, composite: parameters in, finished pictures out, as ``synth.py`` draws them;
- warp and composite: the texture is already there;
- into footage: the same, drawn into the frames of a clip (``synth.py into=``);
- ``cv2.remap`` alone, over the same pixels with maps computed beforehand: what no warp can beat;
- scikit-image's ``PiecewiseAffineTransform`` with ``warp`` over the same pixels (where it is installed).
"""

import argparse
import tempfile
import time
from collections import deque
from collections.abc import Callable
from pathlib import Path

import cv2
import joblib
import numpy as np
from aam_reconstruction import settings

from dnnvss.corpus import Corpus
from dnnvss.face.aam import ActiveAppearanceModel, ClipCode
from dnnvss.face.encoding import encode_corpus
from dnnvss.media import read_video
from dnnvss.render import Footage, Renderer, Revoicer, choose_neutral, walk

ROUNDS = 7


def rates(works: dict[str, tuple[int, Callable[[], object]]]) -> dict[str, float]:
    """Return for each name the most frames a second of processor time over some rounds in turns.

    Args:
        works: name to the number of frames that a call draws, and the call.
    """
    best = dict.fromkeys(works, 0.0)
    for _ in range(ROUNDS):
        for name, (frames, work) in works.items():
            start = time.process_time()
            work()
            best[name] = max(best[name], frames / (time.process_time() - start))
    return best


def scikit_image(renderer: Renderer, meshes: np.ndarray) -> Callable[[], object] | None:
    """Return a call that draws the meshes (F, V, 2) with scikit-image, or None where it is not installed."""
    try:
        from skimage.transform import PiecewiseAffineTransform, warp
    except ImportError:
        return None
    painter = renderer.painter
    source = np.zeros((meshes.shape[1], 2))
    source[painter.triangles] = painter.source
    picture = renderer.atlas.astype(np.float32) / 255

    def draw() -> None:
        for mesh in meshes:
            if hasattr(PiecewiseAffineTransform, "from_estimate"):
                transform = PiecewiseAffineTransform.from_estimate(mesh, source)
            else:
                transform = PiecewiseAffineTransform()
                transform.estimate(mesh, source)
            warp(picture, transform, output_shape=painter.size, order=1)

    return draw


def works(
    renderer: Renderer, revoicer: Revoicer, parameters: np.ndarray
) -> dict[str, tuple[int, Callable[[], object]]]:
    """Return what is timed: name to frames a call and the call."""
    painter, meshes = renderer.painter, renderer.meshes(parameters)
    maps = [painter.maps(mesh) for mesh in meshes]

    def composite() -> None:
        plan = painter.plan(meshes)
        for index in range(len(meshes)):
            renderer.composite(plan, index)

    def remap(kind: int) -> Callable[[], object]:
        return lambda: deque((cv2.remap(renderer.atlas, x, y, kind) for x, y in maps), maxlen=0)

    found = {
        "decode, warp, composite": (len(meshes), lambda: deque(renderer.frames(parameters), maxlen=0)),
        "warp and composite": (len(meshes), composite),
        "into footage": (len(meshes), lambda: deque(revoicer.frames(parameters), maxlen=0)),
        "cv2.remap alone, bicubic": (len(meshes), remap(cv2.INTER_CUBIC)),
        "cv2.remap alone, bilinear": (len(meshes), remap(cv2.INTER_LINEAR)),
    }
    peer = scikit_image(renderer, meshes[:4])
    if peer is None:
        print("scikit-image is not installed: its row is left out (pip install scikit-image)\n")
        return found
    return {**found, "scikit-image, bilinear, warp only": (4, peer)}


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--corpus", type=Path, required=True, help="folder of a prepared corpus")
    parser.add_argument("--aam", default=None, help="settings of conf/aam; the corpus's name where not given")
    parser.add_argument("--clips", type=int, default=40, help="training clips")
    arguments = parser.parse_args()
    cv2.setNumThreads(1)
    corpus = Corpus.open(arguments.corpus)
    splits = {"train": [u.id for u in corpus.split("train")][:arguments.clips],
              "test": [u.id for u in corpus.split("test")][:4]}
    with tempfile.TemporaryDirectory() as folder, joblib.parallel_config(n_jobs=1):
        encoded = encode_corpus(corpus, splits, settings(arguments.aam or corpus.info.name), folder, progress=False)
        face = encoded.face
        assert isinstance(face, ActiveAppearanceModel)
        renderer = Renderer(face, choose_neutral(corpus, encoded))
        parameters = np.concatenate([encoded.clip(i).parameters for i in splits["test"]])
        clip = corpus.utterances[splits["test"][0]]
        code = encoded.clip(clip.id)
        assert isinstance(code, ClipCode)
        footage, _ = Footage(read_video(corpus.path(clip, "video")), code, clip.rate).usable()
        revoicer = Revoicer(face, footage, walk(footage.code.pose, len(parameters), "pingpong"))
    height, width = renderer.painter.size
    print(f"{corpus.info.name}, {renderer.size[0]} x {renderer.size[1]}: {len(face.mean_shape)} points, "
          f"{len(renderer.painter.triangles)} triangles, {width} x {height} pixels that move, "
          f"{len(face.mean_texture)} of them textured\n")
    found = rates(works(renderer, revoicer, parameters))
    ours = found["decode, warp, composite"]
    print("| | frames a second, one core | against ours |\n|---|---|---|")
    for name, value in found.items():
        print(f"| {name} | {value:.0f} | {value / ours:.3g} |")


if __name__ == "__main__":
    main()
