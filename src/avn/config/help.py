"""Help of a command: its settings, read from the comments of the files in the `conf` folder.

Nothing is composed and no large package imported, so that help is fast.
"""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import yaml

from avn.config.folder import conf_folder

_WIDTH = 100
_SWEPT = "hydra.sweeper.params."
# An entry of a defaults list that sets another group, `override /GROUP: OPTION`.
_CHOICE = re.compile(r"\boverride /(\w+)(?:@[\w.]+)?: *([^\s,\]]+)")


@dataclass(frozen=True)
class _Entry:
    """Line `key: value` of a YAML file, with the comments above and beside it."""

    key: str
    value: str | None
    above: str
    beside: str = ""


@dataclass(frozen=True)
class _Config:
    """Content of a top-level config that the help shows."""

    examples: list[str]
    defaults: list[_Entry]
    settings: list[_Entry]


@dataclass(frozen=True)
class _Group:
    """Config group, set by `name=OPTION`."""

    name: str
    options_of: str
    default: str | None = None
    comment: str = ""


def is_asked(arguments: Iterable[str]) -> bool:
    """Return whether a command line asks for help."""
    return not {"-h", "--help"}.isdisjoint(arguments)


def help_text(command: str, folders: Sequence[Path], spellings: Mapping[str, str]) -> str:
    """Return the help of a command.

    Parameters
    ----------
    command : str
        Name of the command's config.
    folders : sequence of Path
        Config folders of the user, whose options are listed too.
    spellings : mapping of str to str
        Hydra's spelling of the keys that set a group of the training world.
    """
    places = [conf_folder(), *folders]
    configs = list(_configs(command, places))
    command_settings, *shared = (_settings(config.settings) for config in configs)
    examples = configs[0].examples or [f"python -m avn.{command}"]
    lines = [
        f"usage: python -m avn.{command} [KEY=VALUE ...] [-m] [--config-dir FOLDER]",
        *(f"       {line}" for line in examples),
        "",
        "Groups, GROUP=OPTION. * marks the default; in brackets stands what an option chooses in",
        "other groups in place of their defaults.",
        *(line for group in _groups(configs, places, spellings) for line in _listed(group, places)),
        *(
            ["", "Settings of this command, with their defaults:", *command_settings]
            if command_settings
            else ()
        ),
        "",
        "Settings of all commands, with their defaults:",
        *(line for settings in shared for line in settings),
        "",
        "More:",
        *_more(re.sub(r"\s*\[.*?\]", "", examples[0]), configs),
    ]
    return "\n".join(lines)


def _more(example: str, configs: Iterable[_Config]) -> list[str]:
    """Return the closing lines of the help; `example` is a command line."""
    swept = " ".join(
        f"{entry.key.removeprefix(_SWEPT)}={entry.value}"
        for config in configs
        for entry in config.settings
        if entry.key.startswith(_SWEPT)
    )
    return [
        f"  {example} --cfg job",
        "      prints the whole config as it is composed, with the settings of each group;",
        "      one of those is set by GROUP.KEY=VALUE. docs/config.md describes every key.",
        "  KEY=A,B,C -m",
        f"      runs a job for each value{f'; a bare -m runs {swept}' if swept else ''}.",
        "  --config-dir FOLDER",
        "      adds options of your own, FOLDER/GROUP/OPTION.yaml; --help lists them with ours.",
    ]


def _configs(name: str, places: Sequence[Path]) -> Iterator[_Config]:
    """Yield a top-level config and those in its defaults list, the outer ones first."""
    paths = [path for place in places if (path := place / f"{name}.yaml").is_file()]
    if "/" in name or not paths:  # a schema, or `_self_`
        return
    config = _read(paths[-1])
    yield config
    for entry in config.defaults:
        if entry.value is None:
            yield from _configs(entry.key, places)


def _read(path: Path) -> _Config:
    text = path.read_text(encoding="utf-8")
    lines = text.splitlines()
    defaults: list[_Entry] = []
    settings: list[_Entry] = []
    root = yaml.compose(text, Loader=yaml.SafeLoader)
    for key, node in root.value if isinstance(root, yaml.MappingNode) else ():
        if key.value != "defaults":
            settings += _entries(key, node, lines)
            continue
        for item in node.value:
            pairs = item.value if isinstance(item, yaml.MappingNode) else [(item, None)]
            defaults += [_Entry(k.value, v and _plain(v), _above(lines, k)) for k, v in pairs]
    return _Config(_leading(lines), defaults, settings)


