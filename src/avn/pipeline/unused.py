"""Products that no finished run needs, and their deletion."""

from __future__ import annotations

import shutil
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from filelock import FileLock, Timeout
from omegaconf import DictConfig

from avn.core.errors import UserError
from avn.pipeline.apartments import PerApartment
from avn.pipeline.observed import observed_stages
from avn.pipeline.run import Evaluation
from avn.pipeline.run_list import run_folders
from avn.pipeline.stage import Stage

# Products of all stages but runs: files of apartments, and folders of networks.
_PRODUCTS = ("generate/*/*.h5", "hear/*/*.h5", "see/*/*.h5", "train/*")


@dataclass(frozen=True)
class Product:
    """Product on the disk.

    Attributes
    ----------
    path : Path
        Its file or folder.
    size : int
        Bytes.
    """

    path: Path
    size: int


def named_runs(outputs: Path, folders: Iterable[Path]) -> list[Path]:
    """Return the folders of runs that the user names.

    Raises
    ------
    UserError
        Where one is no finished run of these outputs.
    """
    known = {folder.resolve(): folder for folder in run_folders(outputs)}
    for folder in (named := list(folders)):
        if folder.resolve() not in known:
            raise UserError(
                f"{folder}: no folder of a finished run in {outputs}; `avn ls` lists them"
            )
    return list(dict.fromkeys(known[folder.resolve()] for folder in named))


def unused_products(outputs: Path, configs: Sequence[DictConfig]) -> list[Product]:
    """Return the products in a folder of outputs that no run needs, the largest first.

    Parameters
    ----------
    outputs : Path
        Folder of outputs.
    configs : sequence of DictConfig
        Config of each run that is kept.
    """
    needed: set[Path] = set()
    for cfg in configs:
        needed |= needed_paths(cfg)
    found = [path for pattern in _PRODUCTS for path in outputs.glob(pattern)]
    unused = [path for path in found if path.name[0] != "." and path.resolve() not in needed]
    return sorted(map(product_of, unused), key=lambda one: (-one.size, one.path))


def needed_paths(cfg: DictConfig) -> set[Path]:
    """Return the files and folders that a run was made from, and those of its films and pages.

    Parameters
    ----------
    cfg : DictConfig
        Config of the run.
    """
    left: list[Stage] = [*Evaluation(cfg).needed, *observed_stages(cfg)]
    visited: set[str] = set()
    paths: set[Path] = set()
    while left:
        stage = left.pop()
        if stage.fingerprint not in visited:
            visited.add(stage.fingerprint)
            left.extend(stage.needed)
            own = stage.paths if isinstance(stage, PerApartment) else [stage.folder]
            paths |= {path.resolve() for path in own}
    return paths


def is_current(folder: Path, cfg: DictConfig) -> bool:
    """Return whether a run is of this version of avn and of its recordings as they are now."""
    return folder.name.endswith(Evaluation(cfg).fingerprint[:8])


def product_of(path: Path) -> Product:
    """Return a product with its size."""
    files = [path] if path.is_file() else path.rglob("*")
    return Product(path, sum(file.lstat().st_size for file in files if not file.is_dir()))


def delete(product: Product) -> bool:
    """Delete a product; return False where another process is making it or has deleted it."""
    lock = FileLock(product.path.parent / f".{product.path.name}.lock")
    try:
        with lock.acquire(timeout=0):
            if product.path.is_dir():
                shutil.rmtree(product.path)
            else:
                product.path.unlink(missing_ok=True)
    except Timeout:
        return False
    return True
