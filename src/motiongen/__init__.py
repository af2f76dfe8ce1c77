"""Conditional generation of human motion: exchangeable stages, one configuration per paper."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from motiongen.library import synthesize

__all__ = ["synthesize"]


def __getattr__(name: str) -> Any:
    # The command line answers before torch is loaded, which the library needs.
    if name in __all__:
        from motiongen import library

        return getattr(library, name)
    raise AttributeError(f"module 'motiongen' has no attribute {name!r}")
