"""The small apartments that the tests of this folder walk through."""

from small_places import corridor, protocols, two_rooms
from small_worlds import flat, rules

__all__ = ["corridor", "flat", "protocols", "rules", "two_rooms"]
