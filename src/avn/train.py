"""`python -m avn.train model=sound_cnn`: trains a network or an actor-critic agent."""

from __future__ import annotations

import sys
from pathlib import Path

from omegaconf import DictConfig

from avn.config.cli import command
from avn.config.unread import refuse_unread
from avn.core.progress import log


@command("train")
def main(cfg: DictConfig) -> Path | None:
    """Train the model, or read it where it is trained, and print its metrics."""
    from avn.pipeline.models import model_of, train_model, try_out

    model = model_of(cfg)
    refuse_unread("train", cfg, model.read() | model.read_alone())
    if cfg.trainer.fast_dev_run:
        try_out(model, cfg.trainer.fast_dev_run)
        return None
    metrics = train_model(model)
    for name, value in metrics.items():
        log(f"{name}: {value:.3g}")
    log(str(model.folder))
    return model.folder


if __name__ == "__main__":
    sys.exit(main())
