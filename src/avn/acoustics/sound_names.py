"""Names of sounds: those of the package, and those of sounds that are given as paths of files."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Mapping
from pathlib import PurePath

from avn.acoustics.sound_table import packaged_sounds
from avn.core.errors import UserError

BUILTIN = ("ring", "alarm", "clock")  # the benchmark's recordings
ALL = "all"  # the row of all sounds
# Length of joined names in bytes, of which file names hold 255 with what surrounds them.
_LONGEST = 150

# Names of a file, in order of preference.
_CANDIDATES: tuple[Callable[[PurePath], str], ...] = (
    lambda path: path.stem,
    lambda path: _with_folder(path, path.stem),
    lambda path: path.name,
    lambda path: _with_folder(path, path.name),
)


def joined_names(names: Collection[str], by: str = "+") -> str:
    """Return the names of some sounds joined, or of many their number, such as `74-sounds`."""
    joined = by.join(names)
    return joined if len(joined.encode()) <= _LONGEST else f"{len(names)}-sounds"


def name_sounds(mapping: Mapping[str, str]) -> dict[str, str]:
    """Name the sounds whose key is their own path; other sounds keep their names.

    A file is named by its stem. Where the name is that of a packaged sound or of another sound of
    the mapping, it is preceded by the folder (``a-phone``), or the suffix is kept (``ring.wav``).

    Parameters
    ----------
    mapping : mapping
        Name of the sound, or the path of its file, to the name of a packaged sound or that path.

    Returns
    -------
    dict
        Distinct names to the names of packaged sounds or the paths, in the order of the mapping.

    Raises
    ------
    UserError
        If two files cannot be told apart by their names and folders.
    """
    given = [key for key, path in mapping.items() if key != path or path in packaged_sounds()]
    files = [path for key, path in mapping.items() if key not in given]
    names = _distinct(files, {*given, *packaged_sounds(), ALL})
    found = iter(names)
    return {key if key in given else next(found): path for key, path in mapping.items()}


def _distinct(files: list[str], taken: set[str]) -> list[str]:
    """Return distinct names of files, each as short as possible, none of which is taken."""
    names = [""] * len(files)
    left = list(range(len(files)))
    for candidate in _CANDIDATES:
        tried = {index: candidate(PurePath(files[index])) for index in left}
        counts = Counter(tried.values())
        for index in left:
            if counts[tried[index]] == 1 and tried[index] not in taken:
                names[index] = tried[index]
        taken = taken | set(names)
        left = [index for index in left if not names[index]]
    if left:
        same = " and ".join(files[index] for index in left)
        raise UserError(
            f"sound: {same} cannot be told apart by names; rename a file, or name the sounds in a "
            "YAML file of the group sound"
        )
    return names


def _with_folder(path: PurePath, name: str) -> str:
    folder = path.parent.name
    return f"{folder}-{name}" if folder not in ("", ".", "..") else name
