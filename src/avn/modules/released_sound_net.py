"""Sound network of the code released by the paper's authors, in any size."""

from __future__ import annotations

from collections.abc import Sequence

from torch import nn

from avn.core.errors import UserError
from avn.modules.audio_cnn import AudioCnn

# Batch normalisation of Keras: its epsilon, and its momentum of 0.99 as PyTorch counts it.
EPSILON, MOMENTUM = 1e-3, 0.01


class ReleasedSoundNet(AudioCnn):
    """CNN of 3 x 3 convolutions with max-pooling, followed by dense layers and tanh.

    Each block is convolution of stride 1, ReLU, max-pooling by 2 and batch normalisation. The
    input is not normalised. Each hidden dense layer is followed by ReLU and batch normalisation.
    The defaults are the network of the code released with Gan et al., "Look, Listen, and Act"
    (ICRA 2020), for two channels of 128 x 128.

    Parameters
    ----------
    channels, height, width : int
        Shape of the input.
    widths : sequence of int
        Output channels of each convolution, 1 or more each.
    hidden : sequence of int
        Sizes of the dense layers before the output layer, 1 or more each.
    dropout : sequence of float
        Dropout probability before each dense layer, the output layer included; 0 or more and less
        than 1.
    padding : int
        Padding of the convolutions; 0 in the released code.
    output_scale : float
        Factor on the outputs, more than 0; in metres where the outputs are a location.
    tanh : bool
        Whether tanh bounds the outputs to +-`output_scale`.
    outputs : int
        Number of outputs.

    Raises
    ------
    UserError
        Where a parameter is out of range or the input is too small for the number of blocks.
    """

    def __init__(
        self,
        channels: int,
        height: int,
        width: int,
        widths: Sequence[int] = (64, 128, 256, 512, 512),
        hidden: Sequence[int] = (4096, 1000),
        dropout: Sequence[float] = (0.25, 0.25, 0.4),
        padding: int = 0,
        output_scale: float = 10.0,
        tanh: bool = True,
        outputs: int = 2,
    ) -> None:
        super().__init__()
        if min([*widths, *hidden], default=1) < 1 or padding < 0 or output_scale <= 0:
            raise UserError("net: widths, hidden and output_scale are over 0, padding 0 or more")
        if len(dropout) != len(hidden) + 1 or not all(0 <= own < 1 for own in dropout):
            raise UserError("net.dropout: one probability, 0 to 1, for each dense layer and output")
        layers: list[nn.Module] = []
        for before, after in zip((channels, *widths), widths, strict=False):
            height, width = ((size + 2 * padding - 2) // 2 for size in (height, width))
            if min(height, width) < 1:
                raise UserError(f"spectrogram: too small for {len(widths)} halvings; raise bands")
            layers += [nn.Conv2d(before, after, 3, padding=padding), nn.ReLU()]
            layers += [nn.MaxPool2d(2), nn.BatchNorm2d(after, EPSILON, MOMENTUM)]
        layers.append(nn.Flatten())
        size = height * width * widths[-1]
        for wide, share in zip(hidden, dropout, strict=False):
            layers += [nn.Dropout(share), nn.Linear(size, wide), nn.ReLU()]
            layers += [nn.BatchNorm1d(wide, EPSILON, MOMENTUM)]
            size = wide
        self.output_scale, self.hidden_size, self.answer_from = output_scale, size, len(layers)
        layers += [nn.Dropout(dropout[-1]), nn.Linear(size, outputs), *([nn.Tanh()] * tanh)]
        self.layers = nn.Sequential(*layers)
