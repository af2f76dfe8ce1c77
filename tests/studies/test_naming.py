from __future__ import annotations

import pytest

from motiongen.configuration import compose
from motiongen.discovery import options
from motiongen.resolvers import changes_in
from motiongen.studies.naming import Row, StudyError, changes_text, chosen_row, swept_changes, swept_study

STUDIES = {option.group.removeprefix("ablation/") for option in options() if option.group.startswith("ablation/")}


def test_the_row_is_what_hydra_chose_in_the_studys_group() -> None:
    config = compose(["+ablation/marionet_next_tag=without_next_tag", "scale=smoke"], with_hydra=True)
    assert chosen_row(config.hydra.runtime.choices) == Row("marionet_next_tag", "without_next_tag")
    assert config.generator.encoder.looks_ahead is False
    assert chosen_row(compose(["+experiment=actor"], with_hydra=True).hydra.runtime.choices) is None


def test_two_studies_at_a_time_are_refused() -> None:
    with pytest.raises(StudyError, match="one study at a time"):
        chosen_row({"ablation/one": "a", "ablation/two": "b", "data": "builtin"})


def test_the_study_of_a_command_line_is_known_before_its_rows_are() -> None:
    assert swept_study(["seed=0,1", "+ablation/systems=glob(*)"]) == "systems"
    assert swept_study(["seed=0,1", "+experiment=actor"]) is None


def test_what_a_command_line_changed_is_the_same_text_in_any_order() -> None:
    asked = ["task=report", "study=systems", "data=bandai", "recognizer@second_recognizer=st_gcn", "data.draws=4"]
    run = ["+ablation/systems=actor", "data.draws=4", "seed=2", "recognizer@second_recognizer=st_gcn", "data=bandai"]
    assert changes_text(changes_in(asked)) == changes_text(changes_in(run))
    assert changes_text(changes_in(run)) == "data.draws=4 recognizer@second_recognizer=st_gcn"
    assert changes_text(["generator/unroller/query=[a, b]"]) == "'generator/unroller/query=[a,b]'", (
        "as a shell takes it"
    )


def test_a_sweep_over_changes_is_a_text_for_every_combination() -> None:
    swept = changes_in(["seed=0,1", "objective.weights.kl=1e-4,1e-5", "data.draws=4"])
    assert swept_changes(swept) == [
        "data.draws=4 objective.weights.kl=0.0001",
        "data.draws=4 objective.weights.kl=1e-05",
    ]
    assert changes_text(["objective.weights.kl=1e-4"]) == "objective.weights.kl=0.0001"
    assert swept_changes(["generator/conditioning=glob(*token)"]) == ["generator/conditioning=bias_token"]
    assert swept_changes([]) == [""]


def test_every_study_says_what_its_table_shows_and_every_published_row_exists() -> None:
    described = {option.name for option in options() if option.group == "study"}
    assert described == STUDIES
    for study in STUDIES:
        rows = {option.name for option in options() if option.group == f"ablation/{study}"}
        settings = compose([f"study={study}"]).study
        assert settings.name == study
        published = set(settings.published.rows) if settings.published else set()
        assert published <= rows
        assert len(rows) > 1


@pytest.mark.parametrize("study", sorted(STUDIES))
def test_published_accuracies_are_shares_as_measured_ones_are(study: str) -> None:
    published = compose([f"study={study}"]).study.published
    for row in published.rows.values() if published else ():
        assert all(0.0 < value < 1.0 for metric, value in row.items() if metric.endswith("accuracy"))
