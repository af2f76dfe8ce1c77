"""The formats that motion is exported in, by name. Nothing heavy is imported: the command line is checked by this."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

ENDINGS: Mapping[str, str] = MappingProxyType(
    {"amass": ".amass.npz", "bvh": ".bvh", "csv": ".csv", "glb": ".glb", "mp4": ".mp4"},
)
"""Name of a format -> how the names of its files end; their last suffix is what `motiongen.export.write` goes by."""
PACKAGES: Mapping[str, tuple[str, str]] = MappingProxyType({"mp4": ("av", "video")})
"""Name of a format -> the package that it needs, and the extra of this one that brings it."""
