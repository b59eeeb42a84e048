"""World of results in words."""

from avn.reporting.world import sounds_text


def test_few_sounds_are_named_and_many_are_counted():
    assert sounds_text(["ring", "alarm"], None) == "sounds ring, alarm"
    assert sounds_text(["ring", "b"], ["ring"]) == (
        "sounds ring (heard in training); sounds b (not heard in training)"
    )
    many = [f"telephone_{index}" for index in range(54)]
    assert sounds_text(many, None) == "54 sounds"
    assert sounds_text([*many, "ring"], ["ring"]) == (
        "sounds ring (heard in training); 54 sounds (not heard in training)"
    )
