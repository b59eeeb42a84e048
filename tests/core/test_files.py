"""Files that cannot be written."""

import errno
import resource
from pathlib import Path

import h5py
import numpy as np
import pytest
import torch

from avn.core.errors import UserError
from avn.core.files import atomic_write, write_failure, writing
from avn.dataset import scene_file

BIG = np.random.default_rng(0).normal(size=1_000_000)


def torch_file(path):
    with atomic_write(path) as part, part.open("wb") as file:
        torch.save(torch.from_numpy(BIG), file)


def npz(path):
    with atomic_write(path) as part, part.open("wb") as file:
        np.savez(file, big=BIG)


def scene(path):
    scene_file.write(path, "kind", 1, "fingerprint", lambda file: file.update({"x": BIG}))


def scene_in_parts(path):
    def fill(file: h5py.File) -> None:
        rows = file.create_dataset("x", BIG.shape, BIG.dtype)
        for first in range(0, len(BIG), 100_000):
            rows[first : first + 100_000] = BIG[first : first + 100_000]

    scene_file.write(path, "kind", 1, "fingerprint", fill)


def text(path):
    with atomic_write(path) as part:
        part.write_text("x" * 5_000_000)


@pytest.fixture
def _small_files():
    """A largest size of files, which fails in the same calls as a full disk."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1_000_000, before[1]))
    yield
    resource.setrlimit(resource.RLIMIT_FSIZE, before)


@pytest.mark.usefixtures("_small_files")
@pytest.mark.parametrize("write", [torch_file, npz, scene, scene_in_parts, text])
def test_a_file_that_does_not_fit_is_one_line_and_leaves_nothing(write, tmp_path):
    with pytest.raises(UserError) as caught:
        write(tmp_path / "product")
    assert str(caught.value).startswith(f"{tmp_path / 'product'} cannot be written (File too large")
    assert "\n" not in str(caught.value)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("code", [errno.ENOSPC, errno.EDQUOT, errno.EACCES, errno.EROFS])
def test_the_cause_is_found_below_other_errors(code):
    error = RuntimeError("of a library")
    error.__cause__ = OSError(code, "refused")
    assert write_failure(error, "some/file").startswith("some/file cannot be written (")


def test_other_errors_stay_as_they_are():
    with pytest.raises(FileNotFoundError), writing("some/file"):
        Path("/no/such/file").read_text()
    assert write_failure(ValueError("errno"), "some/file") is None