def _entries(
    key: yaml.Node, node: yaml.Node, lines: Sequence[str], prefix: str = ""
) -> Iterator[_Entry]:
    """Yield the entries of a key; those of a mapping have dotted names."""
    name = f"{prefix}{key.value}"
    if isinstance(node, yaml.MappingNode) and node.value:
        for inner, value in node.value:
            yield from _entries(inner, value, lines, f"{name}.")
        return
    end = node.end_mark
    rest = lines[end.line][end.column :].strip() if end.line < len(lines) else ""
    beside = rest if rest.startswith("#") else ""
    yield _Entry(name, _plain(node), _above(lines, key), beside.lstrip("# "))


def _plain(node: yaml.Node) -> str:
    """Return a value as it may be given on the command line."""
    if isinstance(node, yaml.SequenceNode):
        return f"[{', '.join(map(_plain, node.value))}]"
    if isinstance(node, yaml.MappingNode):
        return f"{{{', '.join(f'{_plain(k)}: {_plain(v)}' for k, v in node.value)}}}"
    quoted = isinstance(node, yaml.ScalarNode) and node.style
    return node.value or ("''" if quoted else "null")


def _above(lines: Sequence[str], key: yaml.Node) -> str:
    """Return the comment that ends on the line above a key."""
    start = end = key.start_mark.line
    while start and lines[start - 1].lstrip().startswith("#"):
        start -= 1
    return " ".join(line.strip().lstrip("# ") for line in lines[start:end])


def _leading(lines: Iterable[str]) -> list[str]:
    """Return the lines of a file's leading comment, without Hydra's `@package`."""
    comment = []
    for line in lines:
        if not line.startswith("#"):
            break
        comment.append(line.lstrip("# ").rstrip())
    return [line for line in comment if line and not line.startswith("@package")]


def _groups(
    configs: Sequence[_Config], places: Sequence[Path], spellings: Mapping[str, str]
) -> list[_Group]:
    """Return the groups of a command: test world first, groups of the user's folders last."""
    names = {spelt.lstrip("+"): key for key, spelt in spellings.items()}
    groups: dict[str, _Group] = {}
    for entry in (entry for config in configs for entry in config.defaults):
        key = re.sub(r"^(override |optional )*/?", "", entry.key)
        if entry.value is not None and not key.startswith("hydra/"):
            group = _Group(names.get(key, key), key.split("@")[0], entry.value, entry.above)
            groups.setdefault(key, group)
    for key, name in names.items():
        groups.setdefault(key, _Group(name, key.split("@")[0]))
    ours, *theirs = [[path.name for path in sorted(p.iterdir()) if path.is_dir()] for p in places]
    new = dict.fromkeys(name for names in theirs for name in names if name not in ours)
    return [
        *(group for key, group in groups.items() if "@" not in key),
        *(group for key, group in groups.items() if "@" in key),
        *(_Group(f"+{name}", name) for name in new if _options(name, places)),
    ]


def _options(group: str, places: Sequence[Path]) -> dict[str, str]:
    """Return the options of a group, each with its description."""
    files = {file.stem: file for place in places for file in (place / group).glob("*.yaml")}
    return {name: _description(files[name].read_text("utf-8", "replace")) for name in sorted(files)}


def _description(text: str) -> str:
    """Return the leading comment of an option's file, and the other groups that it sets."""
    others = ", ".join(f"{group}={option}" for group, option in _CHOICE.findall(text))
    return " ".join([*_leading(text.splitlines()), *([f"[{others}]"] if others else [])])


def _listed(group: _Group, places: Sequence[Path]) -> Iterator[str]:
    state = {"???": " (must be given)", "null": " (none by default)"}.get(group.default or "", "")
    if group.name.lstrip("+") != group.options_of:  # its options are listed there
        yield from _comment(group.comment, "  ")
        default = f" (default: {group.default})" if group.default and not state else state
        yield f"  {group.name}: one of {group.options_of}{default}"
        return
    yield f"  {group.name}{state}"
    yield from _comment(group.comment, "      ")
    options = _options(group.options_of, places)
    column = max(map(len, options), default=0) + 2
    for name, comment in options.items():
        mark = "*" if name == group.default else " "
        yield _wrapped(comment, f"    {mark} {name:{column}}", " " * (6 + column))


def _settings(entries: Iterable[_Entry]) -> list[str]:
    """Return the settings as lines `key=value`, each under its comment, without Hydra's."""
    lines = []
    for entry in entries:
        if not entry.key.startswith("hydra."):
            beside = f"  # {entry.beside}" if entry.beside else ""
            lines += _comment(entry.above, "  # ")
            lines.append(_wrapped(f"{entry.key}={entry.value}{beside}", "  ", "      "))
    return lines


def _comment(text: str, indent: str) -> list[str]:
    return [_wrapped(text, indent, indent)] if text else []


def _wrapped(text: str, first: str, rest: str) -> str:
    if not text:
        return first.rstrip()
    return textwrap.fill(
        text, _WIDTH, initial_indent=first, subsequent_indent=rest, break_on_hyphens=False
    )
