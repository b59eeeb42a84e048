"""Write `src/avn/config/signatures.json`, the parameters of the classes of all options.

Run it after a change of a constructor. Without it, commands import torch before they answer.
"""

from __future__ import annotations

import re
from pathlib import Path

from avn.config.signature_table import TABLE, table_text
from avn.config.signatures import schema_type

ROOT = Path(__file__).parents[1]
# Classes that options name, and the defaults of their parts in the code.
_NAMED = re.compile(r"_target_\"?: *\"?(avn(?:\.\w+)+)")


def targets() -> list[str]:
    """Return the classes of the package that options and defaults name."""
    files = [*(ROOT / "conf").rglob("*.yaml"), *(ROOT / "src" / "avn").rglob("*.py")]
    return [name for file in files for name in _NAMED.findall(file.read_text("utf-8"))]


def main() -> None:
    """Write the table."""
    TABLE.write_text(table_text(targets(), schema_type))


if __name__ == "__main__":
    main()
