"""Samples of the pose, moved on from step to step, and chosen again: a particle filter for each hypothesis.

Shapes: H hypotheses, S samples, J joints, G parts of the hand, C columns of these. Angles in radians.

Two things make so many filters cheap. Fingers err independently, so each part of the hand is weighted and resampled
apart (`observer.shape.subchains`). And hypotheses differ little in what pose they make probable, so that all have the
same samples, each hypothesis with weights of its own; they are resampled from the mixture of all.
"""

from __future__ import annotations

import numpy as np

from haptic_env.arrays import Array
from observer.belief import Transition
from observer.gaussian import lower_factor
from observer.pose.seen import LaggedPose
from observer.shape.contact_likelihood import resample
from observer.shape.subchains import Subchains

FRESH_SHARE = 8  # one sample in so many is drawn afresh at every step taken in
FLATTEN = 0.5  # exponent of the posterior by which hypotheses share the samples: losers keep some


def propagated(
    poses: Array,
    weights: Array,
    parts: Subchains,
    transition: Transition | LaggedPose,
    covariance: Array,
    anew: bool,
    rng: np.random.Generator,
) -> Array:
    """Move samples and weights on; a single sample is the mean.

    Args:
        poses: (S, C) rad, changed.
        weights: (G, H, S), changed: those of samples that start anew.
        parts: of the hand.
        transition: of the pose; of a single sample its mean is enough.
        covariance: (J, J) rad² of it now.
        anew: whether all start anew, from that.
        rng: all that is left to chance.

    Returns:
        (S, C) rad.
    """
    samples = len(poses)
    if samples == 1:
        poses[0] = transition.mean[parts.joint]
        return poses
    assert isinstance(transition, Transition)
    fresh = samples if anew else max(1, samples // FRESH_SHARE)
    moved = moved_on(poses, parts, transition, covariance, fresh, rng)
    weights[:, :, :fresh] = 1.0 / samples
    weights /= weights.sum(axis=-1, keepdims=True)
    return moved


def moved_on(
    poses: Array, parts: Subchains, transition: Transition, covariance: Array, fresh: int, rng: np.random.Generator
) -> Array:
    """Move samples on; some start anew, so that none are stuck where they once were.

    Args:
        poses: (S, C) rad.
        parts: of the hand.
        transition: of the pose.
        covariance: (J, J) rad² of it now.
        fresh: how many start anew from that.
        rng: all that is left to chance.

    Returns:
        (S, C) rad, those that start anew first.
    """
    mean, follow, before, rest = transition
    joint = parts.joint
    normals = rng.standard_normal((len(poses), len(mean)))
    noise = normals @ lower_factor(rest).T
    result = mean[joint] + (poses - before[joint]) @ parts.follow(follow).T + noise[:, joint]
    result[:fresh] = (mean + normals[:fresh] @ lower_factor(covariance).T)[:, joint]
    # Whatever a belief says of how it moved: no kernel looks at a place that is no number.
    return np.where(np.isfinite(result), result, mean[joint])


def choose_again(poses: Array, weights: Array, parts: Subchains, log_evidence: Array, uniform: Array) -> None:
    """Resample, so that samples are where hypotheses that are probable have them; of a single one nothing is chosen.

    Args:
        poses: (S, C) rad, changed.
        weights: (G, H, S), changed.
        parts: of the hand.
        log_evidence: (H,) of the hypotheses.
        uniform: (G,) random numbers.
    """
    if len(poses) > 1:
        share = np.exp(FLATTEN * (log_evidence - log_evidence.max()))
        resample(weights, share / share.sum(), poses, parts.part, uniform)
