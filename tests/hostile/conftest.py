from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

MEMORY = 2**30
"""Bytes that a test may take, whatever its reader reads."""


@pytest.fixture(autouse=True)
def bounded_memory() -> Iterator[None]:
    """Whoever asks for more gets a MemoryError, which no reader promises."""
    resource = pytest.importorskip("resource", reason="the platform does not bound memory")
    try:
        pages = int(Path("/proc/self/statm").read_text().split()[0])
    except OSError:
        pytest.skip("the platform does not tell how much memory is used")
    before = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (pages * resource.getpagesize() + MEMORY, before[1]))
    yield
    resource.setrlimit(resource.RLIMIT_AS, before)
