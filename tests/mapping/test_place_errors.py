import pytest
import torch

from avn.mapping.place_errors import place_errors

# Four cells in a line, 0.5 m apart, and what each of their 16 views looks like.
LINE = torch.tensor([[0, 0], [1, 0], [2, 0], [3, 0]])
UNLIKE = torch.eye(16)
# Cells 0 and 1, all headings of each.
WALK = torch.tensor([[0, 1, 2, 3, 4, 5, 6, 7]])


def test_a_view_of_the_walk_is_found_where_it_was_taken():
    table = place_errors(LINE, UNLIKE, WALK, top=1).set_index("cells")
    assert table.loc["walked", "views"] == 8
    assert table.loc["walked", ["error_m", "error_mean_m"]].tolist() == [0.0, 0.0]
    assert table.loc["walked", "heading"] == 1.0


def test_a_view_that_looks_like_another_place_is_off_by_the_distance_in_metres():
    features = UNLIKE.clone()
    # Each view of cells 2 and 3 looks like cell 1 from one heading further right.
    for heading in range(4):
        features[8 + heading] = features[12 + heading] = UNLIKE[4 + (heading + 1) % 4]
    table = place_errors(LINE, features, WALK, top=1).set_index("cells")
    # Cell 2 is 0.5 m from cell 1, cell 3 a metre.
    assert table.loc["other", "error_m"] == pytest.approx(0.75)
    assert table.loc["other", "error_mean_m"] == pytest.approx(0.75)
    assert table.loc["other", "heading"] == 0.0
    assert table.loc["all", "views"] == 16
    assert table.loc["all", "error_mean_m"] == pytest.approx(0.375)
    assert table.loc["all", "heading"] == 0.5


def test_each_walk_has_a_memory_of_its_own():
    trajectories = torch.stack((WALK[0], WALK[0] + 8))
    both = place_errors(LINE, UNLIKE, trajectories, top=1).set_index("cells")
    assert both.loc["all", "views"] == 32
    # What the other walk saw is no entry of one's own.
    assert both.loc["walked", "error_m"] == 0.0
    assert both.loc["other", "error_mean_m"] > 0


def test_a_walk_that_was_everywhere_leaves_no_other_views():
    table = place_errors(LINE, UNLIKE, torch.arange(16)[None], top=1).set_index("cells")
    assert table.loc["other", "views"] == 0
    assert table.loc["other", ["error_m", "error_mean_m", "heading"]].isna().all()
