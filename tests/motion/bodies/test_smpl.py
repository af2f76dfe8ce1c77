"""SMPL-family files: a small stand-in in their format, since the real models may not be passed on."""

from __future__ import annotations

import os
import pickle
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
import roma
import torch

from motiongen.motion.bodies import Body, BodyFileError, makehuman, smpl
from motiongen.motion.skeleton import JOINTS, PARENTS

VERTICES = 40
HANDS = (20, 21)


def model(joints: int, seed: int = 0) -> dict[str, np.ndarray[Any, Any]]:
    """Random arrays in SMPL's layout; joints beyond the body hang on the wrists."""
    rng = np.random.default_rng(seed)
    parents = [*PARENTS, *(HANDS[extra % 2] for extra in range(joints - JOINTS))]
    regressor, weights = rng.random((joints, VERTICES)), rng.random((VERTICES, joints)) ** 8
    return {
        "v_template": rng.normal(size=(VERTICES, 3)),
        "shapedirs": 0.1 * rng.normal(size=(VERTICES, 3, 10)),
        "posedirs": 0.1 * rng.normal(size=(VERTICES, 3, 9 * (joints - 1))),
        "J_regressor": regressor / regressor.sum(axis=1, keepdims=True),
        "kintree_table": np.array([[2**32 - 1, *parents[1:]], range(joints)], dtype=np.int64),
        "weights": weights / weights.sum(axis=1, keepdims=True),
        "f": rng.integers(0, VERTICES, (30, 3)).astype(np.uint32),
    }


def write(path: Path, arrays: dict[str, Any]) -> Path:
    if path.suffix == ".npz":
        np.savez(path, **arrays)
    else:
        path.write_bytes(pickle.dumps(arrays, protocol=2))
    return path


def reference(arrays: dict[str, Any], rotations: np.ndarray[Any, Any], betas: np.ndarray[Any, Any]) -> Any:
    """SMPL's vertices with the pelvis at the origin, as in Loper et al. 2015, Eq. 2-9, all joints, in 4x4 matrices."""
    joints = arrays["weights"].shape[1]
    shaped = arrays["v_template"] + arrays["shapedirs"][:, :, : len(betas)] @ betas
    places = arrays["J_regressor"] @ shaped
    bent = (rotations[1:] - np.eye(3)).reshape(-1)
    posed = shaped + arrays["posedirs"] @ bent
    transforms = np.zeros((joints, 4, 4))
    for joint in range(joints):
        parent = int(arrays["kintree_table"][0, joint]) if joint else -1
        local = np.eye(4)
        local[:3, :3] = rotations[joint]
        local[:3, 3] = places[joint] - (places[parent] if joint else 0)
        transforms[joint] = local if joint == 0 else transforms[parent] @ local
    vertices = np.zeros_like(posed)
    for vertex in range(len(posed)):
        for joint in range(joints):
            moved = transforms[joint] @ np.append(posed[vertex] - places[joint], 1.0)
            vertices[vertex] += arrays["weights"][vertex, joint] * moved[:3]
    return vertices - places[0]


@pytest.mark.parametrize("joints", [24, 52, 55], ids=["SMPL", "SMPL-H", "SMPL-X"])
@pytest.mark.parametrize("suffix", [".npz", ".pkl"])
def test_vertices_agree_with_the_papers_equations(tmp_path: Path, joints: int, suffix: str) -> None:
    arrays = model(joints)
    betas = np.array([1.5, -2.0, 0.7])
    body = smpl(write(tmp_path / f"model{suffix}", arrays), betas=betas.tolist())
    generator = torch.Generator().manual_seed(0)
    body_rotations = roma.rotvec_to_rotmat(torch.randn(JOINTS, 3, generator=generator))
    rotations = np.tile(np.eye(3), (joints, 1, 1))
    rotations[:JOINTS] = body_rotations.numpy()
    ours = body.vertices(body_rotations, torch.zeros(3)).numpy()
    np.testing.assert_allclose(ours, reference(arrays, rotations, betas), atol=2e-5)


def test_shape_coefficients_move_vertices_and_joints(tmp_path: Path) -> None:
    path = write(tmp_path / "model.npz", model(24))
    mean, shaped = smpl(path), smpl(path, betas=[2.0])
    assert not torch.allclose(mean.rest, shaped.rest)
    assert not torch.allclose(mean.skeleton.offsets, shaped.skeleton.offsets)


