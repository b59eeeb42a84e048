"""Options that had another name."""

import pytest
from omegaconf import OmegaConf
from small import composed

from avn.config.renamed import OPTIONS, VALUES, check_file, check_name
from avn.core.errors import UserError

ROWS = ("ours_noexp", "ours_exp", "greedy", "a3c_va_m_mapper")


def keys(node, start=""):
    for key, value in node.items():
        yield start + key
        if isinstance(value, dict):
            yield from keys(value, f"{start}{key}.")


def test_no_key_of_today_has_a_name_of_then_and_each_leads_to_one():
    configs = [composed(f"agent={row}") for row in ROWS]
    known = {key for cfg in configs for key in keys(OmegaConf.to_container(cfg, resolve=True))}
    assert not known & set(OPTIONS)
    assert set(OPTIONS.values()) <= known


@pytest.mark.parametrize(
    ("argument", "line"),
    [
        ("planner.detour=9", "planner.detour: is now planner.collision_cost; give that"),
        ("+takes=1", "takes: is now realisations; give that"),
        ("a3c.lr=1", "a3c.lr: is now algorithm.lr; give that"),
        ("a3c.total=5", "a3c.total: is now algorithm.total_steps; give that"),
        (
            "planner.source=belief",
            "planner.source: is now planner.source_filter (newest is latest, belief is bayes)",
        ),
        ("mapper.network.epochs=3", "mapper.network.epochs: is now occupancy_model.epochs"),
    ],
)
def test_an_old_name_is_one_line_with_the_new_one(command, tmp_path, argument, line):
    code, _, err = command("eval", "agent=ours_noexp", argument, f"outputs={tmp_path}/o")
    assert code == 2
    assert len(err) == 1
    assert err[0].startswith(f"avn.eval: {line}")


def test_an_old_name_in_a_file_is_one_too(command, tmp_path):
    (tmp_path / "planner").mkdir()
    (tmp_path / "planner" / "mine.yaml").write_text("defaults: [dijkstra]\ndetour: 3\n")
    given = ("--config-dir", str(tmp_path), "agent=ours_noexp", "planner=mine")
    code, _, err = command("eval", *given)
    assert code == 2
    assert err == [
        "avn.eval: planner/mine: planner.detour: is now planner.collision_cost; give that"
    ]
    with pytest.raises(UserError, match=r"agent/mine: planner\.error\.near: is now"):
        check_file("agent/mine", OmegaConf.create({"planner": {"error": {"near": 1}}}), True)


def test_values_are_those_of_options_that_are():
    assert set(VALUES) <= {*OPTIONS.values(), "algorithm.collector"}
    check_name("planner.sources")  # a longer name is another one
