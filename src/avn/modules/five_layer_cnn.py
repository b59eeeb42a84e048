"""Convolutional network on spectrograms with a small output vector."""

from __future__ import annotations

from collections.abc import Sequence

from torch import nn

from avn.core.errors import UserError
from avn.modules.audio_cnn import AudioCnn


class FiveLayerCnn(AudioCnn):
    """CNN of 3 x 3 convolutions that each halve the resolution, followed by dense layers.

    Each block is convolution, ReLU, downsampling and batch normalisation. Widths 64-128-256-512-512
    with max-pooling, dense layers 4096-1000 and tanh are those of the code released with Gan et
    al., "Look, Listen, and Act" (ICRA 2020).

    Parameters
    ----------
    channels, height, width : int
        Shape of the input.
    widths : sequence of int
        Output channels of each convolution, 1 or more each.
    hidden : sequence of int
        Sizes of the dense layers before the output layer, 1 or more each.
    pool : {"stride", "max"}
        Downsampling: convolution of stride 2, or stride 1 followed by max-pooling.
    tanh : bool
        Whether tanh bounds the outputs to +-`output_scale`.
    dropout : float
        Dropout probability before each dense layer, 0 or more and less than 1.
    output_scale : float
        Factor on the outputs, more than 0; in metres where the outputs are a location.
    outputs : int
        Number of outputs.

    Raises
    ------
    UserError
        Where a parameter is out of range or the input is too small for the number of halvings.
    """

    def __init__(
        self,
        channels: int,
        height: int,
        width: int,
        widths: Sequence[int] = (16, 32, 64, 128, 128),
        hidden: Sequence[int] = (128,),
        pool: str = "stride",
        tanh: bool = False,
        dropout: float = 0.25,
        output_scale: float = 10.0,
        outputs: int = 2,
    ) -> None:
        super().__init__()
        if min([*widths, *hidden], default=1) < 1:
            raise UserError("net: widths and hidden are 1 or more each")
        if not (0 <= dropout < 1 and output_scale > 0):
            raise UserError("net: dropout is 0 to 1 and output_scale over 0")
        if pool not in ("stride", "max"):
            raise UserError(f"net.pool is '{pool}'; give stride or max")
        if min(height, width) < 2 ** len(widths) and pool == "max":
            raise UserError(
                f"spectrogram: {height} x {width} is too small for {len(widths)} "
                "halvings; raise bands and frames"
            )
        self.output_scale = output_scale
        layers: list[nn.Module] = [nn.BatchNorm2d(channels)]
        for before, after in zip((channels, *widths), widths, strict=False):
            stride = 2 if pool == "stride" else 1
            layers += [nn.Conv2d(before, after, 3, stride, padding=1), nn.ReLU()]
            layers += [nn.MaxPool2d(2)] if pool == "max" else []
            layers += [nn.BatchNorm2d(after)]
            # A convolution of stride 2 rounds up, max-pooling down.
            height, width = ((n + 1) // 2 if stride == 2 else n // 2 for n in (height, width))
        layers.append(nn.Flatten())
        size = height * width * widths[-1]
        for wide in hidden:
            layers += [nn.Dropout(dropout), nn.Linear(size, wide), nn.ReLU()]
            size = wide
        self.hidden_size, self.answer_from = size, len(layers)
        layers += [nn.Dropout(dropout), nn.Linear(size, outputs)]
        layers += [nn.Tanh()] if tanh else []
        self.layers = nn.Sequential(*layers)
