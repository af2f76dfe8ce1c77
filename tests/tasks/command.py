"""The command line as a user types it, in a process of its own."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path


def motiongen(place: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """`python -m motiongen` on one thread, from the folder `place` and with its cache there."""
    return subprocess.run(
        [sys.executable, "-m", "motiongen", *arguments, f"cache={place / 'cache'}"],
        cwd=place,
        env=os.environ | {"OMP_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        timeout=1200,
        check=False,
    )
