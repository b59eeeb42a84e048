"""Trained networks that come with the package, each found by the fingerprint of its training.

`assets/networks` has a file of weights and a model card for each network, and `index.json` with
its fingerprint, metrics and hash. Weights with two or more dimensions are stored in 16 bits; the
figures of a published network are measured with these.
"""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any

from avn.core.errors import UserError

if TYPE_CHECKING:
    from torch import Tensor

FOLDER = Path(__file__).parents[1] / "assets" / "networks"
INDEX = "index.json"
# Values of `networks`.
TRAINED, PUBLISHED = "trained", "published"
# Split in whose apartments all networks of the package are trained.
SCENES = "var"


@dataclass(frozen=True)
class PublishedNetwork:
    """Network of the package.

    Attributes
    ----------
    name : str
        Name of its files, without suffix.
    title : str
        Description of the network.
    sha256 : str
        Hash of the file of weights.
    metrics : dict
        Metrics of the training by name.
    """

    name: str
    title: str
    sha256: str
    metrics: dict[str, Any]

    @property
    def path(self) -> Path:
        """File of weights."""
        return FOLDER / f"{self.name}.safetensors"

    def weights(self) -> dict[str, Tensor]:
        """Read the weights by name, as float32.

        Raises
        ------
        UserError
            If the file is missing or damaged.
        """
        from safetensors.torch import load

        try:
            content = self.path.read_bytes()
        except OSError:
            raise _damaged(self.path) from None
        if sha256(content).hexdigest() != self.sha256:
            raise _damaged(self.path)
        return {
            name: own.float() if own.is_floating_point() else own
            for name, own in load(content).items()
        }


def published_networks() -> dict[str, PublishedNetwork]:
    """Return the networks of the package by the fingerprint of their training."""
    return _read(FOLDER / INDEX)


def published_network(fingerprint: str, title: str, scenes: str) -> PublishedNetwork:
    """Return the network of the package that a training would make.

    Parameters
    ----------
    fingerprint : str
        Fingerprint of the training.
    title : str
        Title of the training, for messages.
    scenes : str
        Name of the split of its training world, for messages.

    Raises
    ------
    UserError
        If the package has no such network.
    """
    known = published_networks()
    if fingerprint not in known:
        other = f"training.scenes={SCENES}, the split of all of them, or "
        raise UserError(
            f"networks=published: the package has no {title} of these settings; {_seeds(title)}"
            f"give {other if scenes != SCENES else ''}networks=trained, or the settings of a "
            f"network of {FOLDER}"
        )
    return known[fingerprint]


def _seeds(title: str) -> str:
    """Return the seeds of training with which the package has a network, if not with this one."""
    titles = [own.title for own in published_networks().values()]
    seed = re.compile(r"train_seed (\d+)")
    same = [own for own in titles if seed.sub("", own) == seed.sub("", title)]
    seeds = sorted({number for own in same for number in seed.findall(own)}, key=int)
    if not seeds or title in same:
        return ""
    return f"of this name it has train_seed {', '.join(seeds)}; "


def check_networks(value: str) -> None:
    """Raise `UserError` where a value of `networks` is unknown."""
    if value not in (TRAINED, PUBLISHED):
        raise UserError(f"networks: '{value}' is none of {TRAINED}, {PUBLISHED}")


@cache
def _read(path: Path) -> dict[str, PublishedNetwork]:
    try:
        entries = json.loads(path.read_text(encoding="utf-8"))
        return {entry.pop("fingerprint"): PublishedNetwork(**entry) for entry in entries}
    except (OSError, ValueError, TypeError, KeyError):
        raise _damaged(path) from None


def _damaged(path: Path) -> UserError:
    return UserError(f"{path}: missing or damaged; install the package again")
