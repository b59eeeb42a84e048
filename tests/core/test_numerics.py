import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import torch
from small import composed

from avn.config.python import compose_command
from avn.core import numerics
from avn.core.errors import UserError
from avn.pipeline.apartments import Apartments
from avn.pipeline.scenes import Geometry

TESTS = Path(__file__).parents[1]
# Hashes of the weights after the trainings of `golden_trainings.py`, by versions of the libraries.
GOLDEN = {
    "torch 2.13 numpy 2.4": {
        "sound": "a5860d84f9c637d9",
        "occupancy": "6ad50aae5d6b3935",
        "occupancy, paper": "3e6f417dd347446e",
        "a3c": "31aef94f28e1d074",
    },
}


def script(*arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
    path = os.pathsep.join([str(Path(numerics.__file__).parents[2]), str(TESTS)])
    return subprocess.run(
        [sys.executable, *arguments],
        env=os.environ | {"PYTHONPATH": path} | environment,
        capture_output=True,
        text=True,
        check=False,
    )


def test_small_trainings_have_the_same_weights_on_every_machine() -> None:
    done = script(str(TESTS / "golden_trainings.py"), **numerics.ENVIRONMENT)
    if "needs a processor" in done.stderr:
        pytest.skip(done.stderr.splitlines()[-1])
    found = json.loads(done.stdout.splitlines()[-1])
    assert found == GOLDEN[versions()]


def versions() -> str:

    both = {"torch": torch.__version__, "numpy": np.__version__}
    name = " ".join(f"{key} {'.'.join(own.split('.')[:2])}" for key, own in both.items())
    if name not in GOLDEN:
        pytest.skip(f"no hashes of {name}")
    return name


FUNCTIONS = """
import torch
from avn.core.numerics import restrict_if_portable
from avn.core.portable_functions import FUNCTIONS

x = torch.rand(64, 1000, generator=torch.Generator().manual_seed(0)) * 0.9 + 0.05
exact = {name: getattr(torch, name)(x.double()) for name in FUNCTIONS}
restrict_if_portable()
assert torch.equal(x.sqrt(), exact["sqrt"].float())
for name in FUNCTIONS:
    function = getattr(torch, name)
    y = function(x)
    torch.testing.assert_close(y.double(), exact[name], rtol=4e-7, atol=4e-7)
    assert torch.equal(function(x[:, ::2]), y[:, ::2])
    assert torch.equal(getattr(x.clone(), f"{name}_")(), y)
    assert torch.equal(function(x, out=torch.empty(0)), y)
    assert torch.equal(function(x.bfloat16()), function(x.bfloat16().float()).bfloat16())
    assert function(torch.ones(3, dtype=torch.int64)).dtype == torch.float32
    assert function(x[0, 0]).shape == () and function(x[:0]).shape == (0, 1000)
    pictures = x.reshape(4, 4, 40, 100).contiguous(memory_format=torch.channels_last)
    assert function(pictures).stride() == pictures.stride()
    leaf = x[:2].double().requires_grad_()
    assert torch.autograd.gradcheck(function, leaf[:, :5])
print("equal")
"""


def test_replaced_functions_are_those_of_pytorch() -> None:
    done = script("-c", FUNCTIONS, **numerics.ENVIRONMENT)
    if "needs a processor" in done.stderr:
        pytest.skip(done.stderr.splitlines()[-1])
    assert done.stdout == "equal\n", done.stderr


def test_a_command_starts_itself_again(monkeypatch: pytest.MonkeyPatch) -> None:
    started = []
    monkeypatch.setattr(os, "execve", lambda *given: started.append(given))
    monkeypatch.setattr(numerics, "restrict_if_portable", lambda: None)
    monkeypatch.setattr(sys, "orig_argv", ["python", "-m", "avn.train", "numerics=portable"])
    numerics.use("native")
    assert not started
    numerics.use("portable")
    ((program, command, environment),) = started
    assert (program, command[1:]) == (sys.executable, ["-m", "avn.train", "numerics=portable"])
    assert numerics.ENVIRONMENT.items() <= environment.items()
    for name, value in numerics.ENVIRONMENT.items():
        monkeypatch.setenv(name, value)
    numerics.use("portable")
    assert len(started) == 1
    with pytest.raises(UserError, match="numerics: native and portable in one sweep"):
        numerics.use("native")


def test_what_cannot_hold_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(UserError, match="numerics: 'exact' is none of native, portable"):
        numerics.use("exact")
    with pytest.raises(UserError, match="numerics: portable can only be set where Python starts"):
        compose_command("eval", ["agent=greedy", "numerics=portable"])
    with pytest.raises(UserError, match="runs of numerics=native and portable"):
        numerics.use_of_runs(["native", "portable"])
    monkeypatch.setattr("platform.machine", lambda: "aarch64")
    with pytest.raises(UserError, match="numerics: portable is of x86-64 processors"):
        numerics.use("portable")


def test_only_portable_products_have_it_in_their_fingerprint() -> None:
    native, portable = (
        composed("split=mini", f"numerics={own}", command="generate")
        for own in (numerics.NATIVE, numerics.PORTABLE)
    )
    stages = [Geometry(cfg, Apartments(cfg, "train")) for cfg in (native, portable)]
    assert stages[0].fingerprint != stages[1].fingerprint
    assert "numerics" in stages[0].read()
