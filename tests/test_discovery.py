from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from motiongen import discovery
from motiongen.discovery import PluginError, module_path, options, plugins

Install = Callable[[str, dict[str, str]], None]


@pytest.fixture
def install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Install]:
    """Puts a distribution of its own beside the installed ones: a package's files and its entry point."""
    monkeypatch.syspath_prepend(str(tmp_path))

    def put(package: str, files: dict[str, str]) -> None:
        for name, text in files.items():
            path = tmp_path / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8")
        metadata = tmp_path / f"{package}-1.0.dist-info"
        metadata.mkdir()
        (metadata / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {package}\nVersion: 1.0\n")
        (metadata / "entry_points.txt").write_text(f"[motiongen.plugins]\n{package} = {package}\n")
        discovery.plugins.cache_clear()

    yield put
    discovery.plugins.cache_clear()


def found() -> set[tuple[str, str, str]]:
    return {(option.plugin, option.group, option.name) for option in options()}


def test_built_in_plugins_are_found_by_their_entry_point() -> None:
    assert ("motiongen_plugins.tag_injection", "generator/unroller/query", "tag_injection") in found()
    assert ("motiongen", "task", "list") in found()


def test_a_plugin_is_found_without_being_imported(install: Install) -> None:
    install(
        "lone",
        {
            "lone/__init__.py": "raise RuntimeError('imported')",
            "lone/conf/generator/encoder/lone.yaml": "# alone\na: 1\n",
        },
    )
    assert ("lone", "generator/encoder", "lone") in found()
    assert "lone" not in sys.modules


def test_a_collection_offers_each_of_its_plugins(install: Install) -> None:
    install(
        "several",
        {
            "several/__init__.py": "",
            "several/first/conf/generator/encoder/first.yaml": "a: 1\n",
            "several/second/conf/objective/second.yaml": "a: 1\n",
            "several/helpers/__init__.py": "",
        },
    )
    assert {name for name, *_ in found() if name.startswith("several")} == {"several.first", "several.second"}


def test_the_first_comment_describes_an_option(install: Install) -> None:
    install(
        "told",
        {
            "told/conf/experiment/told.yaml": "# @package _global_\n# What it does\na: 1\n# not this\n",
            "told/conf/experiment/silent.yaml": "a: 1\n# not this\n",
        },
    )
    described = {option.name: option.description for option in options() if option.plugin == "told"}
    assert described == {"told": "What it does", "silent": ""}


def test_an_option_that_two_plugins_offer_is_refused_by_both_names(install: Install) -> None:
    install("here", {"here/conf/generator/encoder/same.yaml": "a: 1\n"})
    install("there", {"there/conf/generator/encoder/same.yaml": "a: 2\n"})
    with pytest.raises(PluginError, match=r"generator/encoder=same.*here and there"):
        plugins()


def test_a_plugin_cannot_hide_an_option_of_the_core(install: Install) -> None:
    install("sly", {"sly/conf/task/train.yaml": "name: train\n"})
    with pytest.raises(PluginError, match=r"task=train.*motiongen and sly"):
        plugins()


def test_the_same_name_in_two_groups_is_allowed(install: Install) -> None:
    install(
        "both", {"both/conf/generator/encoder/same.yaml": "a: 1\n", "both/conf/generator/decoder/same.yaml": "a: 1\n"}
    )
    assert {("both", "generator/encoder", "same"), ("both", "generator/decoder", "same")} <= found()


def test_an_entry_point_must_name_a_package_with_options(install: Install) -> None:
    install("bare", {"bare/__init__.py": ""})
    with pytest.raises(PluginError, match=r"bare.*no conf/ folder"):
        plugins()


def test_an_entry_point_to_nothing_is_named(install: Install) -> None:
    install("ghost", {})
    with pytest.raises(PluginError, match=r"plugin ghost.*not a package"):
        plugins()


def test_module_path_finds_modules_packages_and_nothing_else() -> None:
    assert module_path("motiongen") == Path(discovery.__file__).parent
    assert module_path("motiongen.tasks.list") == Path(discovery.__file__).parent / "tasks" / "list.py"
    assert module_path("motiongen.tasks.nothing") is None
    assert module_path("no_such_package.module") is None
    assert module_path("sys") is None


def test_discovery_imports_no_plugin_and_no_torch() -> None:
    program = (
        "import sys; from motiongen.discovery import options; options(); "
        "print(sorted(name for name in sys.modules if name.split('.')[0] in ('torch', 'motiongen_plugins')))"
    )
    answer = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert answer.stdout.strip() == "[]"
