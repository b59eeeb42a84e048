"""Base class of convolutional networks on spectrograms whose last hidden layer is an embedding."""

from __future__ import annotations

from torch import Tensor, nn


class AudioCnn(nn.Module):
    """Network of layers in sequence, which a subclass builds.

    Attributes
    ----------
    layers : Sequential
        All layers.
    answer_from : int
        Index of the first layer behind the last hidden one.
    hidden_size : int
        Size of the last hidden layer.
    output_scale : float
        Factor on the outputs.
    """

    layers: nn.Sequential
    answer_from: int
    hidden_size: int
    output_scale: float

    def forward(self, pictures: Tensor) -> Tensor:
        """Map inputs (N, channels, height, width) to outputs (N, outputs)."""
        return self.layers(pictures) * self.output_scale

    def hidden(self, pictures: Tensor) -> Tensor:
        """Return the input of the output layer, (N, `hidden_size`)."""
        return self.layers[: self.answer_from](pictures)

    def answer(self, hidden: Tensor) -> Tensor:
        """Apply the output layer to the result of `hidden`; gives (N, outputs) as `forward`."""
        return self.layers[self.answer_from :](hidden) * self.output_scale
