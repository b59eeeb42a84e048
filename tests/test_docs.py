"""What the documents say can be followed: links lead somewhere, and commands compose."""

import importlib
import re
import shlex
import sys
from pathlib import Path

import pytest

from avn.__main__ import COMMANDS
from avn.config import cli
from avn.config.folder import conf_folder
from avn.config.renamed import OPTIONS
from avn.core import numerics

TOP = Path(__file__).parents[1]
CHANGELOG = TOP / "CHANGELOG.md"
FILES = [TOP / "README.md", TOP / "CONTRIBUTING.md", CHANGELOG, *sorted(TOP.glob("docs/*.md"))]
# Files whose code is today's; a changelog has old names too.
OF_TODAY = [path for path in FILES if path != CHANGELOG]
PLACEHOLDERS = ("MINE", "COMMAND", " ...")
FENCE = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
SPAN = re.compile(r"`([^`]+)`")
LINK = re.compile(r"\[[^\]]*\]\(([^)\s]*)\)")
HEADING = re.compile(r"^#+ (.*)$", re.MULTILINE)
LINE = re.compile(r"(?:PYTHONPATH=(\S+) )?(?:python -m avn\.|avn )(\w+)(.*)", re.DOTALL)


def spans(text):
    """Inline code, outside of code blocks."""
    return [" ".join(span.split()) for span in SPAN.findall(FENCE.sub("", text))]


def code_lines(text):
    """Lines of code blocks of commands without their comments, and inline code."""
    blocks = [block for language, block in FENCE.findall(text) if language in ("", "sh", "bash")]
    lines = [re.sub(r"\s+#.*", "", line.strip()) for own in blocks for line in own.splitlines()]
    return [line for line in lines + spans(text) if not any(p in line for p in PLACEHOLDERS)]


def anchors(text):
    """The anchors of a file's headings as GitHub makes them."""
    found = set()
    for heading in HEADING.findall(FENCE.sub("", text)):
        slug = re.sub(r"[^\w\- ]", "", heading.strip().lower()).replace(" ", "-")
        same = sum(own == slug or re.fullmatch(rf"{slug}-\d+", own) is not None for own in found)
        found.add(f"{slug}-{same}" if same else slug)
    return found


def dead_links(path):
    """Links of a file to files and headings that are not there."""
    text, dead = SPAN.sub("", FENCE.sub("", path.read_text())), []
    for link in LINK.findall(text):
        target, _, anchor = link.partition("#")
        if "://" in target or target.startswith("mailto:"):
            continue
        file = (path.parent / target).resolve() if target else path
        if not file.exists() or (anchor and anchor not in anchors(file.read_text())):
            dead.append(link)
    return dead


def targets():
    """The targets of the Makefile."""
    return set(re.findall(r"^([\w-]+):", (TOP / "Makefile").read_text(), re.MULTILINE))


def known_keys():
    """Config keys, and the nodes that they lie in."""
    keys = re.findall(r"^\| `([\w.]+)`", (TOP / "docs" / "config.md").read_text(), re.MULTILINE)
    return {".".join(key.split(".")[:n]) for key in keys for n in range(1, key.count(".") + 2)}


def unknown_keys(text):
    """Dotted settings, as `group.key=value`, that no config has."""
    groups = {folder.name for folder in conf_folder().iterdir() if folder.is_dir()}
    found = re.findall(r"(?<![\w./-])([a-z]\w*(?:\.\w+)+)=", "\n".join(code_lines(text)))
    return {key for key in found if key.split(".")[0] in groups} - known_keys()


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_links_lead_to_files_and_headings(path):
    assert not dead_links(path)


@pytest.mark.parametrize("path", OF_TODAY, ids=lambda path: path.name)
def test_paths_in_code_are_there(path):
    """Also those in examples, which begin where the examples lie."""
    folders = "docs", "conf", "src", "scripts", "tests", "benchmarks"
    for span in spans(path.read_text()):
        if span.split("/")[0] in folders and re.fullmatch(r"[\w./-]+", span):
            assert (TOP / span).exists() or (TOP / "docs" / "examples" / span).exists(), span


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_blocks_of_python_compile(path):
    for language, block in FENCE.findall(path.read_text()):
        if language in ("python", "py"):
            compile(block, str(path), "exec")


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_make_has_the_targets(path):
    named = {
        own[1] for own in map(re.compile(r"make (\w+)").match, code_lines(path.read_text())) if own
    }
    assert named <= targets()


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_scripts_are_there(path):
    for line in code_lines(path.read_text()):
        if script := re.match(r"python (\S+\.py)", line):
            assert (TOP / script[1]).is_file(), line


