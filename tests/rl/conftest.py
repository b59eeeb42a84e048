"""The small world that the tests of this folder learn in."""

from small_worlds import flat, rules

__all__ = ["flat", "rules"]
