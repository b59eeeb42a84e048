"""`avn rm [RUN...] [key=value ...]`: lists products that no run needs, with their sizes.

With `delete=true` they are deleted. A run is deleted only if its folder is named. Options:
`outputs=outputs`, `delete=false`.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from avn.config.cli import plainly
from avn.core.errors import UserError
from avn.core.progress import log

_OPTIONS = {"outputs": "outputs", "delete": "false"}


def main(arguments: Sequence[str] | None = None) -> int:
    """List the products, delete them on request, and return the exit code."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    if any(argument in ("-h", "--help") for argument in given):
        print(__doc__)
        return 0
    return plainly("avn.rm", lambda: _remove(given))


def _remove(arguments: Sequence[str]) -> None:
    options, named = _parse(arguments)
    outputs = Path(options["outputs"])

    from avn.config.saved import read_config
    from avn.pipeline import unused
    from avn.pipeline.run_list import run_folders

    runs = unused.named_runs(outputs, named)
    kept = [folder for folder in run_folders(outputs) if folder not in runs]
    configs = [read_config(folder) for folder in kept]
    old = sum(not unused.is_current(*pair) for pair in zip(kept, configs, strict=True))
    products = [*map(unused.product_of, runs), *unused.unused_products(outputs, configs)]
    for product in products:
        log(f"{_size(product.size):>10}  {product.path}")
    total = _size(sum(product.size for product in products))
    log(f"{total} in {len(products)} products that none of {len(kept)} runs needs")
    if old:
        log(
            f"{old} of the runs are of another version of avn or of other recordings: what they "
            "were made from is in the list, and their films and pages can no longer be made"
        )
    if options["delete"] == "false":
        log("nothing is deleted; delete=true deletes the list" if products else "nothing to delete")
        return
    for product in products:
        if not unused.delete(product):
            log(f"{product.path}: kept, another process is making it")


def _parse(arguments: Sequence[str]) -> tuple[dict[str, str], list[Path]]:
    options, named = dict(_OPTIONS), []
    for argument in arguments:
        key, equals, value = argument.partition("=")
        if not equals:
            named.append(Path(argument))
        elif key in options and value:
            options[key] = value
        elif Path(argument).exists():
            named.append(Path(argument))
        else:
            raise UserError(f"{argument}: no such option; there are {', '.join(options)}")
    if options["delete"] not in ("true", "false"):
        raise UserError(f"delete: '{options['delete']}' is neither true nor false")
    return options, named


def _size(count: int) -> str:
    """Format a number of bytes."""
    for unit, word in ((1e9, "GB"), (1e6, "MB")):
        if count >= unit:
            return f"{count / unit:.1f} {word}"
    return f"{count / 1e3:.1f} kB"


if __name__ == "__main__":
    sys.exit(main())
