"""Source files of the classes that a config names, and their hash.

A class of the package itself is covered by the version of the stage that uses it. A class of the
user's own has no version: its source file, and what that imports from the user's own folders, take
the version's place in a fingerprint.
"""

from __future__ import annotations

import ast
import hashlib
import importlib.util
import sys
import sysconfig
from collections.abc import Iterable, Iterator
from contextlib import suppress
from importlib.machinery import ModuleSpec, PathFinder
from pathlib import Path
from typing import Any

from avn.core.hashing import file_hash

# Keys whose values name a class, as `module.name`, or a policy of the user, as `module:name`.
TARGET, POLICY = "_target_", "policy"
# Packages whose classes stand in the options of the package itself.
_VERSIONED = ("avn", "torch", "lightning")
# Classes as they were imported, or None, and their hashes.
_known: dict[str, tuple[Any, str]] = {}


def outside_sources(node: Any) -> dict[str, str]:
    """Return the hashes of what each class from outside that a node names is made of.

    They are those of its source files, see `source_files`, and those of the files that its settings
    name, such as weights.

    Parameters
    ----------
    node : object
        Plain values of a config: dicts and lists, nested.

    Returns
    -------
    dict of str to str
        SHA-256, in hex, by the name of the class, or by the path of the file. A policy
        `module:name` counts as a class.
    """
    return dict(sorted(_hashes(node)))


def _hashes(node: Any) -> Iterator[tuple[str, str]]:
    if isinstance(node, dict):
        for key in (TARGET, POLICY):
            name = node.get(key)
            if isinstance(name, str) and _top(name) not in _VERSIONED:
                yield name, source_hash(name.replace(":", "."))
                yield from ((own, file_hash(Path(own))) for own in _files(node))
        node = list(node.values())
    if isinstance(node, list | tuple):
        for child in node:
            yield from _hashes(child)


def _files(node: Any) -> Iterator[str]:
    """Yield the texts below a node that are paths of files."""
    if isinstance(node, str):
        with suppress(OSError, ValueError):  # too long, or no path at all
            if node and Path(node).is_file():
                yield node
    children = node.values() if isinstance(node, dict) else node
    for child in children if isinstance(children, Iterable) and not isinstance(node, str) else ():
        yield from _files(child)


def source_hash(target: str) -> str:
    """Compute the SHA-256, in hex, of the source files of a class; see `source_files`.

    A class that is imported keeps its hash in this process, since a later edit does not change it;
    one that is reloaded has another.
    """
    module, _, name = target.rpartition(".")
    loaded = getattr(sys.modules.get(module), name, None)
    before, known = _known.get(target, (None, ""))
    if not known or before is not loaded:
        total = hashlib.sha256()
        for own, path in source_files(module).items():
            total.update(f"{own}:{hashlib.sha256(path.read_bytes()).hexdigest()};".encode())
        known = total.hexdigest()
        _known[target] = (loaded, known)
    return known


def source_files(module: str) -> dict[str, Path]:
    """Return the file of a module and of all modules that it imports from the user's folders.

    Imports are followed from file to file without being executed. Modules of the standard library
    and of installed packages are left out, unless they are in the package of the given module.

    Parameters
    ----------
    module : str
        Full name of the module.

    Returns
    -------
    dict of str to Path
        Files by the name of their module, sorted. Without the module if it has no file.
    """
    found: dict[str, Path] = {}
    left = list(_with_parents(module))
    visited = set(left)
    while left:
        name = left.pop()
        spec = _spec(name)
        if spec is None or not _is_own(name, spec, _top(module)):
            continue
        path = Path(str(spec.origin))
        found[name] = path
        package = name if spec.submodule_search_locations else name.rpartition(".")[0]
        for imported in _imports(path, package):
            for each in _with_parents(imported):
                if each not in visited:
                    visited.add(each)
                    left.append(each)
    return dict(sorted(found.items()))


def _top(name: str) -> str:
    return name.split(".")[0]


def _with_parents(name: str) -> Iterator[str]:
    """Yield the packages of a module, which Python executes on import, and the module."""
    parts = name.split(".")
    yield from (".".join(parts[:count]) for count in range(1, len(parts) + 1))


def _spec(name: str) -> ModuleSpec | None:
    """Find a module without importing its parents; None where there is none."""
    path: Any = None
    spec = None
    for each in _with_parents(name):
        spec = PathFinder.find_spec(each, path)
        if spec is None:
            # finders of editable installs are not on the path
            return importlib.util.find_spec(name) if path is None and each == name else None
        path = spec.submodule_search_locations
        if path is None and each != name:
            return None
    return spec


def _is_own(name: str, spec: ModuleSpec, top: str) -> bool:
    if not spec.has_location or not spec.origin or _top(name) in _VERSIONED:
        return False
    installed = any(
        Path(spec.origin).is_relative_to(sysconfig.get_path(kind))
        for kind in ("stdlib", "purelib", "platlib")
    )
    return not installed or _top(name) == top


def _imports(path: Path, package: str) -> Iterator[str]:
    """Yield the full names of what a file imports; for `from a import b`, both a and a.b."""
    if path.suffix != ".py":
        return
    try:
        tree = ast.parse(path.read_bytes())
    except (SyntaxError, ValueError):
        return  # importing the class says it better
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            parts = package.split(".") if node.level else []
            base = ".".join([*parts[: len(parts) - node.level + 1], *filter(None, [node.module])])
            yield from filter(None, [base])
            yield from (f"{base}.{alias.name}".strip(".") for alias in node.names)
