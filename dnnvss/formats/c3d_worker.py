"""The process in which ezc3d reads a C3D: a damaged file may end it, and its memory is bounded.

Run by :mod:`dnnvss.formats.c3d` as a file; it imports nothing of the package. Arguments: the C3D, the ``.npz`` to be
written, the most bytes of memory, and the most seconds of the processor.
"""

import resource
import sys


def main(source: str, target: str, most: int, seconds: int) -> None:
    """Write ``names``, ``points`` (F, M, 3) with NaN for gaps, ``rate`` and ``unit`` of a C3D."""
    import ezc3d
    import numpy as np

    for kind, limit in ((resource.RLIMIT_AS, most), (resource.RLIMIT_CPU, seconds)):
        hard = resource.getrlimit(kind)[1]
        if hard == resource.RLIM_INFINITY or hard > limit:
            resource.setrlimit(kind, (limit, hard))
    read = ezc3d.c3d(source)
    point = read["parameters"]["POINT"]
    data = np.asarray(read["data"]["points"])
    residual = np.asarray(read["data"]["meta_points"]["residuals"])[0].T
    points = np.moveaxis(data[:3], 0, -1).swapaxes(0, 1).astype(float)
    points[(residual < 0) | ~np.isfinite(points).all(axis=-1)] = np.nan
    unit = point["UNITS"]["value"] if "UNITS" in point else []
    np.savez(
        target,
        points=points,
        names=np.array(point["LABELS"]["value"], dtype=str),
        rate=np.array(float(point["RATE"]["value"][0])),
        unit=np.array(str(unit[0]) if len(unit) else "mm"),
    )


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], int(sys.argv[3]), int(sys.argv[4]))
