"""How sharp teeth and tongue are drawn, against the recording.

    OMP_NUM_THREADS=1 python benchmarks/mouth_detail.py data/grid/face/KEY [--clips 25]

Draws frames of validation clips whose mouth is open (inner lips 4 pixels apart or more) from their own parameters
into their own pictures. Inside the inner lips, as the landmarks have them: the gradient energy of the drawn picture
over that of the recorded one (1 is as sharp), and the RMS difference in grey levels. Sharpness brings the energy back;
where the difference starts to grow, detail is made up.
"""

import argparse
from pathlib import Path

import cv2
import numpy as np

from dnnvss.corpus import Corpus
from dnnvss.errors import DnnvssError
from dnnvss.evaluation.face_figures import find_face
from dnnvss.face.aam import ActiveAppearanceModel, encode_clip
from dnnvss.media import read_video
from dnnvss.render import Footage, Revoicer
from dnnvss.render.patch import Patch

OPEN = 4.0


def energy(image: np.ndarray, mask: np.ndarray) -> float:
    """Return the sum of squared gradients of a picture's grey levels inside a mask."""
    grey = cv2.cvtColor(image, cv2.COLOR_RGB2GRAY).astype(np.float32)
    across, down = (cv2.Sobel(grey, cv2.CV_32F, *order) / 8 for order in ((1, 0), (0, 1)))
    return float((across**2 + down**2)[mask].sum())


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="an encoding of a corpus, or a run")
    parser.add_argument("--clips", type=int, default=25, help="validation clips")
    arguments = parser.parse_args()
    model, root = find_face(arguments.folder)
    assert isinstance(model, ActiveAppearanceModel)
    corpus = Corpus.open(root)
    amounts = (0.0, 0.4, 0.7, 1.0)
    sums = {amount: np.zeros(4) for amount in amounts}
    for utterance in corpus.split("val")[:arguments.clips]:
        points, valid = corpus.landmarks(utterance)
        whole = Footage(read_video(corpus.path(utterance, "video")), None, utterance.rate)  # type: ignore[arg-type]
        try:
            code = encode_clip(model, whole.images, points, valid, float(utterance.rate))
            footage, first = Footage(whole.images, code, utterance.rate).usable()
        except DnnvssError:
            continue
        frames = np.flatnonzero(model.gauges["aperture"](footage.code.parameters) > OPEN)
        lips = points[first + frames][:, model.layout.rows[model.layout.inner]]
        for amount in amounts:
            revoicer = Revoicer(model, footage, frames, patch=Patch(model, sharpness=amount))
            drawn = revoicer.frames(footage.code.parameters[frames])
            for frame, contour, picture in zip(frames, lips, drawn, strict=True):
                mask = np.zeros(picture.shape[:2], dtype=np.uint8)
                cv2.fillPoly(mask, [np.rint(contour - 0.5).astype(np.int32)], 1)
                inside, recorded = mask > 0, footage.images[frame]
                squares = ((picture.astype(float) - recorded)[inside] ** 2).sum()
                sums[amount] += [energy(picture, inside), energy(recorded, inside), squares, 3 * inside.sum()]
    print("| sharpness | gradient energy, drawn over recorded | RMS difference, grey levels |\n|---|---|---|")
    for amount, (drawn_energy, energy_there, squares, count) in sums.items():
        print(f"| {amount:g} | {drawn_energy / energy_there:.2f} | {np.sqrt(squares / count):.2f} |")


if __name__ == "__main__":
    main()
