"""Losses as `torch.compile` makes them."""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Callable
from typing import ParamSpec, TypeVar

import torch

from motiongen.contracts import CompositionError

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")
COMPILERS = {"darwin": "clang++", "win32": "cl"}
"""The platform, to the C++ compiler that torch calls there; `g++` on others."""


def compiled(function: Callable[Arguments, Result]) -> Callable[Arguments, Result]:
    """The function, compiled when it is first called, for any number of poses.

    Raises:
        CompositionError: there is no C++ compiler, which torch would say only after everything else is set up.
    """
    compiler = os.environ.get("CXX", COMPILERS.get(sys.platform, "g++"))
    if shutil.which(compiler) is None:
        raise CompositionError(
            f"compiled=true needs a C++ compiler, and there is no {compiler}; "
            "install one, name one in the environment variable CXX, or leave it out"
        )
    return torch.compile(function, dynamic=True)
