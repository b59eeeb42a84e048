"""The pools that the three parts of a split draw colours, patterns and light from.

Nothing stands in two pools. Each spans light and dark, warm and cold, plain and patterned, so
that another pool is new and yet not of another world.
"""

from __future__ import annotations

from typing import Any

# sRGB colours by part and material; an apartment's room takes one, off by 4 of 255 at most.
COLOURS: dict[str, dict[str, Any]] = {
    "train": {
        "parquet": (
            (186, 140, 92),
            (122, 84, 56),
            (205, 172, 128),
            (152, 106, 66),
            (166, 150, 130),
            (98, 70, 52),
        ),
        "wood": ((236, 232, 224), (150, 108, 70), (206, 172, 124)),
        "carpet": (
            (176, 164, 144),
            (104, 116, 136),
            (128, 132, 104),
            (140, 84, 80),
            (132, 130, 128),
            (196, 190, 178),
        ),
        "floor_tiles": ((206, 200, 190), (150, 148, 146), (190, 150, 116), (92, 94, 98)),
        "floor_tiles_second": ((70, 72, 76), (128, 116, 104), (232, 230, 224)),
        "wall_tiles": ((234, 236, 234), (176, 206, 212), (228, 216, 192), (160, 184, 156)),
        "plaster": (
            (236, 230, 216),
            (214, 196, 164),
            (190, 204, 212),
            (202, 212, 186),
            (226, 200, 186),
            (216, 216, 216),
            (232, 214, 150),
            (150, 166, 182),
        ),
        "painted_brick": ((228, 222, 212), (176, 104, 82), (194, 190, 182), (206, 186, 160)),
        "ceiling_plaster": ((246, 244, 240), (240, 240, 240)),
        "sky": (((120, 168, 226), (222, 234, 246)), ((198, 206, 216), (232, 234, 236))),
        "ground": ((92, 116, 70), (134, 122, 108), (70, 88, 58)),
    },
    "validation": {
        "parquet": ((174, 126, 76), (138, 96, 62), (194, 160, 114), (110, 78, 46)),
        "wood": ((226, 222, 212), (128, 88, 54)),
        "carpet": ((186, 174, 158), (90, 102, 118), (146, 140, 120), (118, 94, 110)),
        "floor_tiles": ((216, 212, 204), (172, 138, 108), (128, 130, 130)),
        "floor_tiles_second": ((54, 58, 64), (150, 136, 122)),
        "wall_tiles": ((224, 228, 226), (190, 214, 200), (218, 204, 210)),
        "plaster": (
            (228, 220, 200),
            (202, 210, 222),
            (222, 208, 176),
            (188, 198, 172),
            (224, 224, 222),
            (212, 186, 170),
        ),
        "painted_brick": ((218, 214, 202), (162, 92, 74), (204, 198, 194)),
        "ceiling_plaster": ((250, 248, 244), (236, 236, 232)),
        "sky": (((142, 180, 220), (228, 236, 240)), ((180, 190, 206), (222, 226, 230))),
        "ground": ((104, 124, 86), (146, 134, 122)),
    },
    "test": {
        "parquet": (
            (180, 134, 84),
            (112, 76, 48),
            (214, 182, 140),
            (146, 100, 74),
            (156, 140, 122),
        ),
        "wood": ((242, 240, 236), (164, 120, 78), (110, 76, 50)),
        "carpet": ((168, 154, 132), (116, 126, 144), (138, 146, 118), (150, 100, 90)),
        "floor_tiles": ((198, 192, 180), (182, 160, 132), (108, 110, 114), (222, 218, 212)),
        "floor_tiles_second": ((84, 80, 78), (116, 124, 128)),
        "wall_tiles": ((240, 240, 236), (166, 196, 220), (236, 226, 206)),
        "plaster": (
            (232, 226, 224),
            (206, 200, 170),
            (180, 196, 200),
            (212, 220, 202),
            (230, 210, 200),
            (222, 206, 158),
        ),
        "painted_brick": ((236, 230, 222), (186, 114, 92), (184, 180, 176)),
        "ceiling_plaster": ((244, 242, 234), (238, 240, 242)),
        "sky": (((104, 156, 216), (214, 230, 244)), ((208, 212, 218), (238, 238, 238))),
        "ground": ((82, 108, 62), (124, 116, 104)),
    },
}

# How courses are laid: name, courses, stones in each (or length of a stave), metres a repeat.
LAYOUTS: dict[str, dict[str, Any]] = {
    "train": {
        "parquet": (
            ("planks", 16, 2, 2.0),
            ("planks", 12, 1, 2.0),
            ("bond", 20, 4, 2.0),
            ("herringbone", 2, 5, 1.8),
        ),
        "carpet": (("plain",), ("stripes",), ("loops",)),
        "floor_tiles": (("square", 5, 5, 1.5), ("checks", 6, 6, 1.8), ("bond", 6, 3, 1.8)),
        "wall_tiles": (("square", 10, 10, 1.5), ("bond", 12, 6, 1.2), ("square", 8, 4, 1.6)),
        "plaster": (("plain",), ("plain",), ("rough",), ("stripes",), ("diamonds",)),
        "painted_brick": (("bond", 20, 6, 1.5),),
    },
    "validation": {
        "parquet": (("planks", 14, 2, 2.0), ("herringbone", 2, 4, 1.6)),
        "carpet": (("plain",), ("checks",)),
        "floor_tiles": (("square", 4, 4, 1.6), ("checks", 8, 8, 1.6)),
        "wall_tiles": (("square", 8, 8, 1.6), ("bond", 10, 4, 1.2)),
        "plaster": (("plain",), ("fine_stripes",), ("dots",)),
        "painted_brick": (("bond", 18, 5, 1.4),),
    },
    "test": {
        "parquet": (("planks", 18, 2, 2.2), ("bond", 14, 2, 1.9), ("herringbone", 3, 3, 1.7)),
        "carpet": (("plain",), ("flecks",)),
        "floor_tiles": (("square", 3, 3, 1.5), ("bond", 4, 2, 1.7), ("checks", 4, 4, 1.6)),
        "wall_tiles": (("square", 12, 12, 1.5), ("square", 6, 3, 1.5), ("band", 9, 6, 1.8)),
        "plaster": (("plain",), ("leaves",), ("plain",)),
        "painted_brick": (("third", 19, 6, 1.6),),
    },
}

# Colours of lamps and sky (linear RGB), whose brightness says how much of the light is theirs.
LIGHT: dict[str, tuple[tuple[tuple[float, float, float], tuple[float, float, float]], ...]] = {
    "train": (
        ((1.0, 0.82, 0.62), (0.86, 0.96, 1.10)),
        ((0.7, 0.62, 0.52), (1.30, 1.36, 1.42)),
        ((1.1, 1.02, 0.92), (0.60, 0.70, 0.86)),
        ((1.3, 1.00, 0.70), (0.34, 0.42, 0.60)),
    ),
    "validation": (
        ((0.9, 0.76, 0.60), (0.96, 1.04, 1.14)),
        ((1.2, 1.06, 0.90), (0.50, 0.58, 0.70)),
        ((0.8, 0.74, 0.66), (1.10, 1.14, 1.18)),
    ),
    "test": (
        ((1.0, 0.86, 0.70), (0.80, 0.92, 1.08)),
        ((1.2, 0.96, 0.72), (0.44, 0.52, 0.68)),
        ((0.8, 0.68, 0.54), (1.20, 1.26, 1.34)),
        ((1.1, 1.04, 0.98), (0.66, 0.74, 0.84)),
    ),
}
