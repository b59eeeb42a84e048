"""Parameters and RMSProp moments that workers share, one vector each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import torch
from torch import Tensor, nn


def flatten_parameters(network: nn.Module) -> tuple[Tensor, Tensor]:
    """Concatenate the parameters of a network in one vector, and their gradients in another.

    The parameters and their gradients become views of the vectors.

    Parameters
    ----------
    network : nn.Module
        Changed in place.

    Returns
    -------
    weights, gradients : (P,) tensors
        Parameters, and gradients set to 0.
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
    """Weights and optimiser state that workers share.

    Attributes
    ----------
    weights, moments : (P,) float32 tensors
        Parameters, and running means of squared gradients.
    updates : (1,) int64 tensor
        Number of applied gradients.
    """

    weights: Tensor
    moments: Tensor
    updates: Tensor

    @classmethod
    def of(cls, weights: Tensor) -> SharedState:
        """Create a state with copies of weights, moments of 0 and no updates."""
        return cls(weights.clone(), torch.zeros_like(weights), torch.zeros(1, dtype=torch.int64))

    def move_to(self, file: Path) -> None:
        """Move the state to a file that processes map into memory, so that they share it.

        Shared memory of the system would not do: that of a container has 64 MB by default.
        """
        mapped = self.mapped(file, len(self.weights))
        for name, tensor in vars(mapped).items():
            tensor.copy_(getattr(self, name))
            setattr(self, name, tensor)

    @classmethod
    def mapped(cls, file: Path, count: int) -> SharedState:
        """Map the file of `move_to`, made if missing, into memory.

        Parameters
        ----------
        file : Path
            The file; it may be deleted once all processes have mapped it.
        count : int
            Number of parameters P.
        """
        # the number of updates as the first 8 bytes, in the size of two numbers
        numbers = torch.from_file(str(file), shared=True, size=2 + 2 * count, dtype=torch.float32)
        updates, weights, moments = numbers.split([2, count, count])
        return cls(weights, moments, updates.view(torch.int64))

    def apply(
        self, gradients: Tensor, rate: Callable[[int], float], alpha: float, eps: float
    ) -> None:
        """Apply one step of RMSProp, not centred and without momentum, as `torch.optim.RMSprop`.

        Parameters
        ----------
        gradients : (P,) tensor
            Gradients of the loss.
        rate : callable
            Maps the number of applied gradients to the learning rate.
        alpha : float
            Smoothing constant of the moments, 0 to 1.
        eps : float
            Constant that is added to the root of the moments.
        """
        self.moments.mul_(alpha).addcmul_(gradients, gradients, value=1 - alpha)
        lr = rate(int(self.updates))
        self.weights.addcdiv_(gradients, self.moments.sqrt().add_(eps), value=-lr)
        self.updates += 1
