import numpy as np

from avn.apartments.generator import generate
from avn.apartments.grid import build_grid
from avn.reporting.contact_sheet import contact_sheet, sheet_states


def test_every_room_is_shown_in_all_headings():
    plan = generate(3, "flat", sources=3, size="small")
    grid = build_grid(plan)
    states = np.array(sheet_states(plan, grid))
    for room in range(len(plan.rooms)):
        headings = states[grid.rooms[states // 4] == room] % 4
        assert sorted(headings) == [0, 0, 1, 1, 2, 2, 3, 3]


def test_each_picture_stands_below_its_label():
    plan = generate(3, "flat", sources=3, size="small")
    grid = build_grid(plan)
    pictures = np.full((9, 16, 16, 3), 80, np.uint8)
    sheet = np.array(contact_sheet(plan, grid, list(range(9)), pictures))
    assert (sheet[12:28, :16] == 80).all()
    assert (sheet[42:58, :16] == 80).all()
    assert (sheet[0:10, :16] != 80).any()
