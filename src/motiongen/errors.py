"""What is said to the user without a trace."""

from __future__ import annotations


class InputError(ValueError):
    """A file, option or request is wrong; the message names it and is meant for the person who gave it."""


def input_error(error: BaseException | None) -> InputError | None:
    """The InputError that this is or was raised from, if any: Hydra wraps what a constructor raises."""
    while error is not None and not isinstance(error, InputError):
        error = error.__cause__
    return error
