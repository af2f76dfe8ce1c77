from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from motiongen.tracking.summary import circumstances, git_revision, peak_memory_mib, write_summary

REVISION = "import motiongen.tracking.summary as summary; print(summary.git_revision())"


def test_circumstances_can_be_written_and_read_back(tmp_path: Path) -> None:
    path = write_summary(tmp_path, {"fid": 1.5, **circumstances(12.345)})
    read = json.loads(path.read_text())
    assert read["wall_time_seconds"] == 12.3
    assert read["versions"]["python"].startswith("3.")
    assert {"peak_memory_mib", "git_revision", "platform"} <= read.keys()


def test_numbers_that_json_cannot_hold_leave_the_old_summary(tmp_path: Path) -> None:
    path = write_summary(tmp_path, {"fid": 1.0})
    with pytest.raises(ValueError, match="JSON"):
        write_summary(tmp_path, {"fid": float("nan")})
    assert json.loads(path.read_text()) == {"fid": 1.0}
    assert [child.name for child in tmp_path.iterdir()] == ["summary.json"]


def test_peak_memory_rises_by_what_is_held_and_does_not_fall() -> None:
    before = peak_memory_mib()
    assert before is not None
    block = np.ones(int(before + 64) * 2**17)  # eight bytes each: more than the process has ever held
    during = peak_memory_mib()
    del block
    after = peak_memory_mib()
    assert during is not None
    assert during >= before + 64
    assert after == pytest.approx(during, rel=0.05)


def test_the_revision_is_that_of_motiongens_own_checkout(tmp_path: Path) -> None:
    root = Path(__file__).parents[2]
    if not (root / ".git").exists():
        pytest.skip("the tests do not run in a git checkout")
    head = subprocess.run(["git", "-C", str(root), "rev-parse", "HEAD"], capture_output=True, text=True, check=True)
    assert (git_revision() or "").removesuffix("+dirty") == head.stdout.strip()


def test_there_is_no_revision_outside_a_checkout(tmp_path: Path) -> None:
    """Neither in a plain folder, nor where motiongen is installed into a folder of somebody else's repository."""
    package = tmp_path / "motiongen"
    source = Path(__file__).parents[2] / "src" / "motiongen"
    shutil.copytree(source, package)

    def answer() -> str:
        return subprocess.check_output([sys.executable, "-c", REVISION], cwd=tmp_path, text=True).strip()

    assert answer() == "None"
    subprocess.run(["git", "init", "--quiet", str(tmp_path)], check=True)
    assert answer() == "None"
