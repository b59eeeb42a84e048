"""`python -m avn.demo`: a first try, one home and a film of one episode in about two minutes.

The same as `python -m avn.eval experiment=demo`; further settings change it.
"""

from __future__ import annotations

import sys

from avn import eval as evaluation


def main() -> int:
    """Evaluate the agent of `experiment=demo`, and film an episode."""
    sys.argv[1:1] = ["experiment=demo"]
    return evaluation.main()


if __name__ == "__main__":
    sys.exit(main())
