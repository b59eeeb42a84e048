"""Parameters and RMSProp moments that all workers share, each laid out as one vector."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import torch
from torch import Tensor, nn


def flatten_parameters(network: nn.Module) -> tuple[Tensor, Tensor]:
    """Lay all parameters of a network out in one vector, and their gradients in another.

    The parameters become views of the first vector, so that one copy changes them all.

    Returns
    -------
    weights, gradients : (P,) tensors
    """
    parameters = list(network.parameters())
    weights = torch.cat([p.detach().flatten() for p in parameters])
    gradients, begin = torch.zeros_like(weights), 0
    for parameter in parameters:
        end = begin + parameter.numel()
        parameter.data = weights[begin:end].view_as(parameter)
        parameter.grad = gradients[begin:end].view_as(parameter)
        begin = end
    return weights, gradients


@dataclass
class SharedState:
    """What workers read and write in turn.

    Attributes
    ----------
    weights, moments : (P,) float32 tensors in shared memory
        Parameters, and running means of squared gradients.
    updates : (1,) int64 tensor in shared memory
        Gradients that were applied.
    """

    weights: Tensor
    moments: Tensor
    updates: Tensor

    @classmethod
    def of(cls, weights: Tensor) -> SharedState:
        """A state with these weights, no moments and no updates."""
        tensors = (weights.clone(), torch.zeros_like(weights), torch.zeros(1, dtype=torch.int64))
        return cls(*(tensor.share_memory_() for tensor in tensors))

    def apply(
        self, gradients: Tensor, rate: Callable[[int], float], alpha: float, eps: float
    ) -> None:
        """One step of RMSProp (not centred, no momentum), as `torch.optim.RMSprop` makes it.

        Parameters
        ----------
        gradients : (P,) tensor
        rate : callable
            Learning rate after so many updates.
        """
        self.moments.mul_(alpha).addcmul_(gradients, gradients, value=1 - alpha)
        lr = rate(int(self.updates))
        self.weights.addcdiv_(gradients, self.moments.sqrt().add_(eps), value=-lr)
        self.updates += 1
