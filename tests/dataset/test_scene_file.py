import h5py
import numpy as np
import pytest

from avn.core.errors import UserError
from avn.dataset import scene_file

DATA = np.arange(1000, dtype=np.int16)


@pytest.fixture
def path(tmp_path):
    def fill(file):
        file["samples"] = DATA

    scene_file.write(tmp_path / "tail.h5", "tail", 3, "abc", fill)
    return tmp_path / "tail.h5"


def test_a_whole_file_is_read_and_any_hdf5_tool_reads_it(path):
    with scene_file.open_checked(path, "tail", 3, "abc") as file:
        np.testing.assert_array_equal(file["samples"][()], DATA)
    with h5py.File(path) as file:
        np.testing.assert_array_equal(file["samples"][()], DATA)


def test_equal_content_gives_equal_bytes(path, tmp_path):
    def fill(file):
        file["samples"] = DATA

    scene_file.write(tmp_path / "again.h5", "tail", 3, "abc", fill)
    assert path.read_bytes() == (tmp_path / "again.h5").read_bytes()


@pytest.mark.parametrize("at", [0, 5, 600, 2000, -1])
def test_any_changed_byte_is_found(path, at):
    content = bytearray(path.read_bytes())
    content[at] ^= 0x10
    path.write_bytes(content)
    with pytest.raises(UserError, match=r"tail\.h5: .*make it anew"):
        scene_file.open_checked(path, "tail", 3)


@pytest.mark.parametrize("keep", [0, 100, 512, 1500, -2])
def test_a_file_cut_short_is_found(path, keep):
    path.write_bytes(path.read_bytes()[:keep])
    with pytest.raises(UserError, match=r"tail\.h5: "):
        scene_file.open_checked(path, "tail", 3)


def test_what_is_wrong_is_said_in_one_line(path, tmp_path):
    cases = {
        "format version 3, but this avn reads version 4": (path, "tail", 4, None),
        "holds 'tail', not 'geometry'": (path, "geometry", 3, None),
        "made from another floor plan or other settings": (path, "tail", 3, "other"),
        "no such scene file": (tmp_path / "none.h5", "tail", 3, None),
    }
    for text, arguments in cases.items():
        with pytest.raises(UserError, match=text) as caught:
            scene_file.open_checked(*arguments)
        assert "\n" not in str(caught.value)


def test_a_version_changed_by_a_tool_is_told_as_a_version(path):
    with h5py.File(path, "r+") as file:
        file.attrs["version"] = 99
    with pytest.raises(UserError, match="format version 99"):
        scene_file.open_checked(path, "tail", 3)


def test_nothing_is_left_when_writing_fails(tmp_path):
    def fill(file):
        file["samples"] = DATA
        raise RuntimeError("full")

    with pytest.raises(RuntimeError):
        scene_file.write(tmp_path / "tail.h5", "tail", 3, "abc", fill)
    assert list(tmp_path.iterdir()) == []
