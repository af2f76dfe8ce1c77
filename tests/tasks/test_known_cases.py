"""`task=known_cases` on the built-in data, at `scale=smoke`."""

from __future__ import annotations

from pathlib import Path

from tests.tasks.command import motiongen


def test_the_two_tables_are_printed(tmp_path: Path) -> None:
    small = ("scale=smoke", "data.source.sessions=8", "data.min_clips=2")
    answer = motiongen(tmp_path, "task=known_cases", *small)
    assert answer.returncode == 0, answer.stderr
    lines = answer.stdout.splitlines()
    heading = next(line for line in lines if line.startswith("| metric"))
    cases = [cell.strip() for cell in heading.strip("|").split("|")]
    assert cases == [
        "metric", "real", "the same", "shuffled", "frozen", "reversed", "skating", "jitter", "one clip",
    ]  # fmt: skip
    assert any(line.startswith("| FID ") for line in lines)
    assert any(line.startswith("| N ") for line in lines)
