"""Arrays that are mapped from a file without a name."""

import errno
import tempfile
import weakref
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from dnnvss import files
from dnnvss.errors import DnnvssError


def test_parts_are_joined_and_leave_no_file(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    parts = [rng.normal(size=(rows, 3, 2)).astype(np.float32) for rows in (4, 0, 7)]
    whole = files.mapped(iter(parts), tmp_path / "new")
    np.testing.assert_array_equal(whole, np.concatenate(parts))
    assert whole.dtype == np.float32 and whole.flags.writeable and type(whole) is np.ndarray
    assert not list((tmp_path / "new").iterdir())


def test_parts_are_let_go_as_they_are_written(tmp_path: Path) -> None:
    made: list[weakref.ref] = []

    def parts() -> Iterator[np.ndarray]:
        for value in range(5):
            assert sum(part() is not None for part in made) <= 1  # the one before
            part = np.full((2, 2), value, np.int16)
            made.append(weakref.ref(part))
            yield part
            del part

    np.testing.assert_array_equal(files.mapped(parts(), tmp_path)[:, 0], np.repeat(range(5), 2))


def test_nothing_is_an_empty_array(tmp_path: Path) -> None:
    assert files.mapped([np.zeros((0, 5), np.float32)], tmp_path).shape == (0, 5)


def test_a_full_disk_names_the_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(**where: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(tempfile, "TemporaryFile", full)
    with pytest.raises(DnnvssError, match="No space left on device") as caught:
        files.mapped([np.zeros((1, 1))], tmp_path)
    assert str(tmp_path) in str(caught.value)


def test_consecutive_slices_are_the_array_itself() -> None:
    whole = np.arange(40.0, dtype=np.float32).reshape(10, 2, 2)
    back = files.shared([whole[:3], whole[3:3], whole[3:7]])
    assert back is not None and np.shares_memory(back, whole)
    np.testing.assert_array_equal(back, whole[:7])
    for parts in ([whole[:3], whole[4:]], [whole[3:], whole[:3]], [whole[:3].copy(), whole[3:].copy()],
                  [whole[:3], np.zeros((2, 2, 2), np.float32)], [whole[::2], whole[5:]], [whole[:, :1]]):
        assert files.shared(parts) is None


def test_what_is_forgotten_comes_back(tmp_path: Path) -> None:
    whole = files.mapped([np.arange(500_000.0)], tmp_path)
    whole *= 2.0
    resident = _mapped_memory()
    files.forget(whole[1000:400_000])
    assert _mapped_memory() < resident - 2_500
    np.testing.assert_array_equal(whole, 2.0 * np.arange(500_000))
    plain = np.ones(5)
    files.forget(plain)
    files.forget(whole[::2])
    files.forget(whole[3:4])
    assert plain.tolist() == [1.0] * 5 and whole[3] == 6.0


def _mapped_memory() -> int:
    """Kilobytes of files that are in the memory of this process."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("RssFile"))
