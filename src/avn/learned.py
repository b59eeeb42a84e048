"""Networks as stages: trained once for each recipe, applied once to each apartment."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import h5py
import lightning as L
import torch
from omegaconf import DictConfig
from torch import Tensor

from avn import pipeline
from avn.dataset import scene_file
from avn.dataset.scene import Scene
from avn.errors import UserError
from avn.modules import training
from avn.modules.network import Network
from avn.reporting.model_card import write_card
from avn.stages import digest, file_hash, make_once, stage_folder, written_whole

METRICS, CHECKSUM = "metrics.json", "best.ckpt sha256"
Trained = TypeVar("Trained", bound=Network)


def trained(
    cfg: DictConfig,
    model: Trained,
    folder: Path,
    title: str,
    data: Callable[[], L.LightningDataModule],
    measure: Callable[[Trained, Any], dict[str, Any]] | None = None,
    asked: bool = False,
    seconds: float = 0.0,
) -> Trained:
    """Give a network its weights; train it where they are missing.

    Parameters
    ----------
    model : Network
        Built from the config.
    folder : Path
        Where its checkpoints and `metrics.json` lie.
    title : str
        What it is, for the line that says that it is missing.
    data : callable
        Opens what it is trained on.
    measure : callable, optional
        Measures the trained network on the data; what it gives is added to the metrics.
    asked : bool
        Whether it is the network that the user asked for, so that `auto=false` does not refuse it.
    seconds : float
        How long it takes on two cores, roughly.

    Raises
    ------
    UserError
        Where a checkpoint belongs to another config, or has changed since it was trained.
    """

    def fit() -> None:
        opened = data()
        metrics = training.fit(opened, model, folder)
        metrics |= measure(model, opened) if measure else {}
        metrics[CHECKSUM] = file_hash(folder / training.BEST)
        with written_whole(folder / METRICS) as part:
            part.write_text(json.dumps(metrics, indent=1, sort_keys=True) + "\n")
        write_card(folder, title, apartments(cfg), dict(model.hparams), metrics)

    make_once(
        folder,
        title,
        done=(folder / METRICS).is_file,
        make=fit,
        auto=cfg.auto or asked,
        seconds=seconds,
    )
    best = folder / training.BEST
    training.load_weights(model, best)
    if read_metrics(folder).get(CHECKSUM) != file_hash(best):
        raise UserError(f"{best}: changed since it was trained; delete {folder} to train again")
    return model


def apartments(cfg: DictConfig) -> dict[str, str]:
    """What networks are trained and measured on, for their cards."""
    plans = pipeline.plans(cfg)
    names = {part: ", ".join(plan.name for plan in plans[part]) for part in ("train", "validation")}
    setting = f"split `{cfg.split.name}`, acoustics `{cfg.acoustics.name}`"
    return {"setting": setting, "training apartments": names["train"]} | {
        "validation apartments": names["validation"]
    }


def read_metrics(folder: Path) -> dict[str, Any]:
    """What a training measured; raises `UserError` where the file is damaged."""
    try:
        return dict(json.loads((folder / METRICS).read_text()))
    except (OSError, ValueError) as error:
        raise UserError(f"{folder / METRICS}: damaged; delete {folder} to train again") from error


@dataclass(frozen=True)
class Outcome:
    """What a network makes of apartments: a stage with one file for each.

    Attributes
    ----------
    stage : str
        Its folder under `outputs`.
    what : str
        Name of the folder in it.
    kind, dataset, version : str, str, int
        Of the files.
    made_from : str
        Hash of everything that it depends on beside the apartment.
    title : str
        What it is, for the line that says that it is missing.
    seconds : float
        How long it takes on two cores, roughly.
    """

    stage: str
    what: str
    kind: str
    dataset: str
    version: int
    made_from: str
    title: str
    seconds: float

    def of(
        self,
        cfg: DictConfig,
        chosen: Sequence[Scene],
        apartments: Sequence[str],
        make: Callable[[Scene], Tensor],
    ) -> list[Tensor]:
        """What the network makes of each apartment, made where it is missing.

        Parameters
        ----------
        chosen : sequence of Scene
        apartments : sequence of str
            Hash of what it depends on of each of them.
        make : callable
            Applies the network to one.

        Raises
        ------
        UserError
            Where a file is damaged, or it is missing and `auto` is false.
        """
        folder = stage_folder(cfg.outputs, self.stage, self.what, self.made_from)
        hashes = [digest(self.made_from, own) for own in apartments]
        pairs = zip(chosen, hashes, strict=True)
        paths = [self._path(cfg, scene, own) for scene, own in pairs]

        def make_missing() -> None:
            for scene, path, own in zip(chosen, paths, hashes, strict=True):
                if not path.is_file():
                    self._write(path, own, make(scene))

        make_once(
            folder,
            f"{self.title} in {', '.join(scene.name for scene in chosen)}",
            done=lambda: all(path.is_file() for path in paths),
            make=make_missing,
            auto=cfg.auto,
            seconds=self.seconds,
        )
        return [self._read(path, own) for path, own in zip(paths, hashes, strict=True)]

    def put(self, cfg: DictConfig, scene: Scene, apartment: str, found: Tensor) -> None:
        """Keep what was found for an apartment on the way to something else, unless it is there."""
        own = digest(self.made_from, apartment)
        path = self._path(cfg, scene, own)
        if not path.is_file():
            self._write(path, own, found)

    def _path(self, cfg: DictConfig, scene: Scene, made_from: str) -> Path:
        folder = stage_folder(cfg.outputs, self.stage, self.what, self.made_from)
        return folder / f"{scene.name}-{made_from[:8]}.h5"

    def _write(self, path: Path, made_from: str, found: Tensor) -> None:
        def fill(file: h5py.File) -> None:
            file[self.dataset] = found.numpy()

        scene_file.write(path, self.kind, self.version, made_from, fill)

    def _read(self, path: Path, made_from: str) -> Tensor:
        with scene_file.open_checked(path, self.kind, self.version, made_from) as file:
            return torch.from_numpy(file[self.dataset][()])
