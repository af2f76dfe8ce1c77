"""What is said to the user without a trace."""

from __future__ import annotations

BEGINNING, END = 1200, 500
"""Characters that are kept of a message that is longer than both, as what a file holds may be endless."""


class InputError(ValueError):
    """A file, option or request is wrong; the message names it and is meant for the person who gave it."""

    def __str__(self) -> str:
        text = super().__str__()
        return text if len(text) <= BEGINNING + END else f"{text[:BEGINNING]} ... {text[-END:]}"


def input_error(error: BaseException | None) -> InputError | None:
    """The InputError that this is or was raised from, if any: Hydra wraps what a constructor raises."""
    while error is not None and not isinstance(error, InputError):
        error = error.__cause__
    return error
