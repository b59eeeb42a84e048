"""Small trainings on synthetic data, whose weights are the same on every machine when portable.

Run as a script, in a process with the environment of `avn.core.numerics`, it prints their hashes.
"""

import json
import sys
from hashlib import sha256
from pathlib import Path
from tempfile import TemporaryDirectory

import torch
from small import option
from small_training import build
from small_worlds import FLAT, make_spec, make_trajectories, make_worker, random_tables
from synthetic_views import synthetic_views

from avn.core.classes import build_object
from avn.core.numerics import restrict_if_portable
from avn.core.settings import typed
from avn.datamodules.views import ViewData
from avn.modules.training import fit
from avn.navigation.navigation_scene import draw
from avn.navigation.protocols import Protocol


def sound() -> list[torch.Tensor]:
    """Clips, spectrograms, convolutions, AdamW."""
    data, model = build(epochs=1)
    return _fitted(data, model)


def occupancy(name: str = "small") -> list[torch.Tensor]:
    """Augmented views; grid sampling and AdamW, or transposed convolutions and Adadelta."""
    given = {"epochs": 1, "batch": 16, "appearances": 1, "times": 1, "validation_views": 40}
    config = option("occupancy_model", name, **given)
    if name == "small":
        config.net.widths, config.net.decoder, config.net.cell = [8, 8, 8, 8], 8, 16
    else:
        config.net.widths, config.net.hidden = [4, 4], [16]
    views = [synthetic_views(60, 0)], [synthetic_views(40, 1)]
    network = build_object("occupancy_model", config, camera={"size": 32})
    return _fitted(ViewData(*views, typed(config)), network)


def a3c() -> list[torch.Tensor]:
    """LSTM memory, maps, RMSProp."""
    protocol = Protocol("var", "box", False, "moves", max_moves_ratio=2.0)
    tables = random_tables([draw("flat", FLAT)], protocol)
    trajectories = make_trajectories(tables)
    spec = make_spec(tables, protocol, trajectories, memory=5, maps=2, max_grad_norm=0.5, lr=0.01)
    worker = make_worker(spec)
    for _ in range(20):
        worker.update()
    return [worker.shared.weights]


def _fitted(data, model) -> list[torch.Tensor]:
    with TemporaryDirectory() as folder:
        fit(data, model, Path(folder))
    return [*model.state_dict().values()]


TRAININGS = {
    "sound": sound,
    "occupancy": occupancy,
    "occupancy, paper": lambda: occupancy("paper"),
    "a3c": a3c,
}


def hashes(names: list[str] = ()) -> dict[str, str]:
    """The first 16 digits of SHA-256 of the weights of each training."""
    found = {}
    for name in names or TRAININGS:
        digest = sha256()
        for weights in TRAININGS[name]():
            digest.update(weights.detach().contiguous().numpy().tobytes())
        found[name] = digest.hexdigest()[:16]
    return found


if __name__ == "__main__":
    restrict_if_portable()
    print(json.dumps(hashes(sys.argv[1:])))
