"""`task=known_cases` on the built-in data, at `scale=smoke`."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path


def test_the_two_tables_are_printed(tmp_path: Path) -> None:
    answer = subprocess.run(
        [
            sys.executable,
            "-m",
            "motiongen",
            "task=known_cases",
            "scale=smoke",
            "data.source.sessions=8",
            "data.min_clips=2",
            f"cache={tmp_path / 'cache'}",
        ],
        cwd=tmp_path,
        env=os.environ | {"OMP_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        timeout=1200,
        check=False,
    )
    assert answer.returncode == 0, answer.stderr
    lines = answer.stdout.splitlines()
    heading = next(line for line in lines if line.startswith("| metric"))
    cases = [cell.strip() for cell in heading.strip("|").split("|")]
    assert cases == [
        "metric", "real", "the same", "shuffled", "frozen", "reversed", "skating", "jitter", "one clip",
    ]  # fmt: skip
    assert any(line.startswith("| FID ") for line in lines)
    assert any(line.startswith("| N ") for line in lines)
