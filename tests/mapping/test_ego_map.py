import torch

from avn.core.pose import turned
from avn.mapping.ego_map import around, offsets


def test_the_part_around_an_agent_is_that_of_a_map_turned_to_its_heading():
    """Square by square, against the map's own coordinates."""
    generator = torch.Generator().manual_seed(0)
    log_odds = torch.randn(2, 15, 15, generator=generator) * 3
    log_odds[0, 7, 7] = 30.0
    pose = torch.tensor([[0, 0, 0], [3, -2, 1], [-7, 7, 2], [5, 5, 3]])
    row = torch.tensor([0, 1, 1, 0])
    found = around(log_odds, row, pose, offsets(5))
    assert found.shape == (4, 5, 5)
    for n in range(4):
        for front in range(-2, 3):
            for right in range(-2, 3):
                step = turned(torch.tensor([[right, front]]), pose[n, 2:])[0]
                x, y = (pose[n, :2] + step + 7).tolist()
                inside = 0 <= x < 15 and 0 <= y < 15
                expected = torch.sigmoid(log_odds[row[n], y, x]) if inside else torch.tensor(0.5)
                assert torch.allclose(found[n, front + 2, right + 2], expected, atol=1e-6)


def test_what_lies_ahead_lies_in_the_last_rows():
    log_odds = torch.zeros(1, 11, 11)
    log_odds[0, 5, 7] = 30.0  # two squares to the east of the origin
    for heading, place in ((0, (2, 4)), (1, (4, 2)), (2, (2, 0)), (3, (0, 2))):
        pose = torch.tensor([[0, 0, heading]])
        found = around(log_odds, torch.tensor([0]), pose, offsets(5))[0]
        assert found.argmax() == place[0] * 5 + place[1]
