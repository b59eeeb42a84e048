"""Layout of the fields of `sound_fields`, for the searches that fill them."""

from __future__ import annotations

# Units of length on a free square, straight and diagonal; their ratio is sqrt(2) within 1 %.
STRAIGHT, DIAGONAL = 5, 7
# Length of what was not reached.
UNREACHED = 32767
# Longest step in units.
LONGEST = 31
# Parts of a state: the neighbour from which the path comes, 0 to 7 in the order of rows, or none;
# whether the path has left the line of sight; and what is known of the line of sight.
FROM, NOWHERE = 15, 8
BENT = 16
SIGHT, CLEAR_SIGHT, DARK, UNKNOWN = 96, 0, 32, 64
# Marks of squares in a search: not looked at; waiting, with a known or an unknown predecessor, or
# for its direction alone; done, without a change, with another direction, or with another path; and
# invalidated.
RESTING, KNOWN, WAITING, LOOKING, SAME, TURNED, CHANGED, INVALID = range(8)
