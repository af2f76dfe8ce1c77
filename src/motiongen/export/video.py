"""A film of a motion: MP4 with H.264, which every browser and editor plays."""

from __future__ import annotations

import io
from fractions import Fraction

from motiongen.errors import InputError
from motiongen.export.raster import pictures
from motiongen.export.scene import Scene

SIZE = 480
"""Pixels; H.264 takes even ones."""
QUALITY = "20"
"""Constant rate factor: 0 is lossless, 18 looks it."""


def encode_mp4(scene: Scene) -> bytes:
    """All frames of the scene at its own rate, as the GIF shows them.

    Raises:
        InputError: the package `av` is not installed.
    """
    try:
        import av
    except ImportError as error:
        raise InputError("mp4 needs the package av: pip install 'motiongen[video]'") from error
    film = io.BytesIO()
    with av.open(film, "w", format="mp4") as container:
        stream = container.add_stream("h264", rate=Fraction(scene.fps).limit_denominator(1001))
        stream.width, stream.height, stream.pix_fmt = SIZE, SIZE, "yuv420p"
        stream.options = {"crf": QUALITY}
        for picture in pictures(scene, range(scene.frames), SIZE):
            for packet in stream.encode(av.VideoFrame.from_image(picture.convert("RGB"))):
                container.mux(packet)
        for packet in stream.encode():
            container.mux(packet)
    return film.getvalue()
