"""Policy of one's own without any library: `agent=external policy=hand_written:act`."""

import numpy as np

FORWARD, ROTATE_LEFT, ROTATE_RIGHT = 0, 2, 3


def act(observations):
    """Turn to the estimated source, walk, and turn right after a collision."""
    right, front = observations["source_estimate"].T
    ahead = (front > 0) & (front >= np.abs(right))
    turn = np.where(right < 0, ROTATE_LEFT, ROTATE_RIGHT)
    actions = np.where(ahead, FORWARD, turn)
    return np.where(observations["collided"][:, 0] == 1, ROTATE_RIGHT, actions)
