"""Numerics: the fastest arithmetic of a processor, or one that all x86-64 processors share.

The libraries choose their kernels by the processor, and kernels add in different orders or use
approximations that processors round differently. `portable` chooses kernels that do not depend on
the processor. Most choices are environment variables that the libraries read when they are loaded,
so a command starts itself again with them. `docs/numerics.md` says what each of them is for.
"""

from __future__ import annotations

import os
import platform
import sys
from collections.abc import Callable, Sequence

from avn.core.errors import UserError

NATIVE, PORTABLE = "native", "portable"
# Set in the processes of a command with `numerics=portable`, and in its worker processes.
ENVIRONMENT = {
    "AVN_NUMERICS": PORTABLE,
    "ATEN_CPU_CAPABILITY": "avx2",
    "MKL_CBWR": "COMPATIBLE",
    "OMP_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "OPENBLAS_CORETYPE": "Haswell",
    "NPY_ENABLE_CPU_FEATURES": "X86_V3",
    "NUMBA_CPU_NAME": "haswell",
    "NUMBA_CPU_FEATURES": "+sse4.2,+popcnt,+avx,+avx2,+fma,+bmi,+bmi2,+lzcnt,+f16c",
}


def use(numerics: str, leave: Callable[[], None] = lambda: None) -> None:
    """Set the numerics of this process; `portable` may replace it by a new one of the same command.

    Parameters
    ----------
    numerics : str
        `native` or `portable`.
    leave : callable
        Called before the process is replaced, to remove its temporary files.

    Raises
    ------
    UserError
        For an unknown value, a machine that cannot do it, and a sweep of both values.
    """
    if numerics not in (NATIVE, PORTABLE):
        raise UserError(f"numerics: '{numerics}' is none of {NATIVE}, {PORTABLE}")
    if numerics == PORTABLE:
        _check_machine()
        if not is_portable():
            leave()
            sys.stdout.flush()
            sys.stderr.flush()
            command = [sys.executable, *sys.orig_argv[1:]]
            os.execve(sys.executable, command, os.environ | ENVIRONMENT)
        restrict_if_portable()
    elif is_portable():
        raise UserError(
            "numerics: native and portable in one sweep; give one of them, for the libraries are "
            "loaded once"
        )


def use_of_runs(values: Sequence[str]) -> None:
    """Set the numerics of this process to those of finished runs, which it replays.

    Raises
    ------
    UserError
        If the runs differ in it.
    """
    if len(set(values)) > 1:
        raise UserError("RUN: runs of numerics=native and portable; give runs of one of them")
    use(values[0])


def require(numerics: str) -> None:
    """Refuse other numerics than those of this process, which has loaded the libraries.

    Raises
    ------
    UserError
        If they differ.
    """
    if numerics != (PORTABLE if is_portable() else NATIVE):
        raise UserError(
            f"numerics: {numerics} can only be set where Python starts; use the command line, such "
            f"as python -m avn.train numerics={numerics}"
        )


def restrict_if_portable() -> None:
    """Restrict PyTorch to portable kernels if the environment of this process says so."""
    if not is_portable():
        return
    import torch

    from avn.core.portable_functions import replace_functions

    if torch.backends.cpu.get_cpu_capability() != "AVX2" or not torch.backends.mkl.is_available():
        raise UserError(
            "numerics: portable needs a processor with AVX2 and FMA and a PyTorch with MKL; give "
            "numerics=native"
        )
    # oneDNN and NNPACK choose blocks and instructions by the processor
    torch.backends.mkldnn.set_flags(False)
    torch.backends.nnpack.set_flags(False)
    replace_functions()


def is_portable() -> bool:
    """Return whether this process has the environment of portable numerics."""
    return all(os.environ.get(name) == value for name, value in ENVIRONMENT.items())


def _check_machine() -> None:
    if platform.machine() not in ("x86_64", "AMD64"):
        raise UserError(
            f"numerics: portable is of x86-64 processors and this is {platform.machine()}; give "
            "numerics=native"
        )
