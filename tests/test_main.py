"""The console script `avn`."""

import sys
from pathlib import Path

import avn
from avn.__main__ import COMMANDS, main


def run(monkeypatch, capsys, *arguments):
    monkeypatch.setattr(sys, "argv", ["avn", *arguments])
    code = main()
    said = capsys.readouterr()
    return code, said.out, said.err


def test_the_commands_are_those_of_the_package_and_are_listed(monkeypatch, capsys):
    modules = {path.stem for path in Path(avn.__file__).parent.glob("*.py")}
    assert modules - {"__init__", "__main__", "library"} == set(COMMANDS)
    for arguments in ((), ("--help",)):
        code, out, _ = run(monkeypatch, capsys, *arguments)
        assert code == 0
        assert all(f"  {name} " in out for name in COMMANDS)


def test_another_word_is_one_line(monkeypatch, capsys):
    code, _, err = run(monkeypatch, capsys, "evaluate")
    assert code == 2
    assert err == "avn: 'evaluate' is none of " + ", ".join(COMMANDS) + "\n"


def test_a_command_gets_the_rest_of_the_line_and_gives_its_code(monkeypatch, capsys, tmp_path):
    options = ("agent=greedy", "look=around", f"outputs={tmp_path}")
    code, _, err = run(monkeypatch, capsys, "eval", *options)
    assert code == 2
    assert err.startswith("avn.eval: look: not read by this run")
    code, _, err = run(monkeypatch, capsys, "figures", str(tmp_path))
    assert code == 2
    assert "no run's folder" in err
