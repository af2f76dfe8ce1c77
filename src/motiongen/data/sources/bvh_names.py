"""How skeletons of BVH files name the joints that stand for SMPL's."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from types import MappingProxyType

from motiongen.motion.skeleton import JOINT_NAMES

OPTIONAL = frozenset({"spine1", "spine2", "neck", "left_collar", "right_collar"})
"""Joints that a rig may lack: they keep to their parent then. All have one child."""

Names = Mapping[str, str | None]


def _both_sides(parts: Mapping[str, str | None], sides: tuple[tuple[str, str], ...]) -> Names:
    """`hip: UpLeg` as `left_hip: LeftUpLeg` and `right_hip: RightUpLeg`; a side is put where its `{}` is."""
    names: dict[str, str | None] = {}
    for joint, name in parts.items():
        if joint in JOINT_NAMES:
            names[joint] = name
        else:
            for side, word in sides:
                names[f"{side}_{joint}"] = None if name is None else name.format(word)
    return MappingProxyType({joint: names[joint] for joint in JOINT_NAMES})


_WORDS = (("left", "Left"), ("right", "Right"))
_LETTERS = (("left", "L"), ("right", "R"))
_LIMBS = {
    "pelvis": "Hips",
    "hip": "{}UpLeg",
    "knee": "{}Leg",
    "ankle": "{}Foot",
    "foot": "{}ToeBase",
    "neck": "Neck",
    "head": "Head",
    "collar": "{}Shoulder",
    "shoulder": "{}Arm",
    "elbow": "{}ForeArm",
    "wrist": "{}Hand",
}
_THREE_SPINES = {"spine1": "Spine", "spine2": "Spine1", "spine3": "Spine2"}

CONVENTIONS: Mapping[str, Names] = MappingProxyType(
    {
        "smpl": MappingProxyType({joint: joint for joint in JOINT_NAMES}),
        # CMU's recordings as BVH: three joints below the neck, two in it.
        "cmu": _both_sides({**_LIMBS, "spine1": "LowerBack", "spine2": "Spine", "spine3": "Spine1"}, _WORDS),
        "mixamo": _both_sides({**_LIMBS, **_THREE_SPINES}, _WORDS),
        "lafan1": _both_sides({**_LIMBS, **_THREE_SPINES, "foot": "{}Toe"}, _WORDS),
        "bandai": _both_sides(
            {
                "pelvis": "Hips",
                "hip": "UpperLeg_{}",
                "knee": "LowerLeg_{}",
                "ankle": "Foot_{}",
                "foot": "Toes_{}",
                "spine1": "Spine",
                "spine2": None,
                "spine3": "Chest",
                "neck": "Neck",
                "head": "Head",
                "collar": "Shoulder_{}",
                "shoulder": "UpperArm_{}",
                "elbow": "LowerArm_{}",
                "wrist": "Hand_{}",
            },
            _LETTERS,
        ),
    }
)
"""For each convention, its name of every SMPL joint."""


def guess_names(found: Collection[str]) -> tuple[str, Names]:
    """The convention that joint names follow, and the file's own name of every SMPL joint.

    A name space in front, as in `mixamorig:Hips`, does not matter.

    Raises:
        ValueError: none fits; it says what the nearest one lacks.
    """
    plain = {name.rpartition(":")[2]: name for name in found}
    lacking = {
        convention: [name for name in names.values() if name is not None and name not in plain]
        for convention, names in CONVENTIONS.items()
    }
    nearest = min(lacking, key=lambda convention: len(lacking[convention]))
    if lacking[nearest]:
        raise ValueError(
            f"the joints' names are none of {', '.join(CONVENTIONS)}; {nearest} comes nearest, but there is no "
            f"{', '.join(lacking[nearest][:3])}"
        )
    return nearest, {joint: None if name is None else plain[name] for joint, name in CONVENTIONS[nearest].items()}
