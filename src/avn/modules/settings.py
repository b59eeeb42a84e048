"""Settings of the training of networks; importing them needs no torch."""

from __future__ import annotations

from dataclasses import dataclass

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
