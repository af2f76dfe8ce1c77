from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from motiongen.data.roots import DataError
from motiongen.data.sources.amc import read_amc

TEXT = """#!OML:ASF somewhere
:FULLY-SPECIFIED
:DEGREES
1
root 1 2 3 4 5 6
lhand -1.758e-015 0.5
lradius 27.1
2
root 1.5 2 3 4 5 -6
lhand 0 0
lradius 28.1
3
root 2 2 3 4 5 6
lhand 0 0
lradius 29.1
"""
WIDTHS = {"lradius": 1, "root": 6}


@pytest.fixture
def path(tmp_path: Path) -> Path:
    (tmp_path / "walk.amc").write_text(TEXT)
    return tmp_path / "walk.amc"


def test_values_of_the_bones_that_are_wanted(path: Path) -> None:
    values = read_amc(path, WIDTHS)
    assert list(values) == ["lradius", "root"]
    assert values["lradius"].tolist() == [[27.1], [28.1], [29.1]]
    assert values["root"][1].tolist() == [1.5, 2, 3, 4, 5, -6]


@pytest.mark.parametrize(
    ("damage", "complaint"),
    [
        (
            lambda text: text[: text.index("lradius 29")],
            r":14: lradius: missing in frame 3; is the file damaged or cut",
        ),
        (lambda text: text[: text.index("4 5 -6")], r":9: lradius: missing in frame 2; is the file damaged or cut"),
        (lambda text: text.replace(" 4 5 -6", ""), r":9: root: 3 values, not 6; is the file cut"),
        (lambda text: text.replace("lradius 28.1\n", ""), r":11: lradius: missing in frame 2"),
        (lambda text: text.replace("\n3\n", "\n4\n"), r":12: frame 4 follows frame 2"),
        (lambda text: text.replace("28.1", "x"), r":11: lradius: 'x' is no finite number"),
        (lambda text: text.replace("28.1", "inf"), r":11: lradius: 'inf' is no finite number"),
        (lambda text: text.replace("\n1\n", "\n"), r":7: lradius: given twice in, or before, frame 0"),
        (lambda text: text.replace("\n2\n", "\n"), r":11: lradius: given twice in, or before, frame 1"),
        (lambda text: ":DEGREES\n", r": no frames"),
    ],
)
def test_damage_is_named_with_file_line_and_bone(path: Path, damage: Callable[[str], str], complaint: str) -> None:
    path.write_text(damage(TEXT))
    with pytest.raises(DataError, match=complaint) as caught:
        read_amc(path, WIDTHS)
    assert str(caught.value).startswith(str(path))
