"""Distributions that codes are drawn from when there is no motion to look at."""

from __future__ import annotations

from motiongen.contracts import Condition, Posterior


def standard_normal(condition: Condition, width: int) -> Posterior:
    """N(0, I) over codes (B, width), the prior of encoders that look at the motion (ACTOR, section 3.2)."""
    zeros = condition.tags.new_zeros(len(condition.tags), width)
    return Posterior(mean=zeros, log_variance=zeros)
