from __future__ import annotations

from pathlib import Path

import av
import numpy as np

from motiongen.export.raster import pictures
from motiongen.export.video import SIZE
from motiongen.export.write import write
from tests.export.motions import swinging


def test_a_film_has_every_frame_at_the_scenes_rate(tmp_path: Path) -> None:
    path, scene = tmp_path / "swing.mp4", swinging(frames=12)
    write(path, scene)
    with av.open(str(path)) as container:
        (stream,) = container.streams
        assert (stream.codec_context.name, stream.width, stream.height) == ("h264", SIZE, SIZE)
        assert stream.average_rate == 30
        frames = [frame.to_ndarray(format="rgb24").astype(int) for frame in container.decode(stream)]
    assert len(frames) == 12
    *_, expected = pictures(scene, range(12), SIZE)
    # What is lost in compression is little beside what moves.
    assert np.abs(frames[-1] - np.asarray(expected.convert("RGB"), int)).mean() < 3
    assert np.abs(frames[-1] - frames[0]).max() > 60
    assert [file.name for file in tmp_path.iterdir()] == ["swing.mp4"]
