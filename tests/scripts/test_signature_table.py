"""The table of signatures is that of the code, and composing a config needs no torch."""

import json
import subprocess
import sys

import pytest
from signature_table import targets

from avn.config import signature_table
from avn.config.signature_table import TABLE, known_parameters, table_text
from avn.config.signatures import schema_type
from avn.core.classes import import_class, parameters


def test_the_table_is_up_to_date():
    text = table_text(targets(), schema_type)
    assert TABLE.read_text() == text, "run scripts/signature_table.py"


def test_the_table_holds_the_parameters_of_the_classes():
    assert len(set(targets())) > 15
    for target in targets():
        known = known_parameters(target)
        assert known is not None
        imported = parameters(import_class("", target))
        for (hint, default), (real, expected) in zip(
            known.values(), imported.values(), strict=True
        ):
            assert hint == schema_type(real)
            assert default == (list(expected) if isinstance(expected, tuple) else expected)


def test_an_entry_whose_sources_have_changed_is_not_used(monkeypatch):
    table = json.loads(TABLE.read_text())
    name = "avn.agents.greedy.Greedy"
    table[name]["files"]["avn.agents.greedy"] = "0" * 64
    monkeypatch.setattr(signature_table, "_table", lambda: table)
    assert known_parameters(name) is None
    assert known_parameters("avn.agents.oracle.Oracle") is not None
    assert known_parameters("somebody.Else") is None


HEAVY = "{'torch', 'numpy', 'pandas', 'numba', 'scipy', 'lightning', 'matplotlib'}"


@pytest.mark.parametrize(
    ("name", "argument"),
    [
        ("eval", "agent=greddy"),
        ("eval", "agent=greedy protocol.max_step=5"),
        ("eval", "agent=plan_exp planner.max_rotations=many"),
        ("train", "model=sound_cmm"),
        ("train", "model=sound_cnn sound_model.epochs=ten"),
        ("generate", "split=mimi"),
        ("reproduce", "row=greedy"),
        ("eval", "agent=greedy takes=4"),
    ],
)
def test_refusals_come_without_large_packages(name, argument):
    code = (
        f"import sys; sys.argv = ['avn.{name}', *'{argument}'.split()]\n"
        f"from avn.{name} import main\n"
        f"print(main(), {HEAVY} & sys.modules.keys())"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "2 set()"
    assert len(done.stderr.strip().splitlines()) == 1
