import pytest
from omegaconf import OmegaConf

from avn.config import cli, schema
from avn.core.errors import UserError


def test_m_may_stand_anywhere_and_lists_need_no_brackets():
    assert cli.arrange(["agent=greedy", "-m", "sound=ring,alarm"]) == [
        "--multirun",
        "agent=greedy",
        "sound=ring,alarm",
    ]
    assert cli.arrange(["rows=greedy,oracle"]) == ["rows=[greedy,oracle]"]
    assert cli.arrange(["rows=[greedy]"]) == ["rows=[greedy]"]


def test_paths_of_sounds_are_quoted(tmp_path):
    odd = tmp_path / "my phone, (1).wav"
    odd.write_bytes(b"")
    assert cli.arrange([f"sound={odd}"]) == [f"sound='{odd}'"]
    assert cli.arrange(["sound=ring,a.wav"]) == ["sound=ring,'a.wav'"]


def test_a_key_that_no_schema_declares_is_refused_even_behind_a_plus():
    cfg = OmegaConf.create({"acoustics": OmegaConf.structured(schema.AcousticsConfig)})
    OmegaConf.update(cfg, "acoustics.rayz", 5, force_add=True)
    with pytest.raises(UserError, match=r"acoustics\.rayz: no such key; there are .*rays"):
        cli.check_keys(cfg)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["agent=greddy"], "greddy"),
        (["agnet=greedy"], "agnet"),
        (["acoustics.rayz=5"], "rayz"),
        (["+acoustics.rayz=5"], "acoustics.rayz"),
        (["+foo=5"], "foo"),
        (["acoustics.rays=many"], "rays"),
        (["episodes=all"], "episodes: 'all' is none of frozen, one_sound, exhaustive"),
        (["sound=missing.wav"], "missing.wav"),
        (["sound=telefone"], "there is no 'telefone'; there are alarm, alarms, all, all_test"),
        (["sound=[ring,dog_3]"], "name of a recording (dog_large, dog_single"),
        (["protocol.goal=disc"], "protocol.goal"),
        (["baseline=none"], "baseline: 'none' cannot act"),
        (["sound="], "sound"),
        (["seed=x"], "seed"),
        (["agent=[greedy"], "agent=[greedy"),
        (["agent=null"], "agent=null: name an option"),
    ],
)
def test_a_mistake_is_one_line_that_names_it_and_exit_code_2(command, tmp_path, arguments, said):
    given = ("agent=random_walk", "split=mini", f"outputs={tmp_path}/o", *arguments)
    code, _, err = command("eval", *given)
    lines = [line for line in err if line.strip()]
    assert code == 2, err
    assert len(lines) == 1
    assert said in lines[0]
    assert lines[0].startswith("avn.eval: ")
    assert not list(tmp_path.rglob("*.csv"))


def test_a_misspelt_key_in_a_users_own_yaml_file_is_refused(command, tmp_path):
    (tmp_path / "acoustics").mkdir()
    (tmp_path / "acoustics" / "mine.yaml").write_text("rayz: 5\n")
    code, _, err = command("eval", "--config-dir", str(tmp_path), "acoustics=mine")
    assert code == 2
    assert "rayz" in err[-1]


def test_broken_yaml_is_one_line(command, tmp_path):
    (tmp_path / "agent").mkdir()
    (tmp_path / "agent" / "mine.yaml").write_text("a: [1,\nb: }")
    code, _, err = command("eval", "--config-dir", str(tmp_path), "agent=mine")
    assert code == 2
    assert len(err) == 1
    assert "mine.yaml" in err[0]


def test_the_cause_is_found_behind_what_others_raised():
    error = RuntimeError("outer\nlines")
    error.__cause__ = UserError("file: broken; mend it")
    assert cli.explain(error) == "file: broken; mend it"
    assert cli.explain(RuntimeError("a bug")) is None


@pytest.mark.parametrize("flag", ["--hepl", "-x", "--config-dri=here"])
def test_a_flag_that_does_not_exist_is_one_line(command, flag):
    code, _, err = command("eval", "agent=greedy", flag)
    assert code == 2
    assert len(err) == 1
    assert err[0].startswith(f"avn.eval: {flag}: no such flag; there are --help")


def test_flags_of_hydra_pass():
    given = ["agent=greedy", "--cfg", "job", "-p", "agent", "--resolve"]
    assert cli.arrange(given) == given
