"""Training of networks with Lightning: checkpoints, TensorBoard, resuming."""

from __future__ import annotations

import logging
import warnings
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any, TypeVar

import lightning as L
import torch
from lightning.pytorch.callbacks import Callback, EarlyStopping, ModelCheckpoint
from lightning.pytorch.loggers import TensorBoardLogger
from lightning.pytorch.plugins.environments import LightningEnvironment

from avn.core.errors import UserError
from avn.core.prefetch import threads_for_one_operation
from avn.core.progress import progress_bar
from avn.modules.network import Network
from avn.modules.settings import BEST, LAST

Trained = TypeVar("Trained", bound=Network)


def fit(
    data: L.LightningDataModule,
    model: Network,
    folder: Path,
    callbacks: Sequence[Callback] = (),
    accelerator: str = "auto",
    run_name: str = "",
) -> dict[str, Any]:
    """Train a network in a folder, or resume an interrupted training.

    Writes TensorBoard events, `best.ckpt` (the best epoch by the model's `monitor`) and `last.ckpt`
    into the folder. Sets the model's weights to the best ones. The same recipe on the same machine
    gives the same weights, also after an interruption.

    Parameters
    ----------
    data : LightningDataModule
        Data module with an attribute `threads`, the number of threads that make batches, and
        loaders with samplers.
    model : Network
        Network that is built from the same recipe as `data`.
    folder : Path
        Folder of the checkpoints and events; created if missing.
    callbacks : sequence of Callback
        Further callbacks, such as those that log figures to TensorBoard.
    accelerator : str
        Lightning's name of the device.
    run_name : str
        Folder of the TensorBoard events below `folder`, which names the run in TensorBoard.

    Returns
    -------
    dict
        Number of `epochs` trained, best `epoch`, and the metrics of that epoch.

    Raises
    ------
    UserError
        Where the folder holds a checkpoint of another config.
    """
    folder.mkdir(parents=True, exist_ok=True)
    last = folder / LAST
    if last.exists():
        _read_checkpoint(last, model)
    model.prepare(data)
    history = _History()
    # Early stopping and the best checkpoint come before the last one, which so holds their state.
    all_callbacks = [
        EarlyStopping(
            model.monitor,
            mode=model.mode,
            patience=model.hparams["patience"],
            check_on_train_epoch_end=True,
        ),
        history,
        *callbacks,
        _Progress(),
        _every_epoch(folder, BEST, model.monitor, model.mode),
        _every_epoch(folder, LAST, None),
    ]
    cores = torch.get_num_threads()
    making = max(1, cores // 2)
    data.threads = making  # type: ignore[attr-defined]
    learning = threads_for_one_operation(max(1, cores - making))
    with _quiet(), learning, torch.random.fork_rng(devices=[]):
        trainer = L.Trainer(
            default_root_dir=folder,
            accelerator=accelerator,
            devices=1,
            max_epochs=model.hparams["epochs"],
            logger=TensorBoardLogger(folder, name=run_name, version="", default_hp_metric=False),
            callbacks=all_callbacks,
            num_sanity_val_steps=0,
            enable_progress_bar=False,
            enable_model_summary=False,
            log_every_n_steps=20,
            deterministic=torch.cuda.is_available(),
            # one process, also within a job of a batch system, whose tasks Lightning would count
            plugins=LightningEnvironment(),
        )
        try:
            trainer.fit(model, data, ckpt_path=str(last) if last.exists() else None)
        except SystemExit as error:  # of Lightning, for Ctrl-C outside of a command
            raise KeyboardInterrupt from error
    if trainer.interrupted or not trainer.state.finished:
        raise KeyboardInterrupt  # Lightning swallows it, and an unfinished network is none
    load_weights(model, folder / BEST)
    sign = 1 if model.mode == "min" else -1
    best = min(history.epochs, key=lambda epoch: sign * epoch[model.monitor])
    return {"epochs": len(history.epochs), **best}


def _every_epoch(
    folder: Path, name: str, monitor: str | None, mode: str = "min"
) -> ModelCheckpoint:
    """Return a callback that keeps one checkpoint: the best by `monitor`, or the latest."""
    return ModelCheckpoint(
        dirpath=folder,
        filename=Path(name).stem,
        monitor=monitor,
        mode=mode,
        save_on_train_epoch_end=True,
        enable_version_counter=False,
    )


def load_weights(model: Trained, path: Path) -> Trained:
    """Load the weights of a checkpoint of the same recipe and set the network to evaluation.

    Raises
    ------
    UserError
        Where the file is missing, is no checkpoint, or belongs to another config.
    """
    model.load_state_dict(_read_checkpoint(path, model)["state_dict"])
    return model.eval()


def _read_checkpoint(path: Path, model: Network) -> dict[str, Any]:
    """Read a checkpoint and refuse one of another recipe than the model's."""
    try:
        checkpoint = torch.load(path, map_location="cpu", weights_only=True)
        recipe, _ = dict(checkpoint["hyper_parameters"]), checkpoint["state_dict"]
    except FileNotFoundError as error:
        raise UserError(
            f"{path}: no such checkpoint; delete {path.parent} to train again"
        ) from error
    except Exception as error:  # whatever a damaged file makes the reader raise
        raise UserError(
            f"{path}: not a checkpoint of the {model.what}; delete {path.parent} to train again"
        ) from error
    wanted = dict(model.hparams)
    for key, value in _flat(wanted).items():
        saved = _flat(recipe).get(key, "missing")
        if saved != value:
            raise UserError(
                f"{path}: checkpoint of another config ({model.node}.{key} is {saved} there, "
                f"{value} here); give the same value or train again"
            )
    return checkpoint


def _flat(config: dict[str, Any], prefix: str = "") -> dict[str, Any]:
    flat: dict[str, Any] = {}
    for key, value in config.items():
        name = f"{prefix}{key}"
        flat |= _flat(value, f"{name}.") if isinstance(value, dict) else {name: value}
    return flat


class _History(Callback):
    """Metrics after each epoch, kept in checkpoints."""

    def __init__(self) -> None:
        self.epochs: list[dict[str, float]] = []

    def on_train_epoch_end(self, trainer: L.Trainer, pl_module: L.LightningModule) -> None:
        assert isinstance(pl_module, Network)
        self.epochs.append({"epoch": trainer.current_epoch, **pl_module.measured})

    def state_dict(self) -> dict[str, Any]:
        return {"epochs": self.epochs}

    def load_state_dict(self, state_dict: dict[str, Any]) -> None:
        self.epochs = state_dict["epochs"]


class _Progress(Callback):
    """Progress bar over the whole training, counted in inputs."""

    def on_train_start(self, trainer: L.Trainer, pl_module: L.LightningModule) -> None:
        data = trainer.datamodule  # type: ignore[attr-defined]
        epoch = len(data.train_dataloader().sampler)
        measured = sum(len(loader.sampler) for loader in data.val_dataloader())
        left = (trainer.max_epochs or 0) - trainer.current_epoch
        self._stack = ExitStack()
        assert isinstance(pl_module, Network)
        bar = progress_bar(
            f"training the {pl_module.what}", left * (epoch + measured), pl_module.unit
        )
        self._advance = self._stack.enter_context(bar)

    def on_train_batch_end(self, *args: Any, **kwargs: Any) -> None:
        self._count(args)

    def on_validation_batch_end(self, *args: Any, **kwargs: Any) -> None:
        self._count(args)

    def _count(self, args: tuple[Any, ...]) -> None:
        # trainer, module, outputs, batch, ...
        self._advance(len(args[3]["target"]))

    def on_train_end(self, trainer: L.Trainer, pl_module: L.LightningModule) -> None:
        self._stack.close()

    def on_exception(
        self, trainer: L.Trainer, pl_module: L.LightningModule, exception: BaseException
    ) -> None:
        """See `Callback.on_exception`."""
        if hasattr(self, "_stack"):
            self._stack.close()


@contextmanager
def _quiet() -> Iterator[None]:
    """Suppress Lightning's messages about devices and numbers of workers."""
    logger = logging.getLogger("lightning.pytorch")
    level = logger.level
    logger.setLevel(logging.ERROR)
    try:
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", module="lightning.*")
            warnings.filterwarnings("ignore", message=".*isinstance.*LeafSpec.*")
            yield
    finally:
        logger.setLevel(level)
