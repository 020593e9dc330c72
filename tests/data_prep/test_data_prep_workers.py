"""Other machines may do the work of a stage; what they leave is what processes of this one would."""

import subprocess
import sys
from pathlib import Path

import pytest
from conftest import ROOT

import data_prep.workers
from data_prep.demo import prepare_demo
from data_prep.workers import workers
from dnnvss.errors import DnnvssError


@pytest.mark.slow
def test_a_dask_cluster_of_two_workers_prepares_the_same_corpus(tmp_path: Path) -> None:
    pytest.importorskip("distributed", reason="the extra `cluster` is not installed")
    prepare_demo(tmp_path / "loky", sentences=3, size=64, jobs=1)
    done = subprocess.run([sys.executable, "-m", "data_prep", "corpus=demo", "corpus.sentences=3", "corpus.size=64",
                           f"corpus.out={tmp_path}/dask", "jobs=2", "backend=dask"],
                          capture_output=True, text=True, cwd=ROOT, check=False)
    assert done.returncode == 0, done.stderr
    files = sorted(p.relative_to(tmp_path / "loky") for p in (tmp_path / "loky").rglob("*") if p.is_file())
    assert files == sorted(p.relative_to(tmp_path / "dask") for p in (tmp_path / "dask").rglob("*") if p.is_file())
    assert len(files) > 12
    for name in files:
        if name.parent.name != "digest":  # their keys hold where the files are, and when they were made
            assert (tmp_path / "dask" / name).read_bytes() == (tmp_path / "loky" / name).read_bytes(), name


def test_a_backend_that_is_unknown_or_not_installed_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(DnnvssError, match="unknown backend='spark'"), workers("spark", 1):
        pass
    monkeypatch.setattr(data_prep.workers, "find_spec", lambda name: None)
    with pytest.raises(DnnvssError, match=r"needs the package distributed.*\[cluster\]"), workers("dask", 1):
        pass
