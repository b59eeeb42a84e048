"""`backbone=resnet18` and `backbone=resnet50`: ImageNet ResNets, if weights are available."""

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
from avn.views.backbone import Backbone, first_line
from avn.views.settings import BackboneConfig

# Channel means and standard deviations of the ResNets' training images, 0 to 1.
_MEAN, _STD = (0.485, 0.456, 0.406), (0.229, 0.224, 0.225)
# Timeout in seconds of the connection to the hub.
_PATIENCE = 5.0
# Suffixes of the files that define a ResNet.
_WEIGHTS = (".json", ".safetensors", ".bin")


class ResNet(Backbone):
    """ResNet pretrained on ImageNet, loaded by transformers from the hub or a folder.

    It has 512 features with 18 layers and 2048 with 50. He et al., "Deep residual learning for
    image recognition", CVPR 2016.
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
        """Return a hash of the files of a folder, or of the name on the hub."""
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
    # A source that looks like a path must be a folder; it is not requested from the hub.
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
    """Load the network from a folder, from the hub's local cache, or from the hub."""
    if (folder := Path(source)).is_dir() and not (folder / "config.json").is_file():
        raise _cannot_be_had(cfg, "the folder has no config.json")
    # Imported here because it takes seconds and is an optional dependency.
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
    except Exception as error:  # damaged files raise almost any kind of exception
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
    """Test if the hub is reachable; its own client takes half a minute to give up."""
    if os.environ.get("HTTPS_PROXY") or os.environ.get("https_proxy"):
        return True
    url = urlparse(os.environ.get("HF_ENDPOINT", "https://huggingface.co"))
    port = url.port or (80 if url.scheme == "http" else 443)
    try:
        socket.create_connection((url.hostname or "", port), timeout=_PATIENCE).close()
    except OSError:
        return False
    return True
