"""Print the hashes of the results of kernels in this process, as JSON; see `numerics.py`.

Inputs are uniform random numbers of NumPy, which are made of integers and are equal everywhere.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from hashlib import sha256
from typing import Any

import numpy as np
import torch
from scipy.signal import fftconvolve, resample_poly
from torch import Tensor
from torch.nn import functional as F

from avn.acoustics.band_filters import minimum_phase
from avn.acoustics.brir import render_source
from avn.acoustics.settings import AcousticsConfig
from avn.apartments.surfaces import shoebox
from avn.core.numerics import restrict_if_portable

OPTIMISERS = ("Adam", "AdamW", "Adadelta", "RMSprop")
_random = np.random.default_rng(0)


def uniform(*shape: int) -> Tensor:
    """Return float32 numbers in [-0.5, 0.5)."""
    return torch.from_numpy(np.asarray(_random.random(shape) - 0.5, dtype=np.float32))


def gradients(function: Callable[..., Tensor], *inputs: Tensor) -> list[Tensor]:
    """Return the value of a function, and the gradients of a weighted sum of it."""
    leaves = [each.clone().requires_grad_() for each in inputs]
    value = function(*leaves)
    value.backward(uniform(*value.shape))
    return [value, *(leaf.grad for leaf in leaves if leaf.grad is not None)]


def last(values: Tensor) -> Tensor:
    """Return a tensor in the memory format of the networks."""
    return values.contiguous(memory_format=torch.channels_last)


def optimised(name: str) -> Tensor:
    """Return weights after some steps of an optimiser."""
    weights = torch.nn.Parameter(uniform(300, 33))
    optimiser = getattr(torch.optim, name)([weights], lr=0.01)
    for _ in range(4):
        weights.grad = uniform(300, 33)
        optimiser.step()
    return weights


def lstm() -> list[Tensor]:
    """Return the state of an LSTM cell after a step, and its gradients."""
    torch.manual_seed(0)
    cell = torch.nn.LSTMCell(64, 64)
    hidden, state = cell(uniform(16, 64), (uniform(16, 64), uniform(16, 64)))
    hidden.sum().backward()
    return [hidden, state, *(p.grad for p in cell.parameters() if p.grad is not None)]


def sampled() -> list[Tensor]:
    """Return random numbers of PyTorch's distributions."""
    g = torch.Generator().manual_seed(0)
    dropout = torch.empty(1000).bernoulli_(0.3, generator=g)
    drawn = torch.multinomial(uniform(64, 9).abs(), 3, generator=g)
    return [torch.rand(1000, generator=g), dropout, drawn, torch.randperm(1000, generator=g)]


def reverberation() -> Any:
    """Return impulse responses of the tracer in a shoebox."""
    config = AcousticsConfig(name="small", rays=100, seconds=0.1)
    heads = np.array([[1.0, 1.0, 1.2], [3.0, 4.0, 1.2]])
    room = shoebox((4.0, 5.0, 3.0), "plaster")
    return render_source(room, np.array([1.2, 1.4, 1.0]), heads, config).samples


def kernels() -> dict[str, Callable[[], Any]]:
    """Return the kernels by name."""
    x, double = uniform(64, 1000), uniform(64, 1000).double()
    positive, wave, target = x.abs() + 1e-3, uniform(8, 2, 16000), (uniform(64, 50) > 0).float()
    found: dict[str, Callable[[], Any]] = {
        "sqrt": positive.sqrt,
        "log10, log": lambda: [positive.log10(), positive.log()],
        "exp": x.exp,
        "sin, cos": lambda: [(9 * x).sin(), (9 * x).cos()],
        "tanh": (3 * x).tanh,
        "sigmoid": (4 * x).sigmoid,
        "log_softmax": lambda: x.log_softmax(1),
        "float64 exp, log": lambda: [double.exp(), (double.abs() + 0.1).log()],
        "sums, norms": lambda: [x.sum(), x.sum(0), x.mean(1), x.norm(), x.std(1)],
        "normal numbers": lambda: torch.randn(1000, generator=torch.Generator().manual_seed(0)),
        "other random numbers": sampled,
        "fft": lambda: torch.fft.irfft(torch.fft.rfft(wave)),
        "stft": lambda: torch.view_as_real(torch.fft.rfft(wave.unfold(-1, 512, 250))),
        "matrix product": lambda: uniform(128, 257) @ uniform(257, 64),
        "linear": lambda: gradients(F.linear, uniform(64, 512), uniform(128, 512), uniform(128)),
        "convolution": lambda: gradients(
            lambda a, w, b: F.conv2d(a, w, b, 2, 1),
            *(last(uniform(16, 16, 32, 32)), last(uniform(32, 16, 3, 3)), uniform(32)),
        ),
        "transposed convolution": lambda: gradients(
            lambda a, w, b: F.conv_transpose2d(a, w, b, 2),
            *(uniform(8, 64, 5, 5), uniform(64, 32, 3, 3), uniform(32)),
        ),
        "batch norm": lambda: gradients(
            lambda a, w, b: F.batch_norm(a, None, None, w, b, True),
            *(last(uniform(16, 32, 16, 16)), uniform(32), uniform(32)),
        ),
        "max pool": lambda: gradients(lambda a: F.max_pool2d(a, 2), uniform(8, 16, 32, 32)),
        "grid_sample": lambda: gradients(
            lambda a, at: F.grid_sample(a, at, align_corners=False),
            *(uniform(8, 16, 16, 16), uniform(8, 5, 5, 2)),
        ),
        "mse": lambda: gradients(F.mse_loss, uniform(64, 2), uniform(64, 2)),
        "cross-entropy": lambda: gradients(
            lambda a: F.binary_cross_entropy_with_logits(a, target), uniform(64, 50)
        ),
        "LSTM": lstm,
        **{name: lambda name=name: optimised(name) for name in OPTIMISERS},  # type: ignore[misc]
        "numpy exp, log": lambda: [np.exp(double.numpy()), np.log(positive.numpy())],
        "numpy matrix product": lambda: uniform(64, 100).numpy() @ uniform(100, 30).numpy(),
        "scipy fftconvolve": lambda: fftconvolve(double[0].numpy(), double[1].numpy()),
        "scipy resample_poly": lambda: resample_poly(double.numpy(), 1, 3, axis=1),
        "minimum phase": lambda: minimum_phase(positive[:, :6].numpy(), 16000, 64),
        "tracer": reverberation,
    }
    return found


def hash_of(values: Any) -> str:
    """Return the first 8 digits of SHA-256 of arrays or tensors."""
    digest = sha256()
    for each in values if isinstance(values, list) else [values]:
        array = each.detach().numpy() if isinstance(each, Tensor) else np.asarray(each)
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()[:8]


if __name__ == "__main__":
    restrict_if_portable()
    hashes = {}
    for name, kernel in kernels().items():
        hashes[name] = hash_of(kernel())
        print(json.dumps(hashes), flush=True)  # the last line counts; a crash leaves the others
