"""Settings of the training of networks; importing them needs no torch."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

# Files of the best and of the last epoch in the folder of a training.
BEST, LAST = "best.ckpt", "last.ckpt"


@dataclass
class OptimizerConfig:
    """Optimiser: a class of torch.optim that takes `lr` and `weight_decay`.

    Attributes
    ----------
    _target_ : str
        Module and name of the optimiser's class.
    lr : float
        Peak learning rate.
    weight_decay : float
        Weight decay coefficient.
    """

    _target_: str = "torch.optim.AdamW"
    lr: float = 2e-3
    weight_decay: float = 1e-2


@dataclass
class AugmentConfig:
    """Strength of each image augmentation of training views; 0 turns one off.

    Attributes
    ----------
    colour : float
        Range of hue rotation, saturation and channel gain, 0 to 1; 1 allows any hue.
    light : float
        Range of brightness, contrast and gamma, in factors of up to 2^0.7 at 1.
    noise : float
        Maximum standard deviation of Gaussian noise, where pixel values are 0 to 1.
    blur : float
        Probability that a picture is blurred.
    erase : int
        Number of random rectangles that are painted over.
    shift : int
        Maximum translation in pixels.
    """

    colour: float = 1.0
    light: float = 1.0
    noise: float = 0.04
    blur: float = 0.3
    erase: int = 2
    shift: int = 2


@dataclass
class TrainerConfig:
    """Settings of the Lightning trainer of all networks but actor-critics.

    Attributes
    ----------
    accelerator : str
        Lightning's name of the kind of device: auto, cpu, gpu, mps.
    devices : int or list of int
        1, or the index of one device in brackets, such as [1]. A network is trained on one device.
    precision : str
        Number format of the arithmetic: 32-true, bf16-mixed, or 16-mixed on a GPU.
    max_epochs : int, optional
        Maximum number of epochs, 1 or more; by default the `epochs` of each network's recipe.
    gradient_clip_val : float, optional
        Largest norm of a gradient, to which longer ones are scaled; null for no limit.
    overfit_batches : int
        If above 0, every epoch consists of the same batches, this many, and there is no early
        stopping, to see whether the network can learn them by heart. For `avn.train` alone.
    fast_dev_run : int
        If above 0, `avn.train` makes only this many batches, to show that a training works, and
        keeps nothing.
    profiler : str, optional
        Lightning's profiler, simple, advanced or pytorch; its report is a file in the folder of
        the training.
    """

    accelerator: str = "auto"
    devices: Any = 1
    precision: str = "32-true"
    max_epochs: int | None = None
    gradient_clip_val: float | None = None
    overfit_batches: int = 0
    fast_dev_run: int = 0
    profiler: str | None = None


# Settings of the trainer that change no weights, but for the rounding of another device.
SAME_WEIGHTS = ("accelerator", "devices", "profiler", "fast_dev_run")
# Settings of the trainer that are for the network that `avn.train` names, and for no other.
OF_ONE = ("overfit_batches", "fast_dev_run")
