"""Settings that a command does not read are refused by name, and those that it reads are not."""

import pytest


def missing_error(command, *arguments):
    code, out, err = command(*arguments)
    assert code == 2, out
    assert len(err) == 1, err
    return err[0]


@pytest.mark.parametrize(
    ("arguments", "key"),
    [
        (("agent=greedy", "planner.collision_cost=9"), "planner.collision_cost"),
        (("agent=greedy", "look=nonsense"), "look"),
        (("agent=greedy", "look=around"), "look"),
        (("agent=greedy", "localisation=retrieval"), "localisation"),
        (("agent=greedy", "mapper.size=51"), "mapper.size"),
        (("agent=greedy", "algorithm.total_steps=5"), "algorithm.total_steps"),
        (("agent=greedy", "occupancy_model=small"), "occupancy_model"),
        (("agent=greedy", "renderer=cycles"), "renderer"),
        (("agent=greedy", "backbone.size=64"), "backbone.size"),
        (("agent=greedy", "protocol.radius=2"), "protocol.radius"),
        (("agent=plan_noexp", "algorithm.total_steps=5"), "algorithm.total_steps"),
        (("agent=plan_noexp", "planner.error.sigma=2"), "planner.error.sigma"),
        (("agent=plan_noexp", "stop_model.epochs=2"), "stop_model.epochs"),
        (("agent=plan_noexp", "localisation=retrieval"), "localisation"),
        (("agent=plan_noexp", "agent.oracle_inputs=[source_estimate]", "agent.privileged=true",
          "sound_model=released"), "sound_model"),
        (("agent=greedy", "protocol=stop", "protocol.cap=goal"), "protocol.cap"),
        (("agent=greedy", "protocol.max_moves_ratio=null", "protocol.cap=goal"), "protocol.cap"),
        (("agent=ours_exp", "mapper.sharpness=0.1"), "mapper.sharpness"),
        (("agent=plan_exp", "mapper.grows=false"), "mapper.grows"),
        (("agent=plan_exp", "mapper.heading=nearest"), "mapper.heading"),
        (("agent=plan_noexp", "mapper.rooms_above=0.1", "occupancy_model=rooms"),
         "mapper.rooms_above"),
        (("agent=belief", "acoustics=resonance", "mapper.rooms_above=0.1"), "mapper.rooms_above"),
        (("agent=random_walk", "training.generated=1"), "training.generated"),
        (("agent=a3c_va", "mapper=spatial_memory"), "mapper"),
        (("agent=a3c_va_mapper", "mapper=spatial_memory", "occupancy_model=small"), "mapper"),
        (("agent=a3c_va", "baseline.map_width=11"), "baseline.map_width"),
        (("agent=a3c_va", "algorithm.exploration_walks=3"), "algorithm.exploration_walks"),
        (("agent=a3c_v", "sound_model.epochs=2"), "sound_model.epochs"),
        (("agent=random_walk", "train_seed=3"), "train_seed"),
        (("agent=random_walk", "realisations=2"), "realisations"),
        (("agent=random_walk", "acoustics.rays=300"), "acoustics.rays"),
        (("agent=random_walk", "microphone.gain=2"), "microphone.gain"),
        (("agent=random_walk", "training.acoustics=diffraction"), "training.acoustics"),
        (("agent=random_walk", "training.sounds=ring"), "training.sounds"),
        (("agent=random_walk", "split.seed=3"), "split.seed"),
        (("agent=random_walk", "split.train=4"), "split.train"),
        (("agent=random_walk", "logger=csv"), "logger"),
        (("agent=random_walk", "logger=none"), "logger"),
        (("agent=random_walk", "callbacks=timer"), "callbacks"),
        (("agent=random_walk", "trainer=cpu"), "trainer"),
        (("agent=a3c_va", "algorithm=a3c", "trainer.fast_dev_run=1"), "trainer.fast_dev_run"),
        (("agent=greedy", "trainer.overfit_batches=1"), "trainer.overfit_batches"),
        (("agent=a3c_v", "trainer.precision=bf16"), "trainer.precision"),
        (("agent=greedy", "training.scenes=procedural", "training.scenes.size=big"), ""),
    ],
)  # fmt: skip
def test_a_run_refuses_what_it_does_not_read(command, tmp_path, arguments, key):
    line = missing_error(command, "eval", "split=mini", *arguments, f"outputs={tmp_path}/o")
    if key:
        assert line.startswith(f"avn.eval: {key}: not read by this run")
        assert "; the run reads " in line
    assert not list((tmp_path / "o").rglob("*"))


