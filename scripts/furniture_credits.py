"""Credits and licences of the furniture models, for the assets' README.

Read by `extract_furniture.py`.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

LIBRARIES = {
    "cc0": ("BlendSwap-CC-0", "CC0-1.0"),
    "ccby": ("BlendSwap-CC-BY", "CC-BY-3.0"),
    "scopia": ("Scopia", "CC-BY-3.0"),
    "kator": ("KatorLegaz", "CC-BY-3.0-US"),
}
# Authors whom the libraries ask to be credited in these words; all others are of blendswap.com.
AUTHORS = {
    "Scopia": "Emmanuel Puybaret / eTeks and Scopia Visual Interfaces Systems, s.l. (scopia.es)",
    "Kator Legaz": "Andrew Kator & Jennifer Legaz (katorlegaz.com)",
}
_NAMES = {"CC0": "CC0-1.0", "CC-BY-3.0": "CC-BY-3.0", "CC-BY-3.0-USA": "CC-BY-3.0-US"}
_LINKS = {
    "CC0-1.0": "https://creativecommons.org/publicdomain/zero/1.0/",
    "CC-BY-3.0": "https://creativecommons.org/licenses/by/3.0/",
    "CC-BY-3.0-US": "https://creativecommons.org/licenses/by/3.0/us/",
}


def licences(package: Path) -> dict[str, str]:
    """Read the texts of the licences from Debian's copyright file of the package."""
    path = next(package.rglob("sweethome3d-furniture/copyright"))
    found = {}
    for block in re.split(r"\n\n(?=\S)", path.read_text(encoding="utf-8")):
        head, _, text = block.partition("\n")
        name = _NAMES.get(head.removeprefix("License: "))
        if head.startswith("License: ") and name and text.strip():
            lines = (re.sub(r"^ \.?(?=$)|^ ", "", line) for line in text.splitlines())
            found[name] = f"{_LINKS[name]}\n\n" + "\n".join(lines).strip() + "\n"
    if set(found) != set(_LINKS):
        raise SystemExit(f"{path}: has the licences {sorted(found)} only")
    return found


def credits_of(rows: list[dict[str, Any]]) -> str:
    """Format README.md of the assets: origin, authors and changes of the models."""
    groups = [
        ("CC0 1.0 (`LICENSE.CC0-1.0.txt`), with thanks", "CC0-1.0"),
        ("CC BY 3.0 Unported (`LICENSE.CC-BY-3.0.txt`)", "CC-BY-3.0"),
        ("CC BY 3.0 United States (`LICENSE.CC-BY-3.0-US.txt`)", "CC-BY-3.0-US"),
        ("Apache 2.0, as the package: made of boxes", "Apache-2.0"),
    ]
    text = f"""# Furniture models

{len(rows)} models for the views, each in one of three pools (train, validation, test) that share
neither models nor pictures; `catalogue.json` lists them, `avn.views.furniture_models` tells the
format. `scripts/extract_furniture.py` makes all files of this folder.

- Source: Debian package `sweethome3d-furniture` 1.8, libraries BlendSwap-CC-0, BlendSwap-CC-BY,
  Scopia and KatorLegaz, collected and converted to OBJ by Emmanuel Puybaret / eTeks
  (<http://www.sweethome3d.com>).
- Changes: every model is turned and scaled to a unit box, cut down to fewer triangles, and its
  pictures are made smaller; glass is made opaque. Handles, taps and frames that stick out are
  pressed in, some colours are made lighter, some models are put together with plain boxes
  (planters, walls of a shower, cabinets).
- Models of CC BY 3.0 stay under that licence when you pass this folder on: keep this file.
"""
    for title, licence in groups:
        own = [row for row in rows if row["licence"].split(" and ")[-1] == licence]
        text += f"\n## {title}\n\n"
        for row in own:
            text += f'- `{row["name"]}`: "{row["title"]}", {row["source"]}, by {row["author"]}'
            text += f" ({row['licence']})\n" if row["licence"] != licence else "\n"
    return text
