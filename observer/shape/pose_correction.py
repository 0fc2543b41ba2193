"""What contacts say of the pose where the object is one of a few solids.

Shapes: H hypotheses, F steps, J joints, L links, P patches.

If the object were a certain solid, a link that feels contact would lie on its surface, or as deep inside as hands are
said to sink, and no silent link inside: the gap between the surface and the nearest spot of a link's skin has bounds.
Where it is linear in the angles, the Gaussian of the pose is conditioned on one link after the other by matching
moments (assumed density filtering: Minka 2001, UAI, 362-369). Errors of the pose last for several steps: links that
begin or cease to touch a little earlier or later tell of it too. What is not known of the place of skin and surface
lasts as well, so that no look gets rid of it. What the solid is, only a `ShapePosterior` knows; over it the pose is
averaged, and its model of touch is the one used here.

It may be none of the solids. That is told by how far they pull the pose; but a touch that a solid cannot explain is let
go of, and pulls at nothing. So it is told as well by how probable the contacts of a step are, given what was felt up to
it and that it is one of them, against a model of touch without any object, which learns as it goes (prequential
evidence: Dawid 1984, Journal of the Royal Statistical Society A 147(2), 278-292). That they fit in one way is no excuse
for the other: the set is doubted as far as either tells.
"""

from __future__ import annotations

import copy
from collections.abc import Iterable
from dataclasses import replace
from itertools import islice
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit, logit

from haptic_env import validate
from haptic_env.arrays import Array
from haptic_env.hand import Hand
from haptic_env.moved import renamed
from haptic_env.pose import Pose
from observer.belief import Belief
from observer.gaussian import mixture
from observer.kinematics import placed, tree_of
from observer.novelty import unmeasured_links
from observer.pose.source import PoseSource
from observer.shape.contact_likelihood import TouchModel
from observer.shape.null_model import NullModel
from observer.shape.posterior import ShapePosterior
from observer.shape.skin import skin_of
from observer.shape.surface_conditioning import take_in

__getattr__ = renamed(__name__, {"KnownSolids": "PoseCorrection"})

# Contacts (P,) of a step, where the hand as a whole was, and the patches (P,) whose contact was not measured.
StepContacts = tuple[NDArray[np.bool_], Pose | None, NDArray[np.bool_] | None]
UNMEASURED = -1
AFTER = 0.06  # s: contacts up to so much later are taken in
PULL = 25.0  # times as large as they should be are squared shifts by solids that are not there
LASTING = 0.15  # share of a step that is news: errors of the pose last
LASTS = 0.9  # share of the variance of a gap's tolerance that is the same from step to step
MOST = 6.0  # log odds: a set that fitted so far is never past all doubt
UNLIKELY = 0.02  # hypotheses less probable than this share of the best one are left out


def reach(control_hz: float) -> int:
    """Tell how far apart the steps are of which a correction looks at the pose.

    Args:
        control_hz: steps a second.

    Returns:
        Steps, from the one before the lagged one to the last one that has a say.
    """
    return 1 + round(AFTER * control_hz)


