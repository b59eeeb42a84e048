"""`--help` of each command, held against the files that it is read from."""

import re
import subprocess
import sys
from pathlib import Path

import pytest
import yaml
from hydra import compose, initialize_config_dir
from omegaconf import OmegaConf

from avn.config import registry
from avn.config.folder import conf_folder
from avn.pipeline.replay import SHOWS

COMMANDS = ("generate", "train", "eval", "reproduce")
EXAMPLES = Path(__file__).parents[2] / "docs" / "examples" / "conf"


def shown(command, name, *arguments):
    code, out, err = command(name, *arguments, "--help")
    assert code == 0, err
    assert not err
    return out


def listed(lines):
    """The options of each group that help lists, and those that it marks."""
    groups, marked = {}, {}
    for line in lines[: lines.index("More:")]:
        if group := re.fullmatch(r"  (\+?\w+)( \(.*\))?", line):
            options = groups.setdefault(group[1], set())
        elif option := re.match(r"    ([* ]) (\w+)(  |$)", line):
            options.add(option[2])
            if option[1] == "*":
                marked[list(groups)[-1]] = option[2]
    return groups, marked


def chosen_in(*names):
    """What the defaults lists of these configs choose in each group."""
    entries = [
        entry
        for name in names
        for entry in yaml.safe_load((conf_folder() / f"{name}.yaml").read_text())["defaults"]
        if isinstance(entry, dict)
    ]
    return {group: option for entry in entries for group, option in entry.items()}


def one_line(lines):
    return " ".join(" ".join(lines).replace(" # ", " ").split())


@pytest.mark.parametrize("name", COMMANDS)
def test_every_group_stands_there_with_its_options_and_the_default(command, name):
    groups, marked = listed(shown(command, name))
    chosen = {g: o for g, o in chosen_in(name, "_core").items() if not re.search(r"[@ ]", g)}
    assert set(groups) == set(chosen)
    for group, options in groups.items():
        assert options == {file.stem for file in (conf_folder() / group).glob("*.yaml")}
    assert marked == {g: o for g, o in chosen.items() if o not in (None, "???")}


@pytest.mark.parametrize("name", COMMANDS)
def test_every_option_stands_with_its_comment_and_no_schema_is_an_option(command, name):
    out = shown(command, name)
    assert "schema" not in "\n".join(out)
    said = one_line(out)
    for group in listed(out)[0]:
        for file in (conf_folder() / group).glob("*.yaml"):
            lines = [line for line in file.read_text().splitlines() if "@package" not in line]
            if lines and lines[0].startswith("# "):
                assert " ".join(lines[0][2:].split()) in said


@pytest.mark.parametrize("name", COMMANDS)
def test_every_setting_stands_with_its_default_and_its_comment(command, name):
    said = one_line(shown(command, name))
    part = said.split("with their defaults:", 1)[1].split(" More:")[0]
    settings = dict(re.findall(r" ([\w.]+)=(\[.*?\]|\S*)", part))
    registry.register()
    with initialize_config_dir(str(conf_folder()), version_base="1.3"):
        cfg = compose(name, overrides=["model=sound_cnn"] if name == "train" else [])
    for key, value in settings.items():
        assert yaml.safe_load(value) == OmegaConf.select(cfg, key), key
    for file in (conf_folder() / f"{name}.yaml", conf_folder() / "_core.yaml"):
        for key in yaml.safe_load(file.read_text()).keys() - {"defaults", "hydra"}:
            assert key in {own.split(".")[0] for own in settings}
            above = re.search(rf"((?:^#.*\n)*)^{key}:", file.read_text(), re.MULTILINE)[1]
            assert " ".join(above.replace("#", "").split()) in said


@pytest.mark.parametrize("name", COMMANDS)
def test_the_line_that_prints_the_config_does_so(command, name):
    (line,) = (line for line in shown(command, name) if line.endswith("--cfg job"))
    code, out, err = command(name, *line.split()[3:])
    assert code == 0, err
    assert set(yaml.safe_load("\n".join(out))) >= {"split", "outputs"}


def test_groups_of_the_training_world_and_sweeps_are_spelt_as_the_command_takes_them(command):
    out = shown(command, "eval")
    assert "  training.sounds: one of sound (default: all)" in out
    assert "  training.scenes: one of split" in out
    assert "a bare -m runs seed=0,1,2." in one_line(out)
    assert "a bare -m runs train_seed=0,1,2." in one_line(shown(command, "train"))


def test_options_of_ones_own_folders_are_listed_too(command, tmp_path):
    (tmp_path / "habits").mkdir()
    (tmp_path / "habits" / "slow.yaml").write_text("# @package _global_\n# Takes its time.\n")
    (tmp_path / "sound").mkdir()
    (tmp_path / "sound" / "ring.yaml").write_text("# A ring of mine.\nring: mine.wav\n")
    out = shown(command, "eval", f"--config-dir={EXAMPLES}", "--config-dir", str(tmp_path))
    groups, _ = listed(out)
    for file in EXAMPLES.glob("*/*.yaml"):
        assert file.stem in groups[file.parent.name]
    assert groups["+habits"] == {"slow"}
    assert {"Takes its time.", "A ring of mine."} <= {
        line[6:].split("  ")[-1].strip() for line in out
    }


def test_a_folder_that_is_none_is_one_line(command):
    code, out, err = command("eval", "--help", "--config-dir", "nowhere")
    assert (code, out) == (2, [])
    assert err == ["avn.eval: --config-dir: 'nowhere' is no folder; give one with config files"]


@pytest.mark.parametrize("name", [*COMMANDS, "figures", "report"])
def test_help_imports_nothing_heavy(name):
    line = [sys.executable, "-X", "importtime", "-m", f"avn.{name}", "split=mini", "-h"]
    done = subprocess.run(line, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith(f"usage: python -m avn.{name} ")
    imported = {entry.rsplit("|", 1)[-1].strip() for entry in done.stderr.splitlines()}
    assert "avn.config.cli" in imported
    assert not imported & {"torch", "lightning", "pandas", "numba", "matplotlib"}


def test_figures_names_what_it_can_show(command):
    _, out, _ = command("figures", "--help")
    assert all(word in one_line(out) for word in SHOWS)
