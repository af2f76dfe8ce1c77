"""Make docs/images/builtin-31.png: a performance of every tag of `data=builtin_31`, eight poses each.

python tools/make_builtin_sheet.py
"""

from __future__ import annotations

import argparse
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from motiongen.data.clips import Sequence
from motiongen.data.sources.builtin.babel_mag import COUNTS, PART_COUNTS, STAIRS
from motiongen.data.sources.builtin.body import MEAN
from motiongen.data.sources.builtin.repertoire import act
from motiongen.data.sources.builtin.sessions import session
from motiongen.data.sources.builtin.subjects import cast
from motiongen.export.raster import render_strip
from motiongen.export.scene import Scene
from motiongen.motion.bodies import makehuman
from motiongen.motion.bodies.body import Body

OUTPUT = Path(__file__).resolve().parents[1] / "docs/images/builtin-31.png"
COLUMNS, WIDTH, ROW, HEAD = 2, 470, 144, 18
ABOVE, BELOW = 34, 58
"""What `render_strip` puts above and below the poses, pixels."""
PEOPLE = cast(0, 12, body_spread=0.08)


def performance(tags: tuple[str, ...], number: int) -> Sequence:
    """A session of one action; stairs are gone up and down."""
    acts = [act(tags)] * (2 if tags[0] == STAIRS else 1)
    generator = np.random.default_rng([31, number, *map(len, tags)])
    return session("sheet", PEOPLE[generator.integers(len(PEOPLE))], generator, lambda _: acts)


def row(shown: Sequence, body: Body, folder: Path) -> Image.Image:
    """Eight poses, (WIDTH, ROW)."""
    start, stop = shown.segments[0].start, shown.segments[-1].stop
    render_strip(folder / "strip.png", Scene("", shown.features[start:stop], body), height=ROW - HEAD)
    with Image.open(folder / "strip.png") as strip:
        poses = strip.convert("RGB").crop((0, ABOVE, strip.width, strip.height - BELOW))
    poses.thumbnail((WIDTH, ROW - HEAD))
    picture = Image.new("RGB", (WIDTH, ROW), "white")
    picture.paste(poses, (0, HEAD))
    text = f"{' + '.join(shown.segments[0].tags)}, {(stop - start) / 30:.1f} s"
    ImageDraw.Draw(picture).text((6, HEAD / 2), text, font=ImageFont.load_default(12), fill="#1f2937", anchor="lm")
    return picture


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--output", type=Path, default=OUTPUT)
    parser.add_argument("--number", type=int, default=0, help="which performance")
    options = parser.parse_args()
    body = makehuman().fitted_to(MEAN.skeleton())
    tags = [(tag,) for tag in COUNTS] + [("stand", part) for part in PART_COUNTS]
    with TemporaryDirectory() as folder:
        rows = [row(performance(own, options.number), body, Path(folder)) for own in tags]
    lines = -(-len(rows) // COLUMNS)
    sheet = Image.new("RGB", (COLUMNS * WIDTH, lines * ROW), "white")
    for place, picture in enumerate(rows):
        sheet.paste(picture, (place // lines * WIDTH, place % lines * ROW))
    sheet.quantize(96, Image.Quantize.MEDIANCUT).save(options.output, optimize=True)


main()
