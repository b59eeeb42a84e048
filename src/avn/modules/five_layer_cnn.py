"""Convolutional network on spectrograms with a small output vector."""

from __future__ import annotations

from collections.abc import Sequence

from torch import nn

from avn.core.errors import UserError
from avn.modules.audio_cnn import AudioCnn


class FiveLayerCnn(AudioCnn):
    """CNN of 3 x 3 convolutions that each halve the resolution, followed by dense layers.

    Each block is convolution, ReLU and batch normalisation.

    Parameters
    ----------
    channels, height, width : int
        Shape of the input.
    widths : sequence of int
        Output channels of each convolution, 1 or more each.
    hidden : sequence of int
        Sizes of the dense layers before the output layer, 1 or more each.
    dropout : float
        Dropout probability before each dense layer, 0 or more and less than 1.
    output_scale : float
        Factor on the outputs, more than 0; in metres where the outputs are a location.
    outputs : int
        Number of outputs.

    Raises
    ------
    UserError
        Where a parameter is out of range.
    """

    def __init__(
        self,
        channels: int,
        height: int,
        width: int,
        widths: Sequence[int] = (16, 32, 64, 128, 128),
        hidden: Sequence[int] = (128,),
        dropout: float = 0.25,
        output_scale: float = 10.0,
        outputs: int = 2,
    ) -> None:
        super().__init__()
        if min([*widths, *hidden], default=1) < 1:
            raise UserError("net: widths and hidden are 1 or more each")
        if not (0 <= dropout < 1 and output_scale > 0):
            raise UserError("net: dropout is 0 to 1 and output_scale over 0")
        self.output_scale = output_scale
        layers: list[nn.Module] = [nn.BatchNorm2d(channels)]
        for before, after in zip((channels, *widths), widths, strict=False):
            layers += [nn.Conv2d(before, after, 3, 2, padding=1), nn.ReLU(), nn.BatchNorm2d(after)]
            height, width = (height + 1) // 2, (width + 1) // 2
        layers.append(nn.Flatten())
        size = height * width * widths[-1]
        for wide in hidden:
            layers += [nn.Dropout(dropout), nn.Linear(size, wide), nn.ReLU()]
            size = wide
        self.hidden_size, self.answer_from = size, len(layers)
        layers += [nn.Dropout(dropout), nn.Linear(size, outputs)]
        self.layers = nn.Sequential(*layers)
