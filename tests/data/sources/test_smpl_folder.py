from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import torch

from motiongen.data.clips import DataError
from motiongen.data.sources.amass import LEG_LENGTH, REST_PELVIS
from motiongen.data.sources.smpl_folder import SmplFolder
from motiongen.data.store import ClipStore
from motiongen.motion.representation import unpack
from tests.data.sources.miniatures import Known, amass, save_npz, smpl_corpus, times


@pytest.mark.parametrize("layout", ["smplh", "smplx"])
def test_poses_and_places_are_those_that_were_written(tmp_path: Path, layout: str) -> None:
    motion, rest = Known(3), np.array(REST_PELVIS[layout])
    save_npz(tmp_path / "walk" / "one.npz", amass(motion, 80, 60.0, rest, layout))
    source = SmplFolder(root=str(tmp_path))
    (sequence,) = source.sequences()
    rotations, pelvis = unpack(sequence.features.double())
    when = times(80, 60.0)[::2]
    scale = source.skeleton().leg_length / LEG_LENGTH
    assert (pelvis - torch.from_numpy(motion.pelvis(when)) * scale).abs().max() < 1e-4
    written = torch.from_numpy(motion.turns(when)).double()
    assert (rotations.shape[0], sequence.segments[0].tags) == (len(written), ("walk",))


def test_folders_are_tags_and_shapes_are_no_motion(tmp_path: Path) -> None:
    store = ClipStore.open(SmplFolder(root=str(smpl_corpus(tmp_path))), tmp_path / "cache")
    assert store.tags == ("kick", "walk")
    assert len(store.sequences) == 12
    assert store.quarantine == {}


def test_names_and_tables_are_labels_too(tmp_path: Path) -> None:
    root = smpl_corpus(tmp_path)
    by_name = SmplFolder(root=str(root), pattern=r"(?P<group>\d)\d?_(?P<tag>[a-z]+)")
    found = {(one.group, one.segments[0].tags) for one in by_name.sequences()}
    assert ("1", ("poses",)) in found
    (root / "labels.csv").write_text("file,tags\nrub000/walk/0_poses.npz,turn + wave\n")
    (listed,) = SmplFolder(root=str(root)).sequences()
    assert (listed.name, listed.segments[0].tags) == ("rub000/walk/0_poses", ("turn", "wave"))


def test_damaged_files_are_left_out_with_the_reason(tmp_path: Path) -> None:
    root = smpl_corpus(tmp_path)
    fields = amass(Known(0), 120, 60.0, np.zeros(3))
    save_npz(root / "rub000" / "walk" / "0_poses.npz", {key: fields[key] for key in fields if key != "trans"})
    store = ClipStore.open(SmplFolder(root=str(root)), tmp_path / "cache")
    assert list(store.quarantine) == ["rub000/walk/0_poses.npz"]
    assert "0_poses.npz: field 'trans' is missing" in store.quarantine["rub000/walk/0_poses.npz"]


def test_the_fingerprint_follows_files_and_labels(tmp_path: Path) -> None:
    root = smpl_corpus(tmp_path)
    prints = [SmplFolder(root=str(root)).fingerprint(), SmplFolder(root=str(root), root_tags=["walk"]).fingerprint()]
    prints.append(SmplFolder(root=str(root), pattern=r"(?P<tag>.*)").fingerprint())
    save_npz(root / "rub000" / "walk" / "0_poses.npz", amass(Known(9), 120, 60.0, np.zeros(3)))
    prints.append(SmplFolder(root=str(root)).fingerprint())
    assert len(set(prints)) == 4


def test_a_folder_without_motion_is_named(tmp_path: Path) -> None:
    save_npz(tmp_path / "shape.npz", {"betas": np.zeros(16)})
    with pytest.raises(DataError, match=f"{tmp_path}: no .npz files"):
        SmplFolder(root=str(tmp_path))
