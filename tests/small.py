"""Settings with which a command on the mini split takes seconds."""

SMALL = (
    "split=mini",
    "processes=1",
    "acoustics.rays=300",
    "acoustics.seconds=0.2",
    "sound_model.epochs=1",
    "takes=2",
    "protocol.starts=4",
    "sound=[alarm,clock]",
    # as in test_commands.py, for views of other settings in one folder are refused
    "renderer.camera.size=32",
    "renderer.samples=1",
    "renderer.light.gather_rays=4",
    "renderer.light.shadow_rays=2",
    "renderer.light.spacing=0.3",
    "backbone.size=32",
)
# The occupancy network of a row that sees.
EYES = (
    "occupancy_model.epochs=1",
    "occupancy_model.looks=1",
    "occupancy_model.times=1",
    "occupancy_model.validation_views=40",
)
# An actor-critic row that has learnt nothing.
A3C = (
    "protocol.exploration=30",
    "a3c.workers=1",
    "a3c.episodes=8",
    "a3c.steps=5",
    "a3c.total=400",
    "a3c.validate_every=400",
    "a3c.validation_starts=1",
    "a3c.takes=1",
    "a3c.walks=2",
    "a3c.refresh=5",
)
