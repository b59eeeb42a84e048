"""Print which kernels and trainings have other bytes with other settings, and those of `portable`.

A setting is a set of environment variables that restricts a library to older instructions, so that
this machine computes as another one does. Equal letters in a row are equal bytes. The last column
has the hashes of `numerics=portable`, to compare with those of another machine. Run from the
repository:

    python scripts/numerics.py [--trainings] [--under "qemu-x86_64 -cpu Haswell"]

`--trainings` adds the small trainings of `tests/golden_trainings.py`. `--under` is a command that
runs a program on an emulated processor; then there is only the column of `portable`.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from avn.core.numerics import ENVIRONMENT

TOP = Path(__file__).parents[1]
ONE = {"OMP_NUM_THREADS": "1"}
# Another math library of C, as on a processor without fused multiply-add.
NO_FMA = {"GLIBC_TUNABLES": "glibc.cpu.hwcaps=-FMA,-FMA4,-AVX2"}
SETTINGS: dict[str, Mapping[str, str]] = {
    "native": ONE,
    "two threads": {"OMP_NUM_THREADS": "2"},
    "PyTorch: AVX2": ONE | {"ATEN_CPU_CAPABILITY": "avx2"},
    "PyTorch: SSE": ONE | {"ATEN_CPU_CAPABILITY": "default"},
    "oneDNN: AVX2": ONE | {"ONEDNN_MAX_CPU_ISA": "AVX2"},
    "MKL: compatible": ONE | {"MKL_CBWR": "COMPATIBLE"},
    "NumPy: AVX2": ONE | {"NPY_ENABLE_CPU_FEATURES": "X86_V3"},
    "OpenBLAS: SSE": ONE | {"OPENBLAS_CORETYPE": "Nehalem"},
    "Numba: Haswell": ONE | {k: v for k, v in ENVIRONMENT.items() if k.startswith("NUMBA")},
    "libm: no FMA": ONE | NO_FMA,
    "portable": ENVIRONMENT,
}


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--trainings", action="store_true")
    parser.add_argument("--under", default="", metavar="COMMAND")
    options = parser.parse_args()
    script = "tests/golden_trainings.py" if options.trainings else "scripts/numerics_kernels.py"
    settings = {"portable": ENVIRONMENT} if options.under else SETTINGS
    columns = [hashes(script, own, options.under.split()) for own in settings.values()]
    for letter, name in zip("abcdefghijkl", settings, strict=False):
        print(f"{letter}: {name}")
    print(f"\n{'':24}", *"abcdefghijkl"[: len(settings)], "portable")
    for name in columns[0]:
        row = [column.get(name, "-") for column in columns]
        order = list(dict.fromkeys(row))
        print(f"{name:24}", *("ABCDEFGHIJKL"[order.index(own)] for own in row), row[-1])


def hashes(script: str, setting: Mapping[str, str], under: Sequence[str] = ()) -> dict[str, str]:
    """Run a script that prints hashes as JSON; what it printed before a crash counts.

    Parameters
    ----------
    script : str
        Path below the repository.
    setting : mapping
        Environment variables.
    under : sequence of str
        Command that runs a program.
    """
    path = [str(TOP / "src"), str(TOP / "tests"), os.environ.get("PYTHONPATH", "")]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(path), "PYTHONWARNINGS": "ignore"}
    done = subprocess.run(
        [*under, sys.executable, str(TOP / script)],
        env={**environment, **setting},
        stdout=subprocess.PIPE,
        text=True,
        check=False,
    )
    if done.returncode:
        print(f"{script}: ended with code {done.returncode}", file=sys.stderr)
    lines = done.stdout.strip().splitlines()
    return dict(json.loads(lines[-1])) if lines else {}


if __name__ == "__main__":
    main()
