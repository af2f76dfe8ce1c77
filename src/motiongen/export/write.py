"""One motion to one file that other tools open."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType

from motiongen.errors import InputError
from motiongen.export.amass import encode_amass
from motiongen.export.bvh import encode_bvh
from motiongen.export.gltf import encode_glb
from motiongen.export.joints import encode_joints
from motiongen.export.scene import Scene
from motiongen.export.video import encode_mp4
from motiongen.files import replacing
from motiongen.suggestions import did_you_mean

ENCODERS: Mapping[str, Callable[[Scene], bytes]] = MappingProxyType(
    {".bvh": encode_bvh, ".csv": encode_joints, ".glb": encode_glb, ".mp4": encode_mp4, ".npz": encode_amass}
)
"""A file's suffix -> what makes its content."""


class ExportError(InputError):
    """A file that cannot be written; the message names it."""


def write(path: str | Path, scene: Scene) -> None:
    """Write the scene's motion on its body in the format of the path's suffix; the file is whole or not touched.

    Raises:
        ExportError: a suffix that no format has, or a folder that does not exist.
    """
    path = Path(path)
    encode = ENCODERS.get(path.suffix.lower())
    if encode is None:
        near = did_you_mean(path.suffix.lower(), ENCODERS)
        raise ExportError(f"{path}: no format has the suffix {path.suffix!r}{near}; known: {', '.join(ENCODERS)}")
    if not path.parent.is_dir():
        raise ExportError(f"{path}: there is no folder {path.parent}")
    content = encode(scene)
    try:
        with replacing(path) as partial:
            partial.write_bytes(content)
    except OSError as error:
        raise ExportError(f"{path}: cannot be written: {error.strerror}") from error
