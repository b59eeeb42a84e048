"""Elementary functions of PyTorch on the CPU that do not depend on the processor.

PyTorch computes them with the vector library of MKL, which refines the approximate reciprocals and
square roots of the processor. These differ between processors, and neither `MKL_CBWR` nor
`ATEN_CPU_CAPABILITY` changes that. Even square roots are not rounded correctly.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np
import torch
from torch import Tensor

Function = Callable[..., Any]
# Functions of PyTorch that call the vector library of MKL, and those of NumPy that replace them.
FUNCTIONS: dict[str, Function] = {
    "sqrt": np.sqrt,
    "exp": np.exp,
    "log": np.log,
    "log2": np.log2,
    "log10": np.log10,
    "sin": np.sin,
    "cos": np.cos,
    "tan": np.tan,
    "asin": np.arcsin,
    "acos": np.arccos,
    "atan": np.arctan,
    "tanh": np.tanh,
}


@lru_cache(maxsize=1)
def replace_functions() -> torch.library.Library:
    """Replace the functions in this process, below autograd; further calls change nothing."""
    library = torch.library.Library("aten", "IMPL", "CPU")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of replaced kernels, which is the intention
        for name, function in FUNCTIONS.items():
            computed, inplace, into = _kernels(function)
            library.impl(name, computed)
            library.impl(f"{name}_", inplace)
            library.impl(f"{name}.out", into)
    return library


def _kernels(function: Function) -> tuple[Function, Function, Function]:
    def computed(x: Tensor) -> Tensor:
        if not (x.is_floating_point() or x.is_complex()):
            x = x.to(torch.get_default_dtype())
        if x.dtype in (torch.float16, torch.bfloat16):
            return computed(x.float()).to(x.dtype)
        with np.errstate(all="ignore"):
            return torch.from_numpy(np.asarray(function(x.detach().resolve_conj().numpy())))

    def inplace(x: Tensor) -> Tensor:
        return x.copy_(computed(x))

    def into(x: Tensor, *, out: Tensor) -> Tensor:
        result = computed(x)
        return out.resize_(result.shape).copy_(result)

    return computed, inplace, into
