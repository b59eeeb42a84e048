"""Docstrings of the package: what ruff's rules do not hold."""

import ast
import re
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1] / "src" / "avn"
FILES = sorted(PACKAGE.rglob("*.py"))
# A docstring says what a thing is, and asks nothing.
RIDDLE = re.compile(r"(What|Where|Which|How|Whether|Whose|Who|When)\b")


def definitions(tree):
    """Functions and classes of a module, at its top and in its classes, with their docstrings."""
    for node in tree.body:
        if isinstance(node, ast.ClassDef):
            yield node, ast.get_docstring(node) or ""
            yield from definitions(node)
        elif isinstance(node, ast.FunctionDef):
            yield node, ast.get_docstring(node) or ""


def constructor(node):
    """The `__init__` of a class, whose parameters the docstring of the class describes."""
    own = (each for each in node.body if getattr(each, "name", "") == "__init__")
    return next(own, None)


def parameters(node):
    if node is None:
        return []
    own = [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]
    return [each.arg for each in own if each.arg not in ("self", "cls")]


def described(docstring):
    """Names in the Parameters section of a docstring."""
    section = re.search(r"Parameters\n-+\n(.*?)(?=\n\w[\w ]*\n-+\n|\Z)", docstring, re.DOTALL)
    lines = section[1].splitlines() if section else []
    heads = (line.split(" : ")[0] for line in lines if line and not line.startswith(" "))
    return {name.strip("* ") for head in heads for name in head.split(",")}


def problems(path):
    for node, docstring in definitions(ast.parse(path.read_text())):
        where = f"{path.relative_to(PACKAGE)}:{node.lineno} {node.name}"
        if RIDDLE.match(docstring):
            yield f"{where}: begins with {docstring.split()[0]!r}; say what it is"
        if node.name.startswith("_") or "See `" in docstring:  # as that of a base class
            continue
        names = parameters(constructor(node) if isinstance(node, ast.ClassDef) else node)
        if len(names) >= 3 and (missing := set(names) - described(docstring)):
            yield f"{where}: Parameters lacks {', '.join(sorted(missing))}"


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(PACKAGE)))
def test_docstrings_say_what_things_are_and_take(path):
    assert list(problems(path)) == []
