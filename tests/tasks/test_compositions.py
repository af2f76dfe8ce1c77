from __future__ import annotations

import random

import pytest

from motiongen.errors import InputError
from motiongen.tasks import compositions
from motiongen.tasks.compositions import FAILS, REFUSED, RUNS, SLOTS, Trial, choices, option_names, report, trial

SAMPLE = 60


def sample() -> list[tuple[str, ...]]:
    """Some of all compositions, with every option of every slot among them."""
    shuffled = random.Random(0).sample(choices(), len(choices()))
    chosen, seen = shuffled[:SAMPLE], {option for choice in shuffled[:SAMPLE] for option in enumerate(choice)}
    for choice in shuffled[SAMPLE:]:
        if not set(enumerate(choice)) <= seen:
            chosen.append(choice)
            seen.update(enumerate(choice))
    return chosen


def test_compositions_run_or_are_refused_with_a_reason() -> None:
    trials = [trial(choice) for choice in sample()]
    assert [one for one in trials if one.outcome == FAILS] == []
    assert {RUNS, REFUSED} <= {one.outcome for one in trials}
    assert all(one.reason for one in trials if one.outcome == REFUSED)


def test_every_option_is_crossed() -> None:
    for place, slot in enumerate(SLOTS):
        assert {choice[place] for choice in choices()} == set(option_names(f"generator/{slot}"))
    assert len(set(choices())) == len(choices())


MARIONET = ("condition_encoder", "none", "time_unrolling", "autoregressive_transformer")


def test_a_composition_that_cannot_work_is_refused() -> None:
    assert trial((*MARIONET, "teacher_forcing")) == Trial((*MARIONET, "teacher_forcing"), RUNS)
    refused = trial((*MARIONET, "direct"))
    assert refused.outcome == REFUSED
    assert "AutoregressiveTransformer reads the past" in refused.reason


def test_an_error_that_nobody_foresaw_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    def raising(error: Exception):
        def build(choice: tuple[str, ...]):
            raise error

        return build

    monkeypatch.setattr(compositions, "build", raising(RuntimeError("sizes differ")))
    assert trial(("a",) * len(SLOTS)) == Trial(("a",) * len(SLOTS), FAILS, "RuntimeError: sizes differ")
    monkeypatch.setattr(compositions, "build", raising(InputError("no code")))
    assert trial(("a",) * len(SLOTS)).outcome == REFUSED


def test_the_report_gives_every_reason_once() -> None:
    rows = [("a", "b", "c", "d", name) for name in "xyz"]
    text = report([Trial(rows[0], RUNS), Trial(rows[1], REFUSED, "no code"), Trial(rows[2], REFUSED, "no code")])
    assert text.count("no code") == 1
    assert [cell.strip() for cell in text.splitlines()[0].strip("|").split("|")] == [*SLOTS[:-1], "x", "y", "z"]
    assert [cell.strip() for cell in text.splitlines()[2].strip("|").split("|")] == [
        *("a", "b", "c", "d"),
        *("runs", "refused [1]", "refused [1]"),
    ]
    assert text.endswith("3 compositions: 1 run, 2 are refused, 0 fail")
