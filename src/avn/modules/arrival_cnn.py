"""Sound network with heads: direction of arrival, length of the path, sight, location."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import torch
from torch import Tensor, nn
from torchmetrics import MeanMetric

from avn.core.errors import UserError
from avn.core.heard import OTHERS, Arrivals, bearing_label, check_bins
from avn.modules.arrival_metrics import ArrivalErrors
from avn.modules.audio_network import FIVE_LAYERS, PictureBatch
from avn.modules.network import SUBSETS, Part
from avn.modules.sound_cnn import SoundCnn

HEADS: Part = {**FIVE_LAYERS, "output_scale": 1.0}
# Factor on the locations, so that all outputs of the last layer are of one size; metres.
_METRES = 5.0
# Bounds of the logarithms of standard deviations.
_LEAST, _MOST = -3.0, 2.5


class ArrivalCnn(SoundCnn):
    """Network that estimates how the sound of a clip arrives.

    The losses of its heads are added: cross-entropy of the direction of arrival, whose label is
    spread over neighbouring bins; Gaussian log-likelihoods of the logarithm of the path's length
    and of the location; cross-entropy of being in sight.

    The number of pairs of source and agent grows with the square of the length between them. A
    network that learns from all of them alike expects the frequent lengths, and hears a source that
    is near as farther away. The loss of the length of a clip has therefore the weight
    (`near_below` / length)^2, at least 1 and at most `near_weight`, so that the logarithms of near
    lengths count evenly.

    Parameters
    ----------
    bins : int
        Directions of arrival, a multiple of 4 from 8 to 252.
    spread : float
        Standard deviation of the label of the direction, degrees, more than 0 and up to 90.
    near_below : float
        Length below which clips have a greater weight, metres, more than 0.
    near_weight : float
        Greatest weight of a clip, 1 or more; 1 for none.
    net : dict
        Config of the network on the spectrogram, with `_target_`.
    **recipe
        Those of `AudioNetwork`.

    Raises
    ------
    UserError
        If a parameter is out of range.
    """

    what = "sound network"
    monitor = "loss/validation"

    def __init__(
        self,
        bins: int = 72,
        spread: float = 5.0,
        near_below: float = 3.0,
        near_weight: float = 8.0,
        net: Part = HEADS,
        **recipe: Any,
    ) -> None:
        check_bins(bins)
        if not 0 < spread <= 90:
            raise UserError(f"sound_model.spread: {spread}; give more than 0 and up to 90 degrees")
        if not 0 < near_below < math.inf:
            raise UserError(f"sound_model.near_below: {near_below}; give metres, more than 0")
        if not 1 <= near_weight < math.inf:
            raise UserError(f"sound_model.near_weight: {near_weight}; give 1 or more, 1 for none")
        self.bins, self.spread = bins, math.radians(spread)
        self.near_below, self.near_weight = near_below, near_weight
        super().__init__(net=net, **recipe)
        self.training_loss = MeanMetric()
        self.losses = [MeanMetric() for _ in SUBSETS]
        self.arrivals: list[ArrivalErrors] = []

    @property
    def outputs(self) -> int:
        """Number of outputs of the last layer."""
        return self.bins + OTHERS

    def location(self, outputs: Tensor) -> Tensor:
        """Return the locations (N, 2) in metres of outputs of the last layer."""
        return Arrivals(self.answer(outputs)).location

    def arrival(self, clips: Tensor) -> Tensor:
        """Estimate how the sound of N clips arrives.

        Parameters
        ----------
        clips : (N, 2, rate) float32 tensor
            Waveforms of the left and the right ear.

        Returns
        -------
        (N, bins + 6) float32 tensor
            See `Arrivals`.
        """
        return self.answer(self.estimate(self.pictures(clips)))

    def answer(self, outputs: Tensor) -> Tensor:
        """Map outputs of the last layer (N, bins + 6) to the numbers of `Arrivals`."""
        raw = Arrivals(outputs)
        return torch.cat(
            (
                raw.bearing.log_softmax(-1),
                raw.distance[:, :1],
                raw.distance[:, 1:].clamp(_LEAST, _MOST).exp(),
                raw.in_sight[:, None],
                raw.location * _METRES,
                raw.location_sigma[:, None].clamp(_LEAST, _MOST).exp(),
            ),
            1,
        )

    def mirror_outputs(self, outputs: Tensor) -> Tensor:
        """Return the outputs for the mirrored clips: bearings and right change their sign."""
        raw = Arrivals(outputs)
        bearing = raw.bearing.flip(-1).roll(1, -1)
        others = outputs[:, self.bins :] * outputs.new_tensor((1, 1, 1, -1, 1, 1))
        return torch.cat((bearing, others), 1)

    def mirror_targets(self, target: Tensor) -> Tensor:
        """Return the targets of the mirrored clips. See `avn.dataset.arrivals`."""
        return target * target.new_tensor((-1, 1, 1, -1, 1))

    def input_of(self, batch: PictureBatch) -> Tensor:
        """Return the network's input for a batch: its spectrograms."""
        return batch["pictures"]

    def loss(self, outputs: Tensor, target: Tensor, in_sight: Tensor) -> Tensor:
        """Compute the sum of the losses of the heads, means over the clips.

        Parameters
        ----------
        outputs : (N, bins + 6) tensor
            Outputs of the last layer.
        target : (N, 5) tensor
            Unit vector of the direction of arrival, right and front, 0 where there is none;
            logarithm of the length of the path in metres; location, metres right and front.
        in_sight : (N,) bool tensor
            Whether the source is in sight.
        """
        arrival, log_length, location = target[:, :2], target[:, 2], target[:, 3:]
        raw, heard = Arrivals(outputs), Arrivals(self.answer(outputs))
        label = bearing_label(arrival, self.bins, self.spread)
        bearing = -(label * heard.bearing).sum(1)
        (mean, sigma) = heard.distance.unbind(1)
        length = 0.5 * ((log_length - mean) / sigma).square() + sigma.log()
        sight = nn.functional.binary_cross_entropy_with_logits(
            raw.in_sight, in_sight.to(outputs.dtype), reduction="none"
        )
        away = (location - heard.location).square().sum(1)
        sigma = heard.location_sigma
        place = 0.5 * away / sigma.square() + 2 * sigma.log()
        near = (self.near_below / log_length.exp()).square().clamp(1.0, self.near_weight)
        return (bearing + sight + 0.5 * place).mean() + (near * length).sum() / near.sum()

    def name_sounds(self, sounds: Sequence[str]) -> None:
        """Set the names of the sounds, by index; metrics are grouped by them."""
        super().name_sounds(sounds)
        self.arrivals = [ArrivalErrors() for _ in SUBSETS]

    def training_step(self, batch: PictureBatch, index: int) -> Tensor:
        """Return the loss, after flip augmentation."""
        pictures, target = self.random_flip(self.input_of(batch), batch["target"])
        loss = self.loss(self._net(pictures), target, batch["in_sight"])
        self.training_loss.update(loss.detach(), len(target))
        return loss

    def validation_step(self, batch: PictureBatch, index: int, dataloader_idx: int = 0) -> None:
        """Add one batch to the metrics of a subset. See `SoundCnn.validation_step`."""
        outputs = self.estimate(self.input_of(batch)).cpu()
        target, in_sight = batch["target"].cpu(), batch["in_sight"].cpu()
        loss = self.loss(outputs, target, in_sight)
        self.losses[dataloader_idx].update(loss, len(target))
        heard = Arrivals(self.answer(outputs))
        self.errors[dataloader_idx].update(
            heard.location, target[:, 3:], in_sight, batch["sound"].cpu()
        )
        self.arrivals[dataloader_idx].update(heard, target, in_sight)

    def on_validation_epoch_end(self) -> None:
        """Log losses and median errors, such as `arrival_deg/validation/out_of_sight`."""
        super().on_validation_epoch_end()
        for subset, errors in zip(SUBSETS, self.arrivals, strict=True):
            found = errors.compute()
            self.keep({f"{k}/{subset}/{v}": value for (k, v), value in found.items()})
            errors.reset()
