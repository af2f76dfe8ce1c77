from __future__ import annotations

from pathlib import Path

import pytest
from omegaconf import OmegaConf

from motiongen.configuration import ConfigurationError, check, compose

MARIONETTE = ["+experiment=marionette"]


def problem(*overrides: str, multirun: bool = False) -> str:
    with pytest.raises(ConfigurationError) as caught:
        check(overrides, multirun=multirun)
    return str(caught.value)


def test_an_experiment_fills_the_open_slots() -> None:
    config = compose(MARIONETTE)
    assert list(config.generator.unroller.query) == ["reverse_positional_encoding", "tag_injection"]
    assert config.generator.encoder._target_.endswith(".ConditionEncoder")
    assert config.name == "marionette"


def test_the_experiments_of_the_core_pass_the_check() -> None:
    assert check(MARIONETTE).name == "marionette"
    assert check(["+experiment=actor"]).name == "actor"
    assert check(["+experiment=recognizer"]).task.name == "train_recognizer"


def test_a_list_slot_is_overridden_on_the_command_line() -> None:
    config = check([*MARIONETTE, "generator/unroller/query=[tag_injection]", "generator/unroller/branches=[]"])
    assert list(config.generator.unroller.query) == ["tag_injection"]


def test_scale_sets_the_sizes() -> None:
    paper, small = (compose([*MARIONETTE, f"scale={scale}"]) for scale in ("paper", "small"))
    assert (paper.generator.encoder.layers, paper.generator.width) == (2, 256)
    assert small.generator.width < paper.generator.width


def test_composing_twice_gives_the_same() -> None:
    assert OmegaConf.to_yaml(compose(MARIONETTE)) == OmegaConf.to_yaml(compose(MARIONETTE))


@pytest.mark.parametrize(
    ("overrides", "told"),
    [
        (["generator/encoder=condition_encodr"], ["no such option", "did you mean 'condition_encoder'?", "options:"]),
        (["generator/encoder=nonsense"], ["generator/encoder=nonsense", "no such option", "condition_encoder"]),
        (
            ["generator/unroller/query=[tag_injektion]"],
            ["did you mean 'tag_injection'?", "reverse_positional_encoding"],
        ),
        (["generator/encodr=condition_encoder"], ["generator/encodr", "did you mean 'generator/encoder'?"]),
        (["generator.encoder.layrs=2"], ["'generator.encoder.layrs'", "did you mean 'generator.encoder.layers'?"]),
        (["sed=1"], ["there is no key 'sed'", "did you mean 'seed'?"]),
        (["+sead=1"], ["there is no key 'sead'", "did you mean 'seed'?"]),
        (
            ["+generator.encoder.layrs=2"],
            ["ConditionEncoder has no option 'layrs'", "did you mean 'layers'?", "dropout"],
        ),
        (["generator.encoder.layers=two"], ["generator.encoder.layers=two", "a whole number of at least 1"]),
        (["generator.encoder.layers=0"], ["generator.encoder.layers=0", "a whole number of at least 1"]),
        (["generator.encoder.dropout=1.5"], ["generator.encoder.dropout=1.5", "a number from 0 to 1"]),
        (["generator.encoder.layers=true"], ["generator.encoder.layers=True", "a whole number"]),
        (["generator.encoder.layers=???"], ["generator.encoder.layers must be given"]),
        (["generator.width=${widht:256}"], ["generator.width", "widht"]),
        (["generator.encoder._target_=motiongen_plugins.nothing.Encoder"], ["has no module 'nothing'"]),
        (
            ["generator.encoder._target_=motiongen_plugins.condition_encoder.condition_encoder.ConditionEncodr"],
            ["has no 'ConditionEncodr'", "did you mean 'ConditionEncoder'?"],
        ),
        (["generator.encoder._target_=no_such_package.Encoder"], ["there is no module 'no_such_package'"]),
        (["seed=1,2"], ["seed=1,2", "--multirun"]),
        (["a=[1"], ["'a=[1' cannot be read"]),
        (["data=bandai", "data.source.root=/nowhere"], ["data.source.root", "/nowhere does not exist"]),
        (
            ["data=babel", "data.source.root=/nowhere"],
            ["/nowhere does not exist", "babel_v1.0_release/", "https://amass.is.tue.mpg.de"],
        ),
        (["data=babel", "data.source.labels=act"], ["Babel takes 'categories', 'mag'"]),
    ],
)
def test_what_is_wrong_is_named_with_the_nearest_right_name(overrides: list[str], told: list[str]) -> None:
    message = problem(*MARIONETTE, *overrides)
    assert all(part in message for part in told), message


