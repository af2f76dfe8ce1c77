"""A person who performs: the words that actions are written in."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from motiongen.data.sources.builtin.curves import Array
from motiongen.data.sources.builtin.score import ARM, FPS, SIDES, TRUNK, Score
from motiongen.data.sources.builtin.subjects import Subject

Pose = Mapping[str, float]
"""Channels of trunk and arms in degrees, written for a right-handed person: `strong_` and `weak_` arms, and roll and
twist as if the strong side were the right one."""


class Actor:
    """A subject in a session. Time runs in seconds; every action starts at `time` and moves it on."""

    def __init__(self, subject: Subject, generator: np.random.Generator) -> None:
        self.subject = subject
        self.generator = generator
        self.time = 0.0
        self.floor = 0.0
        self.strong, self.weak = ("right", "left") if subject.right_handed else ("left", "right")
        self.idle = self._idle()
        start = dict(self.idle)
        heading = float(generator.uniform(-180, 180))
        start |= {"x": 0.0, "y": 0.0, "height": self.standing, "heading": heading}
        for side in SIDES:
            x, y = ground(np.zeros(2), heading, 0.0, self.outward(side) * subject.stance_width)
            start |= {f"{side}_foot_x": x, f"{side}_foot_y": y, f"{side}_foot_yaw": heading + self.toe_out(side)}
            start |= {f"{side}_foot_lift": 0.0, f"{side}_foot_pitch": 0.0, f"{side}_foot_knee": 4.0}
            start |= {f"{side}_foot_ground": 0.0}
        self.score = Score(start)

    @property
    def standing(self) -> float:
        """Height of the pelvis at rest, metres."""
        return self.subject.body.standing_height - self.subject.knee_bend + self.floor

    @property
    def heading(self) -> float:
        """Where the person will face when what is planned is done, degrees."""
        return self.score.last("heading")

    @property
    def place(self) -> Array:
        """Where the pelvis will be over the floor (2,)."""
        return np.array([self.score.last("x"), self.score.last("y")])

    def uniform(self, low: float, high: float) -> float:
        return float(self.generator.uniform(low, high))

    def chance(self, share: float) -> bool:
        return bool(self.generator.random() < share)

    def seconds(self, low: float, high: float) -> float:
        """A duration drawn between two bounds, shorter for quick people."""
        return self.uniform(low, high) / self.subject.tempo

    @staticmethod
    def outward(side: str) -> float:
        """Sign of `left` on which a side lies."""
        return 1.0 if side == "left" else -1.0

    def toe_out(self, side: str) -> float:
        return self.outward(side) * self.subject.toe_out

    def _idle(self) -> dict[str, float]:
        subject, generator = self.subject, self.generator
        pose = dict.fromkeys(TRUNK, 0.0)
        pose |= {"spine_pitch": subject.slouch, "head_pitch": subject.chin, "pelvis_pitch": -0.15 * subject.slouch}
        for side in SIDES:
            own = generator.normal(0.0, 1.0, 3)
            arm = dict.fromkeys(ARM, 0.0)
            arm |= {"flex": -2.0 + 0.5 * subject.slouch + 2.0 * own[0], "abduct": subject.arm_carry + own[1]}
            arm |= {"rotate": 12.0 + 3.0 * own[2], "elbow": subject.elbow_carry, "wrist": 4.0}
            pose |= {f"{side}_{name}": value for name, value in arm.items()}
        return pose

    def begin(self, settle: float = 0.5) -> None:
        """Start an action: hold what is at rest, and let trunk, arms and height return to rest in `settle` seconds."""
        self.score.hold(self.time)
        rest = self.time + settle / self.subject.tempo
        for channel, value in (*self.idle.items(), ("height", self.standing)):
            # What rests already gets no key, so that an action may start to move it at once.
            if abs(self.score.last(channel) - value) > 1e-6:
                self.score.key(rest, channel, value)

    def pose(self, time: float, pose: Pose, amount: float = 1.0) -> None:
        """Key trunk and arms; the distance from rest is scaled by the subject's amplitude and `amount`."""
        scale = self.subject.amplitude * amount
        for name, value in pose.items():
            role, _, rest = name.partition("_")
            side = {"strong": self.strong, "weak": self.weak}.get(role)
            channel = f"{side}_{rest}" if side else name
            lateral = channel in TRUNK and not channel.endswith("pitch")
            if lateral and not self.subject.right_handed:
                value = -value
            target = self.idle[channel] + scale * (value - self.idle[channel])
            if channel.endswith("elbow"):
                target = float(np.clip(target, 4.0, 140.0))
            self.score.key(time, channel, target)

    def relax(self, time: float) -> None:
        """Key trunk and arms at rest."""
        for channel, value in self.idle.items():
            self.score.key(time, channel, value)

    def foot(self, side: str) -> Array:
        """Where a foot will stand (2,)."""
        return np.array([self.score.last(f"{side}_foot_x"), self.score.last(f"{side}_foot_y")])

    def between_feet(self, weight: float = 0.0) -> Array:
        """A point (2,) over the line of the feet: 0 in the middle, +1 over the strong foot, -1 over the weak one."""
        strong, weak = self.foot(self.strong), self.foot(self.weak)
        return (strong + weak) / 2 + weight * (strong - weak) / 2

    def move(self, time: float, point: Array, forward: float = 0.0, height: float = 0.0) -> None:
        """Key the pelvis over a point of the floor, `forward` metres before it, `height` above standing."""
        x, y = ground(point, self.heading, forward, 0.0)
        self.score.key(time, "x", x)
        self.score.key(time, "y", y)
        self.score.key(time, "height", self.standing + height)

    def step(
        self,
        side: str,
        start: float,
        stop: float,
        target: Array,
        yaw: float,
        lift: float = 0.05,
        heel: float = 22.0,
    ) -> None:
        """Swing a foot from where it stands to a target (2,): heel off, clearance, flat landing."""
        foot = f"{side}_foot_"
        span = stop - start
        for name, value in (("x", target[0]), ("y", target[1]), ("yaw", yaw)):
            self.score.key(start + 0.08 * span, foot + name, self.score.last(foot + name))
            self.score.key(stop - 0.06 * span, foot + name, value)
        for share, height, pitch in (
            (-0.25, 0.0, 0.0), (0.05, 0.0, -heel), (0.5, lift, -0.5 * heel), (0.93, 0.01, 3.0), (1.0, 0.0, 0.0)
        ):  # fmt: skip
            self.score.key(start + share * span, foot + "lift", height)
            self.score.key(start + share * span, foot + "pitch", pitch)

    def stance(self, side: str, point: Array, heading: float) -> Array:
        """Where a foot stands (2,) when the pelvis rests over a point."""
        return np.array(ground(point, heading, 0.0, self.outward(side) * self.subject.stance_width))

    def square_up(self, tolerance: float = 0.13) -> None:
        """Bring the feet under the body where they stand too far apart, and move `time` on."""
        middle = self.between_feet()
        far = [
            side
            for side in SIDES
            if np.linalg.norm(self.foot(side) - self.stance(side, middle, self.heading)) > tolerance
        ]
        if not far:
            return
        # One foot is enough: it comes to stand beside the other.
        side = far[0] if len(far) == 1 else self.rear()
        other = "right" if side == "left" else "left"
        across = 2 * self.outward(side) * self.subject.stance_width
        target = np.array(ground(self.foot(other), self.heading, 0.0, across))
        span = self.seconds(0.42, 0.52)
        support = self.foot(other)
        self.move(self.time + 0.35 * span, 0.65 * support + 0.35 * middle, height=-0.012)
        self.step(side, self.time + 0.2 * span, self.time + 1.1 * span, target, self.heading + self.toe_out(side))
        self.time += 1.2 * span
        self.move(self.time, self.between_feet())

    def rear(self) -> str:
        """The side whose foot stands further back."""
        ahead = np.array(ground(np.zeros(2), self.heading, 1.0, 0.0))
        return min(SIDES, key=lambda side: float(self.foot(side) @ ahead))

    @property
    def frame(self) -> int:
        return round(self.time * FPS)


def ground(origin: Array, heading: float, forward: float, left: float) -> tuple[float, float]:
    """A point of the floor seen from another one; heading in degrees, 0 faces -y, positive turns left."""
    angle = np.deg2rad(heading)
    x = origin[0] + forward * np.sin(angle) + left * np.cos(angle)
    y = origin[1] - forward * np.cos(angle) + left * np.sin(angle)
    return float(x), float(y)
