from __future__ import annotations

from motiongen.configuration import compose
from motiongen.tracking.tags import choice_tags


def test_tags_name_the_option_of_every_slot_lists_included() -> None:
    config = compose(["+experiment=marionette", "data=bandai"], with_hydra=True)
    tags = choice_tags(config, config.hydra.runtime.choices)
    assert tags["generator/encoder"] == "condition_encoder"
    assert tags["generator/unroller/query"] == "reverse_positional_encoding+tag_injection"
    assert tags["generator/unroller/branches"] == "trajectory_branch"
    assert tags["data"] == "bandai"
    assert not any(name.startswith("hydra") for name in tags)


def test_an_empty_list_is_no_tag() -> None:
    config = compose(["+experiment=marionette", "generator/unroller/branches=[]"], with_hydra=True)
    assert "generator/unroller/branches" not in choice_tags(config, config.hydra.runtime.choices)
