"""Who does the work of a stage: processes of this machine, or a Dask or Ray cluster."""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from importlib.util import find_spec
from typing import Any

import joblib

from dnnvss.errors import DnnvssError
from dnnvss.processes import parallel

_NEEDS = {"dask": ("distributed", "cluster"), "ray": ("ray", "ray")}
"""Package and extra of each backend that joblib does not bring itself."""


@contextmanager
def workers(backend: str, jobs: int) -> Iterator[str]:
    """Let joblib's calls in the block run on a backend; yield how it can return results (joblib's ``return_as``).

    ``dask`` uses the scheduler that ``DASK_SCHEDULER_ADDRESS`` names, ``ray`` the head that ``RAY_ADDRESS`` names;
    without, each starts a cluster of its own on this machine, which lasts until the process ends. All workers must see
    the raw recordings and the prepared corpus under the same paths.

    Args:
        backend: ``loky``, ``multiprocessing``, ``threading``, ``dask`` or ``ray``.
        jobs: processes; -1 for all cores. A cluster that is already running has the workers that it has.

    Raises:
        DnnvssError: another backend, or one whose package is missing.
    """
    if backend in _NEEDS:
        package, extra = _NEEDS[backend]
        if find_spec(package) is None:
            raise DnnvssError(f"backend={backend} needs the package {package}",
                              remedy=f'Run pip install -c constraints.txt -e ".[{extra}]", or use backend=loky')
    elif backend not in ("loky", "multiprocessing", "threading"):
        raise DnnvssError(f"unknown backend={backend!r}", remedy="Use loky, dask or ray")
    count = jobs if jobs > 0 else joblib.cpu_count()
    if backend == "dask":
        _dask(count)
    if backend == "ray":
        _ray(count)
    with parallel(-1 if backend in _NEEDS else jobs, backend):
        yield "list" if backend == "ray" else "generator_unordered"  # Ray's backend returns them all at the end


@cache
def _dask(count: int) -> Any:
    from distributed import Client

    return Client(n_workers=count, threads_per_worker=1, dashboard_address=None)


@cache
def _ray(count: int) -> None:
    import os

    import ray
    from ray.util.joblib import register_ray

    ray.init(**({} if "RAY_ADDRESS" in os.environ else {"num_cpus": count}), log_to_driver=False,
             include_dashboard=False)
    register_ray()
