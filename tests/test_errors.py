"""What is said to the user without a trace."""

from __future__ import annotations

import pytest

from motiongen.errors import BEGINNING, END, InputError, input_error


@pytest.mark.parametrize("length", [0, 1, BEGINNING + END])
def test_a_message_is_said_as_it_is(length: int) -> None:
    assert str(InputError("x" * length)) == "x" * length


def test_of_an_endless_message_both_ends_are_said() -> None:
    said = str(InputError(f"a.json: tag: {'9' * 10**6} is no tag"))
    assert said.startswith("a.json: tag: 999")
    assert said.endswith("999 is no tag")
    assert len(said) == BEGINNING + len(" ... ") + END


def test_the_error_of_the_user_is_found_behind_others() -> None:
    wrong = InputError("wrong")
    outer = RuntimeError("in Hydra")
    outer.__cause__ = RuntimeError("in a constructor")
    outer.__cause__.__cause__ = wrong
    assert input_error(outer) is wrong
    assert input_error(RuntimeError("another")) is None
