"""Folders of the caches of other libraries, where their own places cannot be written to.

An installation may be read-only, and its user may have no home: in a container, or in the job of a
batch system. Numba then refuses to compile, Matplotlib warns, and PyTorch fails for a user without
a name.
"""

from __future__ import annotations

import os
import stat
import tempfile
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

_PACKAGE = Path(__file__).resolve().parents[1]


def choose_cache_folders() -> None:
    """Set the environment variables of cache folders that are not set and have no usable place.

    To be called before Numba, Matplotlib and PyTorch are imported. The places are tried in this
    order: that of the library, the cache folder of the user, the temporary folder. Without any,
    Numba compiles in each process anew.
    """
    if "NUMBA_CACHE_DIR" not in os.environ and not all(map(_writable, _pycaches())):
        if folder := _folder("numba"):
            os.environ["NUMBA_CACHE_DIR"] = folder
        else:
            _compile_without_cache()
    home = _home()
    config = os.environ.get("XDG_CONFIG_HOME") or (home and home / ".config")
    if not (config and _writable(Path(config) / "matplotlib")):
        _set("MPLCONFIGDIR", _folder("matplotlib"))
    if home is None:
        _set("TORCHINDUCTOR_CACHE_DIR", _folder("torchinductor"))
        _set("TRITON_CACHE_DIR", _folder("triton"))


def _set(name: str, folder: str | None) -> None:
    if folder:
        os.environ.setdefault(name, folder)


def _pycaches() -> Iterator[Path]:
    """Return the folders of Numba's files beside the modules of the package."""
    for folder in _PACKAGE.iterdir():
        if (folder / "__init__.py").is_file():
            yield folder / "__pycache__"


def _writable(folder: Path) -> bool:
    """Return whether a folder can be written to, or made."""
    while not folder.exists() and folder != folder.parent:
        folder = folder.parent
    return folder.is_dir() and os.access(folder, os.W_OK | os.X_OK)


def _home() -> Path | None:
    """Return the home of the user, None where there is none that can be written to."""
    with suppress(RuntimeError):
        home = Path.home()
        if home.is_absolute() and home.is_dir() and _writable(home):
            return home
    return None


def _folder(name: str) -> str | None:
    """Make a cache folder that only this user can write to; None where none can be made."""
    home = _home()
    user = os.environ.get("XDG_CACHE_HOME") or (home and home / ".cache")
    places = [Path(user) / "avn"] if user else []
    with suppress(OSError):  # without any temporary folder
        places.append(Path(tempfile.gettempdir()) / f"avn-{os.getuid()}")
    for place in places:
        with suppress(OSError):
            place.mkdir(mode=0o700, parents=True, exist_ok=True)
            own = place.lstat()
            # what is read from there is executed
            mine = stat.S_ISDIR(own.st_mode) and own.st_uid == os.getuid()
            if mine and not own.st_mode & 0o022:
                (place / name).mkdir(exist_ok=True)
                if _writable(place / name):
                    return str(place / name)
    return None


def _compile_without_cache() -> None:
    from numba.core.dispatcher import Dispatcher

    Dispatcher.enable_caching = lambda self: None  # type: ignore[method-assign]