@pytest.mark.parametrize("sparse", ["csc_matrix", "csr_matrix"])
def test_sparse_regressors_of_pickles_are_read(tmp_path: Path, sparse: str) -> None:
    import scipy.sparse

    arrays = model(24)
    arrays["J_regressor"][arrays["J_regressor"] < 0.02] = 0
    dense = smpl(write(tmp_path / "dense.pkl", arrays))
    packed = smpl(
        write(tmp_path / "sparse.pkl", arrays | {"J_regressor": getattr(scipy.sparse, sparse)(arrays["J_regressor"])})
    )
    assert torch.equal(dense.skeleton.offsets, packed.skeleton.offsets)


def test_chumpy_arrays_are_read_without_chumpy(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    arrays = model(24)
    with monkeypatch.context() as patch:
        # Classes of the names and state of chumpy's, which no longer installs.
        for module, name in (("chumpy", ""), ("chumpy.ch", "Ch"), ("chumpy.reordering", "Select")):
            made = ModuleType(module)
            if name:
                setattr(made, name, type(name, (), {"__module__": module}))
            patch.setitem(sys.modules, module, made)
        whole, chosen = sys.modules["chumpy.ch"].Ch(), sys.modules["chumpy.reordering"].Select()
        whole.__dict__ = {"x": arrays["v_template"], "_dirty_vars": set()}
        wide = sys.modules["chumpy.ch"].Ch()
        wide.__dict__ = {"x": np.concatenate([arrays["shapedirs"], arrays["shapedirs"]], axis=2)}
        idxs = np.arange(VERTICES * 3 * 20).reshape(VERTICES, 3, 20)[:, :, :10].ravel()
        chosen.__dict__ = {"a": wide, "idxs": idxs, "preferred_shape": (VERTICES, 3, 10)}
        path = write(tmp_path / "chumpy.pkl", arrays | {"v_template": whole, "shapedirs": chosen})
    plain = write(tmp_path / "plain.pkl", arrays)
    assert torch.equal(smpl(path, betas=[1.0]).rest, smpl(plain, betas=[1.0]).rest)


class _Attack:
    def __reduce__(self) -> tuple[Any, ...]:
        return os.system, ("touch attacked",)


def test_a_pickle_never_runs_code(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    path = write(tmp_path / "attack.pkl", model(24) | {"v_template": _Attack()})
    with pytest.raises(BodyFileError, match=r"attack\.pkl: holds a posix\.system"):
        smpl(path)
    assert not (tmp_path / "attacked").exists()


@pytest.mark.parametrize("field", ["v_template", "posedirs", "J_regressor", "kintree_table", "weights", "f"])
def test_a_missing_field_is_named(tmp_path: Path, field: str) -> None:
    arrays = {name: array for name, array in model(24).items() if name != field}
    with pytest.raises(BodyFileError, match=rf"model\.npz: the field {field} is missing"):
        smpl(write(tmp_path / "model.npz", arrays))


def test_damaged_files_are_refused(tmp_path: Path) -> None:
    with pytest.raises(BodyFileError, match="there is no file"):
        smpl(tmp_path / "absent.npz")
    whole = write(tmp_path / "model.pkl", model(24)).read_bytes()
    (tmp_path / "cut.pkl").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(BodyFileError, match=r"cut\.pkl: not a readable body model"):
        smpl(tmp_path / "cut.pkl")
    (tmp_path / "text.npz").write_text("not a model")
    with pytest.raises(BodyFileError, match=r"text\.npz: not a readable body model"):
        smpl(tmp_path / "text.npz")
    with pytest.raises(BodyFileError, match=r"the field weights has shape \(40, 3\), not \(40, 24\)"):
        smpl(write(tmp_path / "narrow.npz", model(24) | {"weights": np.ones((VERTICES, 3))}))
    (tmp_path / "list.pkl").write_bytes(pickle.dumps([1, 2]))
    with pytest.raises(BodyFileError, match="holds a list"):
        smpl(tmp_path / "list.pkl")
    with pytest.raises(BodyFileError, match="11 betas"):
        smpl(write(tmp_path / "model.npz", model(24)), betas=[0.0] * 11)


def test_both_bodies_answer_the_same_calls(tmp_path: Path) -> None:
    skeleton = makehuman().skeleton
    for body in (makehuman(), smpl(write(tmp_path / "model.npz", model(24)))):
        assert isinstance(body, Body)
        fitted = body.fitted_to(skeleton).to("cpu")
        vertices = fitted.vertices(torch.eye(3).repeat(2, 5, JOINTS, 1, 1), torch.zeros(2, 5, 3))
        assert vertices.shape == (2, 5, len(body.rest), 3)
        assert torch.isfinite(vertices).all()
