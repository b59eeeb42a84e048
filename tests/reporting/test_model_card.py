import yaml

from avn.reporting.model_card import CARD, write_card


def test_a_card_holds_data_figures_and_the_whole_recipe(tmp_path):
    recipe = {"lr": 0.002, "net": {"widths": [16, 32]}, "name": "cnn5"}
    metrics = {"auc/validation": 0.99231, "prior": [0.1], "best.ckpt sha256": "ab", "epochs": 15}
    write_card(tmp_path, "A network", {"training apartments": "train_1"}, recipe, metrics)
    text = (tmp_path / CARD).read_text()
    assert "- training apartments: train_1" in text
    assert "| `auc/validation` | 0.9923 |" in text
    assert "sha256" not in text
    assert yaml.safe_load(text.split("```yaml")[1].split("```")[0]) == recipe
