from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from motiongen.data.roots import DataError, check_root


def test_a_missing_folder_is_named_with_the_option_that_sets_it(tmp_path: Path) -> None:
    with pytest.raises(DataError, match=rf"data\.source\.root: folder {tmp_path}/absent does not exist; set data"):
        check_root(tmp_path / "absent")


def test_a_file_is_no_folder(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(DataError, match="does not exist"):
        check_root(tmp_path / "file")


def test_the_check_needs_no_torch() -> None:
    code = "import sys, motiongen.data.roots; sys.exit('torch' in sys.modules or 'numpy' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
