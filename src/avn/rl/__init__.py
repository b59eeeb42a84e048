"""Reinforcement learning: the environment, the actor-critic networks and A3C.

If Gymnasium is installed, `import avn.rl` registers the environment as "avn/Walk-v0":
`gymnasium.make("avn/Walk-v0", overrides=["split=mini"])`, or `make_vec` with
`vectorization_mode="vector_entry_point"` for N agents in one batch.
"""

from importlib.util import find_spec

if find_spec("gymnasium"):
    import gymnasium

    if "avn/Walk-v0" not in gymnasium.registry:
        gymnasium.register(
            id="avn/Walk-v0",
            entry_point="avn.integrations.gymnasium:make_env",
            vector_entry_point="avn.integrations.gymnasium:make_vector_env",
        )
