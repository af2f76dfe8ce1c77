"""Finds plugins without importing them, and puts their options on Hydra's search path.

A package that declares an entry point in the group `motiongen.plugins` names one of its packages. If that folder holds
`conf/`, it is a plugin; if not, it is a collection, and each of its folders that holds `conf/` is a plugin. The
built-in plugins are found in the same way. Nothing of a plugin is imported: a broken plugin breaks nothing but its own
use, and the command line answers before torch is loaded.
"""

from __future__ import annotations

import importlib.util
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cache
from importlib.metadata import entry_points
from pathlib import Path

from hydra.core.config_search_path import ConfigSearchPath
from hydra.core.plugins import Plugins
from hydra.plugins.search_path_plugin import SearchPathPlugin

from motiongen.errors import InputError

GROUP = "motiongen.plugins"
CORE = "motiongen"


class PluginError(InputError):
    """A plugin that cannot be found, or two that offer the same option."""


@dataclass(frozen=True)
class Plugin:
    """A folder that offers options."""

    name: str
    """Import name of its package; `motiongen` for the core's own options."""
    conf: Path
    """Its conf/ folder."""

    def options(self) -> Iterator[Option]:
        """Every option below conf/, in order of group and name."""
        for path in sorted(self.conf.rglob("*.yaml")):
            relative = path.relative_to(self.conf)
            if len(relative.parts) > 1:
                yield Option(relative.parent.as_posix(), relative.stem, self.name, path)


@dataclass(frozen=True)
class Option:
    """One file that a config group offers."""

    group: str
    """Config group, such as `generator/encoder`."""
    name: str
    plugin: str
    path: Path

    @property
    def description(self) -> str:
        """The first comment of the file that is not Hydra's `@package` line."""
        for line in self.path.read_text(encoding="utf-8").splitlines():
            text = line.removeprefix("#").strip()
            if not line.startswith("#"):
                return ""
            if text and not text.startswith("@package"):
                return text
        return ""


def core_conf() -> Path:
    """The core's conf/ folder: inside the installed package, or at the top of the repository."""
    package = Path(__file__).parent
    installed = package / "conf"
    return installed if installed.is_dir() else package.parents[1] / "conf"


def module_path(name: str) -> Path | None:
    """The file of a module or the folder of a package, found without importing anything; None if there is none."""
    top, *rest = name.split(".")
    try:
        spec = importlib.util.find_spec(top)
    except (ImportError, ValueError):
        return None
    if spec is None:
        return None
    if spec.submodule_search_locations is None:
        return Path(spec.origin) if spec.has_location and spec.origin and not rest else None
    for location in spec.submodule_search_locations:
        path = Path(location).joinpath(*rest)
        if path.is_dir():
            return path
        if path.with_name(path.name + ".py").is_file():
            return path.with_name(path.name + ".py")
    return None


@cache
def plugins() -> tuple[Plugin, ...]:
    """The core's options and every installed plugin, each once.

    Raises:
        PluginError: an entry point names a package that does not exist or that offers no options, or two plugins offer
            the same option.
    """
    found = {core_conf(): Plugin(CORE, core_conf())}
    for entry in sorted(entry_points(group=GROUP), key=lambda entry: entry.value):
        folder = module_path(entry.value)
        if folder is None or not folder.is_dir():
            raise PluginError(f"plugin {entry.name}: its entry point names {entry.value}, which is not a package")
        offered = list(_plugins_in(entry.value, folder))
        if not offered:
            raise PluginError(
                f"plugin {entry.name}: {folder} has no conf/ folder, and no folder in it has one; see "
                "docs/adding-a-plugin.md for the layout"
            )
        found.update({plugin.conf: plugin for plugin in offered})
    refuse_duplicates(found.values())
    return tuple(found.values())


def _plugins_in(name: str, folder: Path) -> Iterator[Plugin]:
    if (folder / "conf").is_dir():
        yield Plugin(name, folder / "conf")
        return
    for conf in sorted(folder.glob("*/conf")):
        yield Plugin(f"{name}.{conf.parent.name}", conf)


def refuse_duplicates(found: Iterable[Plugin]) -> None:
    """Raises PluginError where two plugins offer the same option of the same group: one would hide the other."""
    owners: dict[tuple[str, str], str] = {}
    for plugin in found:
        for option in plugin.options():
            owner = owners.setdefault((option.group, option.name), plugin.name)
            if owner != plugin.name:
                raise PluginError(
                    f"two plugins offer {option.group}={option.name}: {owner} and {plugin.name}; rename the option of "
                    "one of them, or uninstall it"
                )


def options() -> tuple[Option, ...]:
    """Every option of every group, the groups in alphabetical order."""
    found = [option for plugin in plugins() for option in plugin.options()]
    return tuple(sorted(found, key=lambda option: (option.group, option.name)))


class MotiongenSearchPath(SearchPathPlugin):
    """Adds every plugin's conf/ to Hydra's search path."""

    def manipulate_search_path(self, search_path: ConfigSearchPath) -> None:
        for plugin in plugins():
            if plugin.name != CORE:
                search_path.append(provider=plugin.name, path=f"file://{plugin.conf}")


def register_search_path() -> None:
    """Makes Hydra find the options of all plugins. Call it before Hydra starts; calling it again changes nothing."""
    Plugins.instance().register(MotiongenSearchPath)
