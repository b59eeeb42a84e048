"""Pictures as another camera, another light and another decorator might have made them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import torch
from torch import Tensor, nn


@dataclass
class AugmentConfig:
    """How strongly views are changed in training; 0 leaves a thing as it is.

    Attributes
    ----------
    colour : float
        Turn of the hue, change of saturation and gain of each channel; 1 allows any hue.
    light : float
        Brightness, contrast and gamma, as powers of 2.
    noise : float
        Greatest standard deviation of noise, of a range of 1.
    blur : float
        Share of pictures that are blurred.
    erase : int
        Most rectangles that are painted over.
    shift : int
        Most pixels by which a picture is moved.
    """

    colour: float = 1.0
    light: float = 1.0
    noise: float = 0.04
    blur: float = 0.3
    erase: int = 2
    shift: int = 2


def augment(pictures: Tensor, config: AugmentConfig, generator: torch.Generator) -> Tensor:
    """Change each picture in a way of its own.

    Parameters
    ----------
    pictures : (N, 3, H, W) float32 tensor
        0 to 1.
    config : AugmentConfig
    generator : torch.Generator
        Draws what is done.

    Returns
    -------
    (N, 3, H, W) float32 tensor
        0 to 1.
    """
    count = len(pictures)

    def draw(low: float, high: float, *shape: int) -> Tensor:
        size = shape or (count, 1, 1, 1)
        return low + (high - low) * torch.rand(size, generator=generator)

    changed = pictures
    if config.colour:
        changed = _recolour(changed, config.colour, draw)
    if config.light:
        reach = config.light
        changed = changed.clamp(1e-4, 1.0) ** (2 ** draw(-0.7 * reach, 0.7 * reach))
        mean = changed.mean((1, 2, 3), keepdim=True)
        changed = (changed - mean) * 2 ** draw(-0.7 * reach, 0.5 * reach) + mean
        changed = changed * 2 ** draw(-0.7 * reach, 0.5 * reach)
    if config.shift:
        changed = _shift(changed, config.shift, generator)
    if config.blur:
        weights = changed.new_tensor((0.25, 0.5, 0.25))
        kernel = (weights[:, None] * weights).expand(3, 1, 3, 3)
        soft = nn.functional.conv2d(
            nn.functional.pad(changed, (1, 1, 1, 1), mode="replicate"), kernel, groups=3
        )
        changed = torch.where(draw(0, 1) < config.blur, soft, changed)
    if config.erase:
        changed = _erase(changed, config.erase, draw)
    if config.noise:
        noise = torch.randn(changed.shape, generator=generator)
        changed = changed + noise * draw(0, config.noise)
    return changed.clamp(0.0, 1.0)


def _recolour(pictures: Tensor, strength: float, draw) -> Tensor:  # type: ignore[no-untyped-def]
    """Turn colours round the axis of greys, fade or deepen them, and tint the light."""
    count = len(pictures)
    angle = draw(-math.pi * strength, math.pi * strength, count)
    saturation = draw(1 - strength, 1 + 0.5 * strength, count)
    grey = pictures.new_full((3, 3), 1 / 3)
    cross = pictures.new_tensor(((0, -1, 1), (1, 0, -1), (-1, 1, 0))) / math.sqrt(3)
    turn = torch.cos(angle)[:, None, None] * (torch.eye(3) - grey)
    turn = turn + torch.sin(angle)[:, None, None] * cross
    mix = grey + saturation[:, None, None] * turn
    tint = 2 ** draw(-0.4 * strength, 0.4 * strength, count, 3)
    mix = mix * tint[:, :, None]
    return torch.einsum("nij,njhw->nihw", mix, pictures).clamp(0.0, 1.0)


def _shift(pictures: Tensor, most: int, generator: torch.Generator) -> Tensor:
    """Move each picture by whole pixels; what comes in repeats the edge."""
    count, _, height, width = pictures.shape
    steps = torch.randint(-most, most + 1, (2, count), generator=generator)
    rows = (torch.arange(height) + steps[0][:, None]).clamp(0, height - 1)
    columns = (torch.arange(width) + steps[1][:, None]).clamp(0, width - 1)
    which = torch.arange(count)[:, None, None]
    moved = pictures.permute(0, 2, 3, 1)[which, rows[:, :, None], columns[:, None, :]]
    return moved.permute(0, 3, 1, 2)


def _erase(pictures: Tensor, most: int, draw) -> Tensor:  # type: ignore[no-untyped-def]
    """Paint over small rectangles."""
    count, _, height, width = pictures.shape
    row, column = torch.arange(height)[:, None], torch.arange(width)
    for _ in range(most):
        top, left = draw(-0.1, 1) * height, draw(-0.1, 1) * width
        tall, wide = draw(0, 0.2) * height, draw(0, 0.2) * width
        inside = (row >= top) & (row < top + tall) & (column >= left) & (column < left + wide)
        pictures = torch.where(inside, draw(0, 1, count, 3, 1, 1), pictures)
    return pictures
