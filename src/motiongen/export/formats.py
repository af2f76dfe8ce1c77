"""The formats that motion is exported in, by name. Nothing heavy is imported: the command line is checked by this."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

ENDINGS: Mapping[str, str] = MappingProxyType(
    {"amass": ".amass.npz", "bvh": ".bvh", "csv": ".csv", "glb": ".glb"},
)
"""Name of a format -> how the names of its files end; their last suffix is what `motiongen.export.write` goes by."""
