from __future__ import annotations

import os
from pathlib import Path

import pytest
import torch

DEFAULT = Path(__file__).parents[2] / "shared" / "data"


@pytest.fixture(scope="session", autouse=True)
def one_thread() -> None:
    """Small tensors are slower on several threads, and tests may run side by side."""
    torch.set_num_threads(1)


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """The folder of real motion capture, which is no part of this repository; tests that need it skip without it."""
    folder = Path(os.environ.get("MOTIONGEN_SHARED_DATA", DEFAULT)).expanduser()
    if not folder.is_dir():
        pytest.skip(f"no motion capture at {folder}; MOTIONGEN_SHARED_DATA names its folder")
    return folder.resolve()
