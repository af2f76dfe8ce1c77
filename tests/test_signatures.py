from __future__ import annotations

import inspect
from importlib import import_module
from pathlib import Path

import pytest

from motiongen.signatures import TargetError, signature_of


def names(target: str) -> list[str]:
    signature = signature_of(target)
    assert signature is not None
    return [parameter.name for parameter in signature.parameters]


@pytest.mark.parametrize(
    "target",
    [
        "torch.optim.Adam",  # re-exported by a package
        "torch.optim.lr_scheduler.StepLR",
        "pytorch_lightning.callbacks.ModelCheckpoint",
        "motiongen_plugins.time_unrolling.time_unrolling.TimeUnrolling",
        "motiongen.tracking.mlflow.MlflowTracker",
        "pathlib.PurePath.nothing_to_check",
    ],
)
def test_parameters_are_those_that_python_sees(target: str) -> None:
    signature = signature_of(target)
    if "nothing" in target:
        assert signature is None
        return
    module, _, name = target.rpartition(".")
    seen = inspect.signature(getattr(import_module(module), name)).parameters.values()
    assert signature is not None
    expected = [(p.name, p.default is p.empty) for p in seen if p.kind not in (p.VAR_KEYWORD, p.VAR_POSITIONAL)]
    assert [(parameter.name, parameter.required) for parameter in signature.parameters] == expected


SOURCE = """
import dataclasses
from dataclasses import dataclass
from typing import ClassVar
from package.other import Renamed as Known
class Base:
    def __init__(self, width: int, *, depth: int = 2): ...
class Inherits(Base):
    def forward(self): ...
class Everything:
    def __init__(self, a, **kwargs): ...
class Nothing: ...
class Foreign(dict): ...
@dataclasses.dataclass(frozen=True)
class Record:
    kind: ClassVar[str] = "x"
    width: int
    depth: int = 2
def function(a, /, b, *, c): ...
value = function
"""


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    name = f"package_{abs(hash(str(tmp_path)))}"
    folder = tmp_path / name
    folder.mkdir()
    (folder / "__init__.py").write_text("from .module import Record\nfrom .hidden import hidden\n")
    (folder / "hidden.py").write_text("def hidden(): ...\n")
    (folder / "module.py").write_text(SOURCE.replace("package", name))
    (folder / "other.py").write_text("class Renamed:\n    def __init__(self, *, colour: str): ...\n")
    (folder / "broken.py").write_text("def f(:\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    return name


def test_constructors_of_all_kinds(package: str) -> None:
    module = f"{package}.module"
    assert names(f"{module}.Inherits") == ["width", "depth"]
    assert names(f"{module}.Record") == ["width", "depth"]
    assert names(f"{package}.Record") == ["width", "depth"]
    assert names(f"{module}.Known") == ["colour"]
    assert names(f"{module}.Nothing") == []
    assert names(f"{module}.function") == ["a", "b", "c"]
    everything = signature_of(f"{module}.Everything")
    assert everything is not None
    assert everything.takes_any


def test_what_the_source_does_not_tell_is_left_unchecked(package: str) -> None:
    assert signature_of(f"{package}.module.Foreign") is None
    assert signature_of(f"{package}.module.value") is None
    assert signature_of("torch.tensor") is None


def test_targets_that_name_nothing(package: str) -> None:
    with pytest.raises(TargetError, match=r"has no 'Recrod'; did you mean 'Record'\?"):
        signature_of(f"{package}.module.Recrod")
    with pytest.raises(TargetError, match=r"has no module 'modul'; did you mean 'module'\?"):
        signature_of(f"{package}.modul.Record")
    with pytest.raises(TargetError, match=rf"hides the module; use {package}\.hidden"):
        signature_of(f"{package}.hidden.hidden")
    with pytest.raises(TargetError, match="there is no module"):
        signature_of("no_such_package.Record")
    with pytest.raises(TargetError, match=r"broken\.py, line 1"):
        signature_of(f"{package}.broken.f")