@pytest.mark.parametrize(
    ("arguments", "key"),
    [
        (("train", "model=sound_cnn", "sound=alarm"), "sound"),
        (("train", "model=sound_cnn", "protocol=stop"), "protocol"),
        (("train", "model=sound_cnn", "microphone.gain=2"), "microphone.gain"),
        (("train", "model=stop_classifier", "protocol.cap=goal"), "protocol.cap"),
        (("train", "model=a3c_va", "protocol=stop", "protocol.cap=goal"), "protocol.cap"),
        (("train", "model=occupancy_cnn", "acoustics=diffraction"), "acoustics"),
        (("train", "model=a3c_va", "debug=overfit"), "trainer.overfit_batches"),
        (("train", "model=a3c_v", "callbacks=timer"), "callbacks"),
        (("generate", "planner.collision_cost=3"), "planner.collision_cost"),
        (("generate", "sound=alarm"), "sound"),
        (("generate", "realisations=3"), "realisations"),
        (("reproduce", "rows=random_walk,oracle", "sound_model=released"), "sound_model"),
        (("reproduce", "rows=greedy", "planner.collision_cost=3"), "planner.collision_cost"),
    ],
)
def test_so_do_the_other_commands(command, tmp_path, arguments, key):
    line = missing_error(command, *arguments, "split=mini", f"outputs={tmp_path}/o")
    assert line.startswith(f"avn.{arguments[0]}: {key}: not read by this run")
    assert not list((tmp_path / "o").rglob("*"))


@pytest.mark.parametrize(
    "arguments",
    [
        ("agent=greedy", "localisation=retrieval+odometry"),  # its default
        ("agent=greedy", "train_seed=0"),
        ("agent=random_walk", "acoustics=diffraction"),  # a column of the records
        ("agent=random_walk", "sound=alarm"),
        ("agent=oracle", "protocol=stop", "protocol.radius=2"),
        ("agent=plan_noexp", "mapper.visible_above=0.3"),
        # the mapper alone would change nothing here, but it comes with another network
        ("agent=belief", "acoustics=resonance", "mapper=occupancy"),
        ("agent=random_walk", "protocol.cap=goal"),
        ("agent=a3c_va", "protocol.cap=goal"),
        ("agent=ours_exp", "mapper.heading=vote"),
        ("agent=greedy", "film=1", "renderer.camera.size=32"),  # which films show
    ],
)
def test_what_is_read_or_changes_nothing_is_taken(command, outputs, arguments):
    code, _, err = command("eval", "split=mini", *arguments, f"outputs={outputs}", "auto=false")
    assert not [line for line in err if "not read by this run" in line]
    assert code == 0 or "is missing and auto=false" in err[-1]


def test_a_table_takes_what_one_of_its_rows_reads(command, tmp_path):
    options = ("split=mini", "planner.collision_cost=3", "auto=false", f"outputs={tmp_path}/o")
    line = missing_error(command, "reproduce", "rows=random_walk,plan_noexp", *options)
    assert "is missing and auto=false" in line


def test_the_test_world_is_not_changed_through_the_training_world(command, tmp_path):
    options = ("agent=greedy", "training.acoustics.rays=300", f"outputs={tmp_path}/o")
    line = missing_error(command, "eval", *options)
    assert "choose its own first, such as training.acoustics=resonance" in line


@pytest.mark.parametrize(
    ("given", "wanted"),
    [
        ("sound=alarm", "give training.sounds;"),
        ("sound=nowhere.wav", "give training.sounds;"),
        ("microphone.gain=2", "give training.microphone.gain;"),
    ],
)
def test_a_training_names_the_setting_of_its_own_world(command, given, wanted):
    code, _, err = command("train", "model=sound_cnn", given)
    assert code == 2
    assert wanted in err[-1]
