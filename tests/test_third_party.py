from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

DOCUMENT = Path(__file__).parents[1] / "docs" / "adding-a-plugin.md"
FILE = re.compile(r"^`([^`\n]+)`\n\n```\w+\n(.*?)```$", re.MULTILINE | re.DOTALL)


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The package of docs/adding-a-plugin.md, written, built and installed into a folder of its own."""
    project = tmp_path_factory.mktemp("project")
    for name, text in FILE.findall(DOCUMENT.read_text(encoding="utf-8")):
        path = project / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    target = tmp_path_factory.mktemp("site")
    install = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-build-isolation"]
    subprocess.run([*install, "--target", str(target), str(project)], check=True)
    return target


def motiongen(site: Path, folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    paths = os.pathsep.join([str(site), *filter(None, [os.environ.get("PYTHONPATH")])])
    environment = os.environ | {"PYTHONPATH": paths, "MOTIONGEN_CACHE": str(folder / "cache"), "OMP_NUM_THREADS": "1"}
    return subprocess.run(
        [sys.executable, "-m", "motiongen", *arguments],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )


def test_its_option_is_listed_with_its_origin(site: Path, tmp_path: Path) -> None:
    listed = motiongen(site, tmp_path, "task=list")
    assert listed.returncode == 0, listed.stderr
    assert re.search(
        r"^ +progress +how much of the action is done, 0 to 1  \[motiongen_progress\]$", listed.stdout, re.M
    )


def test_its_options_are_checked_like_the_cores_own(site: Path, tmp_path: Path) -> None:
    query = "generator/unroller/query=[progress]"
    wrong = motiongen(site, tmp_path, "+experiment=marionette", query, "generator.unroller.query.progress.gain=0")
    assert wrong.returncode == 1
    assert "generator.unroller.query.progress.gain=0: Progress takes a number above 0" in wrong.stderr


def test_it_is_used_by_name_in_a_run(site: Path, tmp_path: Path) -> None:
    run = motiongen(
        site,
        tmp_path,
        "+experiment=marionette",
        "scale=smoke",
        "generator/unroller/query=[reverse_positional_encoding,tag_injection,progress]",
        "trainer.max_epochs=1",
        "data.source.sessions=8",
        "data.min_clips=2",
        "evaluation.seeds=2",
        "tracker=none",
        f"hydra.run.dir={tmp_path / 'run'}",
    )
    assert run.returncode == 0, run.stderr
    assert (tmp_path / "run" / "summary.json").is_file()
    import torch

    stored = torch.load(tmp_path / "run" / "generator.pt", weights_only=True)
    names = str(list(stored) + [list(value) for value in stored.values() if isinstance(value, dict)])
    assert "query.progress.projection.weight" in names


def test_without_it_the_option_does_not_exist(tmp_path: Path) -> None:
    absent = motiongen(tmp_path, tmp_path, "+experiment=marionette", "generator/unroller/query=[progress]")
    assert absent.returncode == 1
    assert "generator/unroller/query=progress: there is no such option" in absent.stderr
