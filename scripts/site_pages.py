"""Hook of mkdocs: pages of the site from outside of `docs/`, and links between all pages.

README.md, CONTRIBUTING.md and CHANGELOG.md are pages, and each package of `src/avn` has a page of
its API. Links in the files are relative to the repository; here they are rewritten to the pages.
"""

from __future__ import annotations

import ast
import re
from pathlib import Path

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

TOP = Path(__file__).parents[1]
DOCS, PACKAGE = TOP / "docs", TOP / "src" / "avn"
# Files of the top folder that are pages.
PAGES = {
    "index.md": "README.md",
    "contributing.md": "CONTRIBUTING.md",
    "changelog.md": "CHANGELOG.md",
}
_FENCE = re.compile(r"^```.*?^```$", re.MULTILINE | re.DOTALL)
_LINK = re.compile(r"(!?)\[([^\]]*)\]\(([^)\s#]+)(#[^)\s]*)?\)")
_CODE = re.compile(r"(?<![\[`])`([\w./-]+\.md)`(?![\]`])")
# A table that belongs to an item of a list: four spaces are needed here, two on GitHub.
_TABLE = re.compile(r"^  (?=\|)", re.MULTILINE)


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Add the pages of the API to the navigation."""
    assert config.nav is not None
    pages = [{f"avn.{name}": f"api/{name}.md"} for name in packages()]
    config.nav.append({"API": ["api/index.md", *pages, {"Commands": "api/commands.md"}]})
    return config


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages from outside of `docs/`."""
    contents = {page: (TOP / name).read_text() for page, name in PAGES.items()}
    contents |= {f"api/{name}.md": _api(f"avn.{name}", PACKAGE / name) for name in packages()}
    contents["api/commands.md"] = _api("avn", PACKAGE)
    contents["api/index.md"] = _index()
    for name, content in contents.items():
        files.append(File.generated(config, name, content=content))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Rewrite links to the pages of the site."""
    uri = page.file.src_uri
    if uri.startswith("api/"):
        return markdown
    page.meta["hide"] = ["navigation"]  # which would be the page alone
    return rewritten(markdown, TOP / PAGES[uri] if uri in PAGES else DOCS / uri)


def packages() -> list[str]:
    """List the packages of `avn`."""
    return sorted(path.parent.name for path in PACKAGE.glob("*/__init__.py"))


def rewritten(text: str, source: Path) -> str:
    """Rewrite the links of a Markdown file to pages of the site, except in fenced code."""

    def link(match: re.Match[str]) -> str:
        image, label, target, anchor = match.groups()
        if ":" in target:
            return match[0]
        page = _page((source.parent / target).resolve())
        if page is None:  # a file that the site does not have; mkdocs tells of one that is nowhere
            return label if (source.parent / target).exists() else match[0]
        return f"{image}[{label}]({page}{anchor or ''})"

    def code(match: re.Match[str]) -> str:
        page = _page(TOP / match[1]) or _page(source.parent / match[1])
        return f"[{match[0]}]({page})" if page else match[0]

    parts = []
    end = 0
    for fence in [*_FENCE.finditer(text), None]:
        plain = text[end : fence.start() if fence else len(text)]
        parts.append(_TABLE.sub("    ", _CODE.sub(code, _LINK.sub(link, plain))))
        if fence:
            parts.append(fence[0])
            end = fence.end()
    return "".join(parts)


def _page(path: Path) -> str | None:
    """Return the path in the site of a file of the repository."""
    for page, name in PAGES.items():
        if path == TOP / name:
            return page
    if path.is_relative_to(DOCS) and path.is_file():
        return path.relative_to(DOCS).as_posix()
    return None


def _api(name: str, folder: Path) -> str:
    """Format the page of a package: all its modules."""
    modules = [f"{name}.{path.stem}" for path in _modules(folder)]
    return "\n\n".join([f"# {name}", *(f"::: {module}" for module in modules)]) + "\n"


def _index() -> str:
    lines = [
        "# API",
        "",
        "What each module is; [Architecture](../architecture.md) says how they hang together.",
    ]
    for name in packages():
        lines += ["", f"## [avn.{name}]({name}.md)", "", "| module | what it is |", "| --- | --- |"]
        for path in _modules(PACKAGE / name):
            summary = (ast.get_docstring(ast.parse(path.read_text())) or "").split("\n")[0]
            module = f"avn.{name}.{path.stem}"
            lines.append(
                f"| [{path.stem}]({name}.md#{module}) | {summary.replace('|', chr(92) + '|')} |"
            )
    return "\n".join(lines) + "\n"


def _modules(folder: Path) -> list[Path]:
    return sorted(path for path in folder.glob("*.py") if path.stem != "__init__")
