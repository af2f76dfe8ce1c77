"""Lets an editable install find the repository's folder plugins/ under its import name, motiongen_plugins."""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class EditablePlugins(BuildHookInterface):
    """Maps plugins/ to motiongen_plugins: hatchling renames folders in wheels, `editables` in editable installs."""

    PLUGIN_NAME = "custom"

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        if version != "editable":
            return
        from editables import EditableProject

        project = EditableProject("motiongen_plugins", self.root)
        project.map("motiongen_plugins", "plugins")
        self.folder = Path(tempfile.mkdtemp())
        for name, text in project.files():
            (self.folder / name).write_text(text, encoding="utf-8")
            build_data["force_include_editable"][str(self.folder / name)] = name
        build_data["dependencies"].extend(project.dependencies())

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        if version == "editable":
            shutil.rmtree(self.folder)