def test_all_problems_are_told_at_once() -> None:
    message = problem(
        *MARIONETTE, "generator.encoder.layers=0", "generator.decoder.dropout=2", "+generator.decoder.a=1"
    )
    assert len([line for line in message.splitlines() if line.startswith("generator.")]) == 3


def test_training_needs_an_experiment() -> None:
    message = problem("task=train")
    assert "add +experiment=" in message
    assert "marionette" in message


def test_an_experiment_tells_what_it_needs() -> None:
    assert problem("+experiment=actor_variable_length") == "init must be given: init=..."
    assert check(["+experiment=actor_variable_length", "init=runs/somewhere"]).init == "runs/somewhere"
    assert check(["+experiment=actor_variable_length", "task=prepare"]).data.random_length


def test_an_experiment_is_added() -> None:
    assert "+experiment=marionette" in problem("experiment=marionette")


def test_a_misspelt_experiment() -> None:
    assert "did you mean 'marionette'?" in problem("+experiment=marionete")


def test_tasks_tell_what_they_need() -> None:
    message = problem(*MARIONETTE, "task=synthesize")
    assert "run must be given" in message
    assert "timeline must be given" in message


@pytest.mark.parametrize(
    ("formats", "told"),
    [
        ("[bvh,gbl]", ["there is no format 'gbl'; did you mean 'glb'?", "formats: amass, bvh, csv, glb, mp4"]),
        ("[fbx]", ["there is no format 'fbx'", "formats: amass, bvh, csv, glb, mp4"]),
        ("[3]", ["there is no format 3"]),
        ("bvh", ["formats=bvh: takes a list, such as formats=[amass]"]),
        ("null", ["formats=None: takes a list"]),
    ],
)
def test_unknown_formats(formats: str, told: list[str]) -> None:
    message = problem(*MARIONETTE, "task=synthesize", "run=runs/somewhere", "timeline=walk 2 s", f"formats={formats}")
    for text in told:
        assert text in message


def test_known_formats_pass() -> None:
    synthesize = [*MARIONETTE, "task=synthesize", "run=runs/somewhere", "timeline=walk 2 s"]
    assert check([*synthesize, "formats=[glb,amass]"]).formats == ["glb", "amass"]
    assert check(synthesize).formats == []


def test_every_choice_of_a_sweep_is_checked() -> None:
    message = problem(*MARIONETTE, "generator/encoder=condition_encoder,nonsense", "seed=0,1", multirun=True)
    assert "generator/encoder=nonsense" in message
    assert "generator.encoder.dropout=3" in problem(*MARIONETTE, "generator.encoder.dropout=0.1,3", multirun=True)
    assert "seed=none_of_these" in problem(
        *MARIONETTE, "generator/encoder=glob(*)", "seed=1,none_of_these", multirun=True
    )
    assert "layers=9" not in str(check([*MARIONETTE, "generator.encoder.layers=range(1,9)"], multirun=True))


def test_a_broken_yaml_file_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from motiongen import configuration

    (tmp_path / "config.yaml").write_text("seed: [1\n", encoding="utf-8")
    monkeypatch.setattr(configuration, "core_conf", lambda: tmp_path)
    with pytest.raises(ConfigurationError, match=r"config\.yaml"):
        compose()