@pytest.mark.parametrize("path", OF_TODAY, ids=lambda path: path.name)
def test_settings_are_keys(path):
    # an example of a parameter that a class of the reader's has
    assert unknown_keys(path.read_text()) <= {"sound_model.layers"}


@pytest.mark.parametrize("path", OF_TODAY, ids=lambda path: path.name)
def test_options_have_the_names_of_today(path):
    dotted = "|".join(re.escape(own) for own in OPTIONS if "." in own)
    single = "|".join(f"{own}=" for own in OPTIONS if "." not in own)
    found = re.findall(
        rf"(?<![\w./-])(?:(?:{dotted})(?![\w])|(?:{single})|a3c\.\w+=)", path.read_text()
    )
    assert not [own for own in found if own != "mapper.network"]


def commands():
    """Each command line of avn that stands in a document, once."""
    lines = (line for path in OF_TODAY for line in code_lines(path.read_text()))
    return list(dict.fromkeys(line for line in lines if LINE.match(line)))


def compose(line, monkeypatch, outputs):
    """Run a command line up to where its config is composed and checked; gives the exit code."""
    pythonpath, name, rest = LINE.match(line).groups()
    words = shlex.split(rest.split("--cfg")[0])
    arguments = [own for own in words if own != "-m"]
    if pythonpath:
        monkeypatch.syspath_prepend(TOP / pythonpath)
    monkeypatch.chdir(TOP)
    assert name in COMMANDS, line
    if name in ("figures", "report", "compare", "ls", "rm"):
        importlib.import_module(f"avn.{name}")._parse(arguments)
        return 0
    if name == "demo":
        name, arguments = "eval", ["experiment=demo", *arguments]
    if "experiment=" in rest:  # its jobs are in `tests/config/test_experiments.py`
        arguments.append("hydra.mode=RUN")
    monkeypatch.setattr(sys, "argv", [f"avn.{name}", *arguments, f"outputs={outputs}"])
    monkeypatch.setattr(numerics, "use", lambda *_: None)  # `portable` would start pytest again
    return cli.command(name)(lambda cfg: None)()


@pytest.mark.parametrize("line", commands())
def test_commands_compose(line, monkeypatch, tmp_path, capsys):
    if line.endswith("--help"):
        assert LINE.match(line)[2] in COMMANDS
        return
    code = compose(line, monkeypatch, tmp_path)
    assert code == 0, capsys.readouterr().err


def test_the_table_of_groups_has_every_option():
    table = dict(
        re.findall(r"^\| `(\w+)` \| (.*?) \|", (TOP / "docs/architecture.md").read_text(), re.M)
    )
    groups = [group for group in table if (TOP / "conf" / group).is_dir()]
    assert len(groups) > 20
    for group in set(groups) - {"experiment", "model", "sound"}:  # described in words
        options = {path.stem for path in (TOP / "conf" / group).glob("*.yaml")}
        assert options <= set(re.findall(r"`(\w+)`", table[group])), group


def test_there_are_commands_to_check():
    assert len(commands()) > 15
    assert {LINE.match(line)[2] for line in commands()} == set(COMMANDS)


@pytest.mark.parametrize(
    "line",
    [
        "python -m avn.eval agent=greedy protocol.start=4",
        "avn eval agent=gredy",
        "python -m avn.train model=sound_cnn +sound_model.epoch=3",
    ],
)
def test_a_command_that_does_not_compose_is_found(line, monkeypatch, tmp_path):
    assert compose(line, monkeypatch, tmp_path) == 2


def test_a_dead_link_is_found(tmp_path):
    (tmp_path / "other.md").write_text("# A heading, twice\n\n# A heading, twice\n")
    links = ["other.md", "other.md#a-heading-twice-1", "other.md#none", "none.png", "#here", "#not"]
    text = "# Here\n\n" + " ".join(f"[x]({link})" for link in links) + "\n`[x](y)`\n"
    (tmp_path / "page.md").write_text(text)
    assert dead_links(tmp_path / "page.md") == ["other.md#none", "none.png", "#not"]


def test_an_old_key_is_found():
    text = "Set `protocol.begins=3`, `avn.train model=a sound_model.net.depth=3` and `a.b=3`.\n"
    assert unknown_keys(text) == {"protocol.begins", "sound_model.net.depth"}
