"""`python -m avn.train model=sound_cnn`: trains the parts that learn."""

from __future__ import annotations

import sys
from pathlib import Path

from omegaconf import DictConfig

from avn import listening
from avn.cli import command
from avn.stages import tell


@command("train")
def main(cfg: DictConfig) -> Path:
    """Train the model, or open it where it is trained, and print what was measured."""
    _, folder = listening.sound_model(cfg, asked=True)
    metrics = listening.read_metrics(folder)
    for name in sorted(metrics):
        if name.startswith(("error_m/", "bearing_deg/")) and "/all" in name:
            tell(f"{name}: {metrics[name]:.2f}")
    tell(str(folder))
    return folder


if __name__ == "__main__":
    sys.exit(main())
