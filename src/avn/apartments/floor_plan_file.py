"""Files of floor plans: JSON texts that are read and checked."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from avn.apartments.floor_plan import FloorPlan, from_dict
from avn.apartments.floor_plan_checks import check
from avn.core.errors import UserError


def load(path: Path) -> FloorPlan:
    """Read a plan from a JSON file.

    Raises
    ------
    UserError
        If the file cannot be read, is not JSON, lacks a key or has an unknown one, or if the plan
        cannot be built. The message names the file, the entry, the fault and the remedy.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
        data = json.loads(text, object_pairs_hook=_object)
    except OSError as error:
        raise UserError(f"{path}: {error.strerror}; give the path of a floor plan") from error
    except UnicodeDecodeError as error:
        raise UserError(f"{path}: not UTF-8 text; give a floor plan in JSON") from error
    except RecursionError as error:
        raise UserError(f"{path}: nested too deeply; give a floor plan in JSON") from error
    except ValueError as error:
        raise UserError(f"{path}: not JSON ({error}); mend it, or give another file") from error
    plan = from_dict(data, str(path))
    check(plan, str(path))
    return plan


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Build a JSON object, and refuse one with a key that is given twice."""
    data = dict(pairs)
    if len(data) < len(pairs):
        keys = [key for key, _ in pairs]
        twice = next(key for key in keys if keys.count(key) > 1)
        raise ValueError(f"key {twice!r} is given twice in one object")
    return data
