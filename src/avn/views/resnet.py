"""`backbone=resnet18` and `resnet50`: ImageNet ResNets, where their weights can be had."""

from __future__ import annotations

import importlib
import importlib.util
import os
import socket
from pathlib import Path
from typing import Any
from urllib.parse import urlparse

import torch

from avn.core.errors import UserError
from avn.core.hashing import digest, file_hash
from avn.views.backbone import Backbone, BackboneConfig, first_line

# Means and standard deviations of ImageNet's channels, 0 to 1, that its ResNets were trained with.
_MEAN, _STD = (0.485, 0.456, 0.406), (0.229, 0.224, 0.225)
# Seconds that the hub has to answer before it counts as out of reach.
_PATIENCE = 5.0
# Files of a folder that say what a ResNet computes.
_WEIGHTS = (".json", ".safetensors", ".bin")


class ResNet(Backbone):
    """A ResNet as transformers loads it, from the Hugging Face hub or a folder.

    512 features (18 layers) or 2048 (50). He et al., "Deep residual learning for image
    recognition", CVPR 2016.
    """

    def __init__(self, cfg: BackboneConfig) -> None:
        super().__init__(cfg)
        source = _source(cfg)
        if importlib.util.find_spec("transformers") is None:
            raise UserError(
                f"backbone={cfg.name} needs the package transformers; run `pip install "
                "'avn[resnet]'`, or use backbone=efficientnet_lite0"
            )
        self._net = _from_pretrained(source, cfg)
        self._net.eval()
        self._mean = 255 * torch.tensor(_MEAN)[:, None, None]
        self._std = 255 * torch.tensor(_STD)[:, None, None]

    @classmethod
    def weights(cls, cfg: BackboneConfig) -> str:
        """Hash of the files of a folder, or of the name on the hub."""
        source = _source(cfg)
        if not Path(source).is_dir():
            return digest(source)
        kept = [p for p in sorted(Path(source).iterdir()) if p.suffix in _WEIGHTS]
        return digest([(path.name, file_hash(path)) for path in kept])

    def pooled(self, pixels: torch.Tensor) -> torch.Tensor:
        """See `Backbone.pooled`."""
        found: torch.Tensor = self._net((pixels - self._mean) / self._std).pooler_output
        return found.flatten(1)


def _source(cfg: BackboneConfig) -> str:
    if not cfg.source:
        raise UserError(
            "backbone.source is not set; give the name of a ResNet on the Hugging Face hub, such "
            "as microsoft/resnet-18, or a folder"
        )
    # What looks like a path and is none is not looked for on the hub.
    if cfg.source.startswith((".", "/", "~")) or cfg.source.count("/") > 1:
        path = Path(cfg.source).expanduser()
        if not path.is_dir():
            raise UserError(
                f"backbone.source={cfg.source}: no such folder; give one with config.json and "
                "weights, or a name on the Hugging Face hub"
            )
        return str(path)
    return cfg.source


def _from_pretrained(source: str, cfg: BackboneConfig) -> torch.nn.Module:
    """The network, from a folder, from what the hub's client keeps, or from the hub."""
    if (folder := Path(source)).is_dir() and not (folder / "config.json").is_file():
        raise _cannot_be_had(cfg, "the folder has no config.json")
    # Here, for it takes seconds, and is not there unless it was asked for.
    transformers: Any = importlib.import_module("transformers")
    transformers.logging.set_verbosity_error()
    transformers.logging.disable_progress_bar()
    local = {"local_files_only": True, "output_loading_info": True}
    try:
        try:
            net, report = transformers.ResNetModel.from_pretrained(source, **local)
        except OSError:
            if Path(source).is_dir() or not _hub_answers():
                raise
            net, report = transformers.ResNetModel.from_pretrained(source, output_loading_info=True)
    except Exception as error:  # damaged files show as almost any kind of exception
        raise _cannot_be_had(cfg, first_line(error)) from error
    if report["missing_keys"]:
        raise _cannot_be_had(cfg, f"{len(report['missing_keys'])} of its weights are missing")
    if not isinstance(net.config, transformers.ResNetConfig):
        raise _cannot_be_had(cfg, f"it is no ResNet but '{net.config.model_type}'")
    loaded: torch.nn.Module = net
    return loaded


def _cannot_be_had(cfg: BackboneConfig, why: str) -> UserError:
    return UserError(
        f"backbone.source={cfg.source}: the weights cannot be had ({why.rstrip('.')}); give a "
        "folder with config.json and weights, get online, or use backbone=efficientnet_lite0"
    )


def _hub_answers() -> bool:
    """Whether the hub can be reached; its own client tries for half a minute before it says no."""
    if os.environ.get("HTTPS_PROXY") or os.environ.get("https_proxy"):
        return True
    url = urlparse(os.environ.get("HF_ENDPOINT", "https://huggingface.co"))
    port = url.port or (80 if url.scheme == "http" else 443)
    try:
        socket.create_connection((url.hostname or "", port), timeout=_PATIENCE).close()
    except OSError:
        return False
    return True
