import multiprocessing
import time

import numpy as np
import pytest
from omegaconf import OmegaConf

from avn.errors import UserError
from avn.stages import digest, make_once, written_whole


def test_a_hash_is_of_the_values_and_not_of_their_order():
    config = OmegaConf.create({"a": 1, "b": {"c": "${a}"}})
    assert digest({"x": 1, "y": 2}) == digest({"y": 2, "x": 1})
    assert digest(config) == digest({"b": {"c": 1}, "a": 1})
    assert digest({"x": 1}) != digest({"x": 2})
    assert digest(np.arange(3)) != digest(np.arange(3.0))


def test_what_is_missing_is_refused_where_it_must_not_be_made(tmp_path):
    with pytest.raises(UserError, match="auto=false"):
        make_once(tmp_path / "a", "a thing", lambda: False, lambda: None, auto=False)


def test_a_file_is_there_whole_or_not_at_all(tmp_path):
    path = tmp_path / "file"

    def break_off():
        with written_whole(path) as part:
            part.write_text("half")
            raise RuntimeError

    with pytest.raises(RuntimeError):
        break_off()
    assert list(tmp_path.iterdir()) == []
    with written_whole(path) as part:
        part.write_text("whole")
    assert path.read_text() == "whole"


def _make(folder):
    def make():
        with (folder.parent / "made").open("a") as log:
            log.write("once\n")
        time.sleep(0.5)
        folder.mkdir()

    make_once(folder, "a thing", folder.is_dir, make)


def test_two_at_once_make_it_once(tmp_path):
    context = multiprocessing.get_context("fork")
    both = [context.Process(target=_make, args=(tmp_path / "thing",)) for _ in range(2)]
    for process in both:
        process.start()
    for process in both:
        process.join()
    assert [process.exitcode for process in both] == [0, 0]
    assert (tmp_path / "made").read_text() == "once\n"
