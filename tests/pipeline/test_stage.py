import multiprocessing
import time

import numpy as np
import pytest
from omegaconf import OmegaConf

from avn.core.errors import UserError
from avn.core.files import written_whole
from avn.core.hashing import digest
from avn.pipeline.stage import Stage, ask, make_once


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


def test_a_stage_may_need_another_of_its_own_folder(tmp_path):
    made = []

    def outer():
        make_once(tmp_path / "a", "the inner", lambda: False, lambda: made.append("inner"))
        made.append("outer")

    make_once(tmp_path / "a", "the outer", lambda: False, outer)
    assert made == ["inner", "outer"]


def test_asking_neither_makes_nor_opens_and_leaves_no_trace(tmp_path):
    def make():
        make_once(tmp_path / "a", "a thing", lambda: False, pytest.fail, seconds=90.0)
        pytest.fail("opened")

    assert ask(make) == Stage("a thing", tmp_path / "a", 90.0, missing=True)
    with pytest.raises(ZeroDivisionError):
        ask(lambda: 1 / 0)
    made = []
    make_once(tmp_path / "a", "a thing", lambda: False, lambda: made.append(1))
    assert made == [1]