class PoseCorrection:
    """Corrects the lagged pose of beliefs by what was felt, for the solids that the object may be.

    It stands in place of what the maps say of that pose. Maps and naming know nothing of it: neither is to confirm what
    it has said itself.
    """

    def __init__(self, shape: ShapePosterior, control_hz: float, hand: Hand) -> None:
        """Take a copy of what names the object, from the beliefs as they come.

        Args:
            shape: what the object may be.
            control_hz: steps a second.
            hand: of the beliefs.

        Raises:
            ValueError: where it is no `ShapePosterior`, or one of another hand.
        """
        validate.instance("solids", shape, ShapePosterior, "a ShapePosterior of what the object may be")
        if shape.hand.joint_names != hand.joint_names or len(shape.hand.patches) != len(hand.patches):
            raise ValueError(f"solids must be told of hand {hand.name!r}, got those of {shape.hand.name!r}")
        self.hand = shape.hand
        self.shape = copy.copy(shape)
        self.after = reach(control_hz) - 1
        self._tree = tree_of(self.hand)
        self._skin = skin_of(self.hand)
        self._model = TouchModel(self.shape.tolerance, self.shape.press, self.shape.surprise)
        self._anew = self._model._replace(tolerance=np.sqrt(1.0 - LASTS) * self.shape.tolerance)
        self._link = np.arange(len(self.hand.links))[:, None] == self.hand.patches.link  # (L, P)

    def reset(self, seed: int | None = None) -> None:
        """Start a trial.

        Args:
            seed: of the copy.
        """
        self.shape.reset(seed)
        self._before: list[StepContacts] = []
        self._against = 0.0  # log odds of what the pull has told against all solids
        self._missed = 0.0  # the same of contacts that they do not explain
        self._without = NullModel(len(self.hand.links), NullModel.LINK_BEGINS)
        self._touching = np.zeros(len(self.hand.links), dtype=bool)

    @property
    def certain(self) -> bool:
        """Whether there is but one solid that it may be, and it is that."""
        return len(self.shape.hypotheses.log_probability) == 1 and self.shape.none == 0.0

    def teach(self, pose: PoseSource, felt: StepContacts) -> None:
        """Let what is felt now tell a pose for good, and so the offsets of its angles, where the solid is certain: what
        is named from such poses would confirm itself.

        Args:
            pose: its Gaussian is changed, where it learns.
            felt: contacts (P,), where the hand as a whole is, and the patches (P,) that were not measured.
        """
        if not (self.certain and pose.learns):
            return
        contacts, root, unmeasured = felt
        touches = self._link[:, contacts].any(axis=1)
        begun, self._touching = touches & ~self._touching, touches
        if not begun.any():  # a touch that lasts is no news
            return
        solids, told = self.shape.hypotheses.solids, self._told(contacts, unmeasured)
        gaussian = pose.mean, pose.covariance
        take_in(placed(self._tree, root), self._skin, solids, 0, told, gaussian, (0, -1), self._model)

    def _told(self, contacts: NDArray[np.bool_], unmeasured: NDArray[np.bool_] | None) -> NDArray[Any]:
        """(L,) whether each link feels contact, or `UNMEASURED`: of whose skin nothing was measured."""
        touches = self._link[:, contacts].any(axis=1)
        if unmeasured is None:
            return touches
        return np.where(unmeasured_links(self.hand, unmeasured), UNMEASURED, touches).astype(np.int8)

    def correct(self, belief: Belief, pose: PoseSource, felt: Iterable[StepContacts]) -> Belief:
        """Correct the lagged pose of a belief.

        Args:
            belief: of an observer.
            pose: its Gaussian over the pose.
            felt: the lagged step and later ones: contacts (P,), where the hand as a whole was, and the patches (P,)
                that were not measured.

        Returns:
            The belief with its lagged pose as contacts leave it.
        """
        believed = self.shape.hypotheses.log_probability
        self.shape.update(belief)
        if self.certain and pose.learns:
            return belief
        steps = [*self._before, *islice(felt, 1 + self.after)]
        now = len(self._before)
        self._before = steps[now : now + 1]
        where = np.r_[tuple(pose.lagged(belief.lag_steps + now - k) for k in range(len(steps)))]
        hypotheses = self.shape.hypotheses
        log = hypotheses.log_probability
        likely = np.flatnonzero(log > log.max() + np.log(UNLIKELY))
        gaussian = self._with_what_lasts(pose.mean[where], pose.covariance[np.ix_(where, where)])
        means, covariances = (np.repeat(each[None], len(likely), axis=0) for each in gaussian)
        joints, told = self.hand.joints, np.zeros(len(likely))
        for k, (contacts, root, unmeasured) in enumerate(steps):
            tree, touches, at = placed(self._tree, root), self._told(contacts, unmeasured), (k * joints, len(where))
            for i, (h, mean, covariance) in enumerate(zip(likely, means, covariances, strict=True)):
                log_p = take_in(tree, self._skin, hypotheses.solids, h, touches, (mean, covariance), at, self._anew)
                if k == now:
                    told[i] = log_p
        weights = np.exp(log[likely] - np.logaddexp.reduce(log[likely]))
        lagged = slice(now * joints, (now + 1) * joints)
        means, covariances, unfit = means[:, lagged], covariances[:, lagged, lagged], None
        if self.shape.none:  # it may be none of them, and then contacts tell nothing of the pose
            then = pose.lagged(belief.lag_steps)
            before = pose.mean[then], pose.covariance[then, then]
            contacts, _, unmeasured = steps[now]
            by_solids = float(np.logaddexp.reduce(believed[likely] + told))
            missed = self._missing(by_solids, self._told(contacts, unmeasured))
            unfit = max(missed, self._doubt(weights, means, covariances, *before))
            weights = np.append((1.0 - unfit) * weights, unfit)
            means, covariances = (
                np.append(a, b[None], axis=0) for a, b in zip((means, covariances), before, strict=True)
            )
        mean, covariance = mixture(weights[None], means[None], covariances[None])
        std = np.sqrt(np.diag(covariance[0]))
        return replace(belief, lagged_joint_angles=mean[0], lagged_joint_std=std, unfit=unfit)

    def _with_what_lasts(self, mean: Array, covariance: Array) -> tuple[Array, Array]:
        """Add to a Gaussian how much larger the gap of each link is than it is drawn to be.

        Args:
            mean: (n,) rad.
            covariance: (n, n) rad².

        Returns:
            Both with L numbers of metres more.
        """
        angles, links = len(mean), len(self.hand.links)
        square = np.zeros((angles + links, angles + links))
        square[:angles, :angles] = covariance
        np.fill_diagonal(square[angles:, angles:], LASTS * self.shape.tolerance**2)
        return np.append(mean, np.zeros(links)), square

    def _missing(self, told: float, touches: NDArray[Any]) -> float:
        """Weigh whether the object is one of the solids, by how well they tell the contacts of a step.

        Args:
            told: log probability of them, by the solids.
            touches: (L,) as `_told` says.

        Returns:
            The probability that it is none of them.
        """
        before = self._without.log_likelihood
        self._without.update(touches == 1, unmeasured=touches == UNMEASURED)
        ratio = self._without.log_likelihood - before - told
        self._missed = float(np.clip(self._missed + LASTING * ratio, -MOST, MOST))
        return float(expit(logit(self.shape.none) + self._missed))

    def _doubt(self, weights: Array, means: Array, covariances: Array, mean: Array, covariance: Array) -> float:
        """Weigh whether the object is one of the solids, by how far they pull the pose.

        What tells of the pose moves it, on average, as far as it makes it surer: the squared shift is what the variance
        loses. Solids that are not there move it further. Both have a likelihood, of shifts as large as that, and of
        ones whose square is `PULL` times as large.

        Args:
            weights: (H,) of the hypotheses.
            means: (H, J) rad, of the pose given each.
            covariances: (H, J, J) rad².
            mean: (J,) rad, of the pose given none.
            covariance: (J, J) rad².

        Returns:
            The probability that it is none of them.
        """
        variance = np.diag(covariance)
        shift = ((means - mean) ** 2 / variance).sum(axis=1)
        surer = (1.0 - np.diagonal(covariances, axis1=1, axis2=2) / variance).sum(axis=1)
        ratio = 0.5 * (shift * (1.0 - 1.0 / PULL) - surer * np.log(PULL))
        self._against = float(np.clip(self._against + LASTING * weights @ ratio, -MOST, MOST))
        return float(expit(logit(self.shape.none) + self._against))
