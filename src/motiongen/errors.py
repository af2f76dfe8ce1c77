"""What is said to the user without a trace."""

from __future__ import annotations


class InputError(ValueError):
    """A file, option or request is wrong; the message names it and is meant for the person who gave it."""
