from pathlib import Path
from typing import Any

import pytest
import torch
from omegaconf import DictConfig
from small import option
from synthetic_scene import synthetic_scene, synthetic_sounds

from avn.acoustics.microphone import Microphone
from avn.apartments.grid import goal_cells
from avn.core.classes import build_object
from avn.core.errors import UserError
from avn.core.settings import typed
from avn.datamodules.stop import StopData
from avn.modules.stop_classifier import StopClassifier
from avn.modules.training import BEST, fit, load_weights
from avn.pipeline.audio_inference import infer
from avn.reporting.stop_figures import StopFigures

CONF = Path(__file__).parents[2] / "conf" / "stop_model"


def recipe(**changes: Any) -> DictConfig:
    config = option("stop_model", "cnn5", epochs=5, batch=16, validation_clips=400)
    config.optimizer.lr, config.net.dropout = 3e-3, 0.1
    config.spectrogram.bands = config.spectrogram.frames = 16
    config.net.widths, config.net.hidden = [8, 8, 8, 8, 8], [16]
    for key, value in changes.items():
        setattr(config, key, value)
    return config


def build(**changes: Any) -> tuple[StopData, StopClassifier]:
    config = recipe(**changes)
    scenes = [synthetic_scene("a", 4.0)], [synthetic_scene("b", 4.5)]
    data = StopData(
        *scenes,
        synthetic_sounds(),
        Microphone(),
        typed(config),
        lambda scene: goal_cells(scene.grid)[scene.sources],
    )
    return data, build_object("stop_model", config)


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, StopClassifier, dict[str, Any]]:
    folder = tmp_path_factory.mktemp("run")
    data, model = build()
    return folder, model, fit(data, model, folder, [StopFigures()])


def test_level_tells_how_near_the_source_is(
    run: tuple[Path, StopClassifier, dict[str, Any]],
) -> None:
    _, _, metrics = run
    assert metrics["auc/validation/all/all"] > 0.9
    assert metrics["ece/validation/all/all"] < 0.1


def test_probabilities_are_those_of_all_states_though_the_goal_was_shown_often(
    run: tuple[Path, StopClassifier, dict[str, Any]],
) -> None:
    _, model, _ = run
    data, _ = build()
    said, true = [], []
    with torch.inference_mode():
        for batch in data.val_dataloader()[1]:
            said.append(torch.sigmoid(model.log_odds(batch["pictures"])))
            true.append(batch["target"] == 0)
    share = float(torch.cat(true).float().mean())
    assert float(torch.cat(said).mean()) == pytest.approx(share, abs=0.05)
    assert share < 0.25 - 0.05
    assert float(model.log_odds_shift) < 0


def test_exchanged_ears_are_as_near(run: tuple[Path, StopClassifier, dict[str, Any]]) -> None:
    model = run[1].eval()
    clips = torch.randn(4, 2, 16000, generator=torch.Generator().manual_seed(0)) * 0.1
    with torch.inference_mode():
        straight, mirrored = model(clips), model(clips.flip(1))
    assert straight.shape == (4,)
    torch.testing.assert_close(straight, mirrored, atol=1e-5, rtol=1e-4)


def test_the_checkpoint_remembers_the_prior(
    run: tuple[Path, StopClassifier, dict[str, Any]],
) -> None:
    folder, model, _ = run
    again = load_weights(build(criterion="balanced", threshold=0.3)[1], folder / BEST)
    assert torch.equal(again.log_odds_shift, model.log_odds_shift)


def test_checkpoint_of_another_config_is_one_line(
    run: tuple[Path, StopClassifier, dict[str, Any]],
) -> None:
    message = r"best.ckpt: .*another config \(stop_model.positives is 0.25 there, 0.5 here\)"
    with pytest.raises(UserError, match=message):
        load_weights(build(positives=0.5)[1], run[0] / BEST)


def test_every_state_gets_a_probability(
    run: tuple[Path, StopClassifier, dict[str, Any]],
) -> None:
    scene, sounds = synthetic_scene(), synthetic_sounds()
    given = (scene, sounds, run[1], 2, Microphone(), 5, False)
    scores = infer(*given)
    assert scores.shape == (2, 4 * scene.grid.cells, 2, 2)
    assert scores.dtype == torch.float32
    assert 0 <= float(scores.min()) < float(scores.max()) <= 1


def test_option_names_are_those_of_the_files() -> None:
    for path in CONF.glob("*.yaml"):
        assert option("stop_model", path.stem).name == path.stem


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"positives": 1.0}, "stop_model.positives is 1.0"),
        ({"criterion": "best"}, "stop_model.criterion: 'best'"),
        ({"threshold": 1.5}, "stop_model.threshold: 1.5"),
        ({"epochs": 0}, "stop_model.epochs is 0"),
    ],
)
def test_bad_option_is_named(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(UserError, match=message):
        build_object("stop_model", recipe(**changes))
