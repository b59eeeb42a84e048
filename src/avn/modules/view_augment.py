"""Image augmentation of views: colour, light, noise, blur, erasing, shifts."""

from __future__ import annotations

import math

import torch
from torch import Tensor, nn

from avn.modules.settings import AugmentConfig


def augment(pictures: Tensor, config: AugmentConfig, generator: torch.Generator) -> Tensor:
    """Augment each picture with its own random parameters.

    Parameters
    ----------
    pictures : (N, 3, H, W) float32 tensor
        RGB, 0 to 1.
    config : AugmentConfig
        Strength of each augmentation.
    generator : torch.Generator
        Source of randomness.

    Returns
    -------
    (N, 3, H, W) float32 tensor
        RGB, 0 to 1.
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
    """Rotate hues about the grey axis, scale the saturation and scale the channels."""
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
    """Translate each picture by whole pixels; the border repeats the edge."""
    count, _, height, width = pictures.shape
    steps = torch.randint(-most, most + 1, (2, count), generator=generator)
    rows = (torch.arange(height) + steps[0][:, None]).clamp(0, height - 1)
    columns = (torch.arange(width) + steps[1][:, None]).clamp(0, width - 1)
    index = torch.arange(count)[:, None, None]
    moved = pictures.permute(0, 2, 3, 1)[index, rows[:, :, None], columns[:, None, :]]
    return moved.permute(0, 3, 1, 2)


def _erase(pictures: Tensor, most: int, draw) -> Tensor:  # type: ignore[no-untyped-def]
    """Paint small rectangles of random colour over each picture."""
    count, _, height, width = pictures.shape
    row, column = torch.arange(height)[:, None], torch.arange(width)
    for _ in range(most):
        top, left = draw(-0.1, 1) * height, draw(-0.1, 1) * width
        tall, wide = draw(0, 0.2) * height, draw(0, 0.2) * width
        inside = (row >= top) & (row < top + tall) & (column >= left) & (column < left + wide)
        pictures = torch.where(inside, draw(0, 1, count, 3, 1, 1), pictures)
    return pictures
