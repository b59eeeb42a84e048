"""Write `docs/config.md`: every config key with its type, default, meaning and readers.

    python scripts/config_page.py

Keys, types and defaults are those of composed configs.
"""

from __future__ import annotations

import sys
from pathlib import Path

from config_keys import Group, Key, commands, composing, gaps, groups
from config_readers import Readers, find_readers

PAGE = Path(__file__).parents[1] / "docs" / "config.md"
HEAD = """# Config keys

This page is generated from composed configs by `python scripts/config_page.py`.

A key can be set on the command line of each command that reads it:
`python -m avn.eval agent=greedy protocol.num_starts=5`. A group is set to one of its options:
`protocol=stop`. The key `_target_` of a node names the class that the node configures.

Where the column "default" lists several values, a value followed by "in" is the default of the
options that follow; the other value is the default of all remaining options. "Read by" lists the
stages of `src/avn/pipeline/` that read the key, over all rows and all models
([Stages](architecture.md#stages)). A dash means that the key affects no product.
A product is built again when a key that its stage reads has changed.
"""
ADVICE = (
    "describe it in the docstring of its class (`Attributes` or `Parameters`), or in a comment "
    "next to it in conf/"
)


def page(found: list[Group], readers: Readers) -> str:
    """Format the page in Markdown.

    Parameters
    ----------
    found : list of Group
    readers : Readers
    """
    parts = [HEAD]
    for group in found:
        parts.append(f"## {group.name}\n")
        if group.options:
            parts += ["| option | description |", "| --- | --- |"]
            parts += [f"| `{name}` | {_cell(text)} |" for name, text in group.options.items()]
            parts.append("")
        parts += [*_table(group, readers), ""]
    return "\n".join(parts)


def _table(group: Group, readers: Readers) -> list[str]:
    """Format the table of a group's keys, without a column of readers if all have the same."""
    rows = _rows(group)
    names = [_stages(group, next(iter(row.values())), readers) for row in rows]
    head, ruler = "| key | type | default | meaning |", "| --- | --- | --- | --- |"
    if len(rows) > 1 and len(set(names)) == 1:
        return [f"Read by {names[0]}:", "", head, ruler, *(_row(group, row) for row in rows)]
    cells = [f"{_row(group, row)} {own} |" for row, own in zip(rows, names, strict=True)]
    return [f"{head} read by |", f"{ruler} --- |", *cells]


def _stages(group: Group, key: Key, readers: Readers) -> str:
    names = readers.of(key.name)
    if names == readers.stages:
        return "every stage"
    if not names and group.name.startswith("avn."):
        return f"`{group.name}` itself"
    return ", ".join(f"`{name}`" for name in sorted(names)) or "-"


def _rows(group: Group) -> list[dict[str, Key]]:
    """Return the key of each option for each row; equal descriptions share a row."""
    found: dict[tuple[object, ...], dict[str, Key]] = {}
    for option, keys in group.keys.items():
        for key in keys.values():
            alike = key.name, key.kind, key.meaning, key.choices
            found.setdefault(alike, {})[option] = key
    order = list(dict.fromkeys(name for keys in group.keys.values() for name in keys))
    return [own for name in order for alike, own in found.items() if alike[0] == name]


def _row(group: Group, row: dict[str, Key]) -> str:
    key, where = next(iter(row.values())), ""
    # options that stand for nothing have a name at most
    if not {option for option, keys in group.keys.items() if len(keys) > 1} <= set(row):
        where = "<br>only " + ", ".join(f"`{option}`" for option in row)
    kind = f"`{key.kind}`"
    if key.choices:
        kind += ": " + ", ".join(f"`{choice}`" for choice in key.choices)
    cells = (f"`{key.name}`{where}", kind, _defaults(row), _cell(key.meaning))
    return f"| {' | '.join(cells)} |"


def _defaults(row: dict[str, Key]) -> str:
    """Format the default of most options, then those of the others."""
    if all(key.default == option for option, key in row.items()):
        return "name of the option"
    having: dict[str, list[str]] = {}
    for option, key in row.items():
        having.setdefault(key.default, []).append(option)
    (most, first), *others = sorted(having.items(), key=lambda own: -len(own[1]))
    if others and len(first) == 1:
        others, texts = [(most, first), *others], []
    else:
        texts = [f"`{most}`"]
    texts += [f"`{value}` in {', '.join(f'`{o}`' for o in own)}" for value, own in others]
    return "<br>".join(texts)


def _cell(text: str) -> str:
    text = text.replace("|", "\\|").replace("<", "&lt;")
    return text[:1].upper() + text[1:]


def survey() -> tuple[list[Group], Readers]:
    """Find all groups and keys, and the stages that read them."""
    with composing():
        found = groups()
        keys, values = {}, {}
        for group in found:
            every = {name: key for own in group.keys.values() for name, key in own.items()}
            if group.name not in ("agent", "model"):
                keys[group.name] = list(every)
                values[group.name] = [
                    f"{k.name}='{choice}'" for k in every.values() for choice in k.choices
                ]
        found += commands({group.name for group in found})
        return found, find_readers(keys, values)


def main() -> int:
    """Write the page, unless a key has no description."""
    found, readers = survey()
    if missing := gaps(found):
        print(f"no meaning: {', '.join(missing)}; {ADVICE}", file=sys.stderr)
        return 1
    PAGE.write_text(page(found, readers))
    return 0


if __name__ == "__main__":
    sys.exit(main())
