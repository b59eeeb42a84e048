import sys
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from small_training import build, nodes
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

from avn.core.errors import UserError
from avn.modules.attachments import build_callbacks, build_loggers, check_attachments
from avn.modules.training import fit
from avn.reporting.sound_figures import SoundFigures


def test_several_loggers_write_the_same_curves_at_once(tmp_path: Path) -> None:
    # figures go to TensorBoard, also where it is not the first
    loggers = build_loggers(nodes("logger", "csv", "tensorboard"), tmp_path, "a-run")
    callbacks = build_callbacks(nodes("callbacks", "learning_rate"), tmp_path)
    fit(*build(epochs=2), tmp_path, [SoundFigures(), *callbacks], loggers)
    table = pd.read_csv(tmp_path / "csv" / "version_0" / "metrics.csv")
    events = EventAccumulator(str(tmp_path / "a-run"))
    events.Reload()
    for tag in ("loss/validation", "lr-AdamW"):
        drawn = [event.value for event in events.Scalars(tag)]
        assert drawn == pytest.approx(table[tag].dropna().tolist(), rel=1e-4)
        assert len(drawn) == 2
    assert any(tag.startswith("locations/") for tag in events.Tags()["images"])


def test_a_resumed_training_begins_another_csv_file(tmp_path: Path) -> None:
    for epochs in (1, 2):
        fit(*build(epochs=1), tmp_path, (), build_loggers(nodes("logger", "csv"), tmp_path, ""))
        assert len(list((tmp_path / "csv").iterdir())) == epochs


def test_placeholders_are_filled_in_nested_texts(tmp_path: Path) -> None:
    class_ = "lightning.pytorch.loggers.CSVLogger"
    node = {"_target_": class_, "save_dir": "{folder}/x", "name": "{run}-{id}"}
    (logger,) = build_loggers({"mine": node}, tmp_path / "net-1", "run")
    assert logger.log_dir == f"{tmp_path}/net-1/x/run-net-1/version_0"


OWN = """
from lightning.pytorch.loggers import CSVLogger

class Mine(CSVLogger):
    def __init__(self, save_dir, labels):
        super().__init__(save_dir, "mine")
        self.labels = labels

class NoLogger:
    pass

class Picky(CSVLogger):
    def __init__(self, save_dir):
        raise RuntimeError("no such\\nserver")
"""


@pytest.fixture
def own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    (tmp_path / "own_loggers.py").write_text(OWN)
    monkeypatch.syspath_prepend(tmp_path)
    yield "own_loggers"
    sys.modules.pop("own_loggers", None)


def test_a_logger_of_the_user_gets_its_settings(own: str, tmp_path: Path) -> None:
    node = {"_target_": f"{own}.Mine", "save_dir": "{folder}", "labels": ["{run}", 3]}
    (logger,) = build_loggers({"mine": node}, tmp_path, "run")
    assert logger.labels == ["run", 3]  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("node", "line"),
    [
        ({"save_dir": "x"}, "logger.mine: has no _target_"),
        (None, "logger.mine: has no _target_"),
        ({"_target_": "own_loggers.Gone"}, "logger.mine._target_: 'own_loggers.Gone' cannot be"),
        ({"_target_": "own_loggers.NoLogger"}, "is no Logger of Lightning; derive it from"),
        ({"_target_": "own_loggers.Mine", "save": 1}, "logger.mine.save: no such setting; there"),
    ],
)
def test_what_is_no_logger_is_refused_before_a_training(own: str, node: Any, line: str) -> None:
    with pytest.raises(UserError, match=line):
        check_attachments({"mine": node}, {})


@pytest.mark.parametrize(
    ("node", "line"),
    [
        ({"_target_": "own_loggers.Picky", "save_dir": "x"}, r"refuses its settings \(no such ser"),
        ({"_target_": "own_loggers.Mine", "save_dir": "x"}, "refuses its settings .*'labels'"),
    ],
)
def test_what_a_logger_refuses_is_one_line(own: str, node: Any, line: str) -> None:
    with pytest.raises(UserError, match=line):
        build_loggers({"mine": node}, Path(), "")


@pytest.mark.parametrize("name", ["wandb", "mlflow"])
def test_a_logger_without_its_package_names_the_extra(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("avn.modules.attachments.find_spec", lambda package: None)
    with pytest.raises(UserError, match=rf"logger.{name}: .*missing; pip install 'avn\[{name}\]'"):
        check_attachments(nodes("logger", name), {})
