from __future__ import annotations

import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel, built from this checkout with the build backend that is installed."""
    folder = tmp_path_factory.mktemp("wheel")
    command = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation", "-w", str(folder)]
    subprocess.run([*command, str(ROOT)], check=True)
    (built,) = folder.glob("*.whl")
    return built


def files_below(folder: Path, prefix: str) -> set[str]:
    ignored = ("__pycache__", ".DS_Store", "node_modules")
    return {
        prefix + path.relative_to(folder).as_posix()
        for path in folder.rglob("*")
        if path.is_file() and not any(part in ignored for part in path.parts)
    }


def test_the_wheel_holds_code_options_plugins_and_their_data(wheel: Path) -> None:
    packed = set(zipfile.ZipFile(wheel).namelist())
    expected = (
        files_below(ROOT / "src" / "motiongen", "motiongen/")
        | files_below(ROOT / "src" / "hydra_plugins", "hydra_plugins/")
        | files_below(ROOT / "conf", "motiongen/conf/")
        | files_below(ROOT / "plugins", "motiongen_plugins/")
    )
    assert expected - packed == set()
    assert {"motiongen/py.typed", "motiongen/conf/config.yaml"} <= packed
    assert {name.split("/")[0] for name in packed} == {
        *("motiongen", "motiongen_plugins", "hydra_plugins", "motiongen-0.1.0.dist-info")
    }
    assert "hydra_plugins/__init__.py" not in packed, "it would hide the plugins of every other package"


@pytest.fixture(scope="module")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An environment of its own with the wheel in it; third-party packages are those of the tests' environment."""
    environment = tmp_path_factory.mktemp("environment")
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", str(environment)], check=True)
    (site,) = environment.glob("lib/python*/site-packages")
    install = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-index", "--target", str(site)]
    subprocess.run([*install, str(wheel)], check=True)
    # A .pth file would run the editable install's own; a plain path entry puts its packages behind the wheel's.
    (site / "others.pth").write_text(f"import sys; sys.path.append({str(third_party())!r})\n")
    return environment / "bin" / "python"


def third_party() -> Path:
    import omegaconf

    return Path(omegaconf.__file__).parents[1]


def test_the_installed_wheel_runs_from_another_folder_without_the_repository(installed: Path, tmp_path: Path) -> None:
    def run(*arguments: str) -> subprocess.CompletedProcess[str]:
        environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
        return subprocess.run(
            [str(installed), *arguments], cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
        )

    where = run("-c", "import motiongen, motiongen_plugins; print(motiongen.__file__, motiongen_plugins.__file__)")
    assert where.returncode == 0, where.stderr
    assert str(ROOT) not in where.stdout
    listed = run("-m", "motiongen", "task=list")
    assert listed.returncode == 0, listed.stderr
    assert "tag_injection" in listed.stdout
    assert "marionette" in listed.stdout
    composed = run("-m", "motiongen", "+experiment=marionette", "--cfg", "job")
    assert composed.returncode == 0, composed.stderr
    assert "motiongen_plugins.condition_encoder" in composed.stdout
    wrong = run("-m", "motiongen", "+experiment=marionette", "generator.encoder.dropout=7")
    assert "a number from 0 to 1" in wrong.stderr
