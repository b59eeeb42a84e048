"""The page of config keys is that of the configs, and every key has a meaning."""

import inspect
from dataclasses import dataclass

import pytest
from config_keys import gaps
from config_meanings import comments, described
from config_page import ADVICE, PAGE, page, survey
from omegaconf import OmegaConf

from avn.modules.settings import OF_ONE
from avn.pipeline.stage import Stage


@pytest.fixture(scope="module")
def found():
    return survey()


def test_every_key_and_option_is_described(found):
    missing = gaps(found[0])
    assert not missing, f"no meaning: {', '.join(missing)}; {ADVICE}"


def test_the_page_is_up_to_date(found):
    written = PAGE.read_text() if PAGE.is_file() else ""
    assert written == page(*found), "docs/config.md is old: run `python scripts/config_page.py`"


def test_every_key_below_the_groups_is_read(found):
    """Whoever reads a key is found; a name is a label, and some keys are of `avn.train` alone."""
    groups, readers = found
    keys = {key.name for group in groups for own in group.keys.values() for key in own.values()}
    unread = {name for name in keys if "." in name and not readers.of(name)}
    assert {name.rpartition(".")[2] for name in unread} <= {"name", *OF_ONE}


def test_all_stages_are_met(found):
    """Also those that only some options need."""
    classes, left = set(), [Stage]
    while left:
        own = left.pop()
        left.extend(own.__subclasses__())
        if own.__module__.startswith("avn.") and not inspect.isabstract(own):
            classes.add(own.__name__)
    assert found[1].stages == classes


@dataclass
class Base:
    """A node.

    Attributes
    ----------
    one, two : int
        What they
        are.
    kind : {"a", "b"}
    """

    one: int = 1
    two: int = 2
    kind: str = "a"


@dataclass
class Derived(Base):
    """Another node.

    Attributes
    ----------
    two : int
        Its own.
    **others
        Those of `Base`.
    """


@dataclass
class Other:
    """A node without a base class.

    Attributes
    ----------
    one : int
        As those of `Derived`.
    three : int
        See `Derived`.
    """

    one: int = 1
    three: int = 3


def test_meanings_are_those_of_docstrings():
    node = OmegaConf.structured(Derived)
    assert described(node, "one") == ("int", "`one`, `two`: What they are.")
    assert described(node, "two") == ("int", "Its own.")
    assert described(node, "kind") == ("", "")
    other = OmegaConf.structured(Other)
    assert described(other, "one") == described(node, "one")
    assert described(other, "three") == ("", "")


def test_meanings_are_those_of_comments(tmp_path):
    file = tmp_path / "option.yaml"
    lines = ["# What it", "# is.", "defaults: [schema]", "node:", "  # Above.", "  one: 1"]
    file.write_text("\n".join([*lines, "  two: 2  # beside", "", "last: 3", ""]))
    found = comments(file)
    assert found[""] == "What it is."
    assert (found["node.one"], found["node.two"], found["last"]) == ("Above.", "beside", "")
