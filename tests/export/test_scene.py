from __future__ import annotations

from dataclasses import replace

import pytest
import torch

from motiongen.export.scene import Scene, SceneError, outfit
from motiongen.motion.bodies import makehuman
from motiongen.motion.skeleton import JOINT

FEATURES = torch.randn(10, 135, generator=torch.Generator().manual_seed(0))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"features": torch.zeros(10, 3)}, r"features have shape \(10, 3\)"),
        ({"features": torch.zeros(0, 135)}, "T > 0"),
        ({"features": torch.full((10, 135), torch.nan)}, "features have values that are not finite"),
        ({"initial_frames": 11}, "initial_frames is 11"),
        ({"trajectory": torch.zeros(10, 3)}, r"trajectory has shape \(10, 3\)"),
        ({"labels": ((4, 11, "walk"),)}, r"label 'walk' spans frames \[4, 11\)"),
        ({"fps": 0.0}, "fps is 0.0"),
    ],
)
def test_parts_that_do_not_fit_are_named(change: dict[str, object], message: str) -> None:
    scene = Scene("a scene", FEATURES, makehuman())
    with pytest.raises(SceneError, match="scene 'a scene': .*" + message):
        replace(scene, **change)


def test_labels_of_a_frame_and_their_colors() -> None:
    labels = ((0, 5, "walk"), (3, 8, "wave"), (8, 10, "walk"))
    scene = Scene("s", FEATURES, makehuman(), labels=labels)
    assert [scene.label_at(frame) for frame in (0, 4, 5, 9)] == ["walk", "walk + wave", "wave", "walk"]
    assert scene.color_of("walk") != scene.color_of("wave")


def test_outfit_tells_limbs_apart() -> None:
    body = makehuman()
    colors, part = outfit(body), body.weights.argmax(dim=1)
    assert colors.shape == (len(body.rest), 3)
    mean = {name: colors[part == JOINT[name]].mean(dim=0) for name in ("head", "spine3", "left_knee")}
    assert (mean["head"] - mean["spine3"]).abs().max() > 0.1
    assert (mean["left_knee"] - mean["spine3"]).abs().max() > 0.1
