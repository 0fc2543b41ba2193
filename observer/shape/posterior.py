"""What the object is, from the whole stream of beliefs: the shape likelihood with the pose integrated out.

Shapes: H hypotheses, C labels, S pose samples, G parts of the hand, P patches, J joints. Lengths in metres.

A hypothesis is a solid: a shape of one size at one place. If it were there, a patch that feels contact would lie on
its surface and no link would lie inside it. The pose of the hand is only known as a Gaussian process. What is left
unknown of it may be taken for a tolerance of each link's place, at the mean pose: that is the default, cheap and good
for a filter that is nearly sure. Or, for raw angles say, each hypothesis has a particle filter of its own over the pose
(`samples`, `observer.shape.pose_samples`), with the solid as its known map; its evidence is its likelihood.

Fed with the belief of a good pose filter this is the ideal discriminator: it knows the candidates beforehand and
infers the pose and which one it is. Where size and place are unknown too, each candidate is many hypotheses
(`observer.shape.hypotheses`): so many at the mean pose say more than a few at many poses. "None of these" is a model of
touch without any object (`observer.shape.null_model`), there one of their like (`observer.shape.loose_fit`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from typing import Any

import numpy as np

from haptic_env import validate
from haptic_env.arrays import Array
from haptic_env.hand import Hand
from haptic_env.shapes.base import Solid
from haptic_env.shapes.names import NONE as NONE
from observer import edge, memory
from observer.belief import Belief
from observer.jacobians import link_stances
from observer.kinematics import placed, tree_of
from observer.novelty import LITTLE, LinkHistory, note, unmeasured_links
from observer.pose.seen import LaggedPose
from observer.shape import exponents, fading
from observer.shape.candidates import checked
from observer.shape.contact_likelihood import UNKNOWN, PoseSamples, TouchModel, contact_likelihood, weigh
from observer.shape.felt import Look
from observer.shape.hypotheses import Variants, far_of
from observer.shape.labels import Hypotheses, OfLabels
from observer.shape.loose_fit import LooseFit, null_for
from observer.shape.misfit import Misfit
from observer.shape.names import NamePosterior
from observer.shape.null_model import NullModel
from observer.shape.pose_samples import choose_again, propagated
from observer.shape.rejuvenation import Rejuvenation
from observer.shape.skin import skin_of
from observer.shape.subchains import parts_of

LOOSEST = 0.05  # m: tolerance with which distances are told apart as far as a table may reach
WIDEST = 0.005  # m: a link whose place is known no better says little, however badly it is known
MANY = 8  # labels, beyond which `repr` only counts them


class ShapePosterior:
    """Posterior over labels, updated by every belief of a trial, those of the flush included.

    Attributes:
        hand: that explores.
        labels: (C,) names, "none" the last.
        said: what its evidence came from, which is no news a second time.
        sustained: share of a touch that lasts which is news at last.
    """

    def __init__(
        self,
        hand: Hand,
        candidates: Mapping[str, Sequence[Solid]] | Sequence[str] | None = None,
        *,
        size_jitter: float = 0.0,
        yaw_jitter: float = 0.0,
        position_jitter: float = 0.0,
        rotation_jitter: float = 0.0,
        variants: int = 240,
        none: float = 0.0,
        samples: int = 1,
        tolerance: float = 0.001,
        press: float = 0.0,
        surprise: float = 0.001,
        temper: float | None = None,
        stride: int = 3,
        alike: float = 4.0,
        memory_seconds: float = np.inf,
        control_hz: float = 50.0,
    ) -> None:
        """Check the arguments, and start a trial.

        Args:
            hand: that explores.
            candidates: the solids that each label may be, equally probable; or names of shapes, each of default size
                at the grasp centre; None: the four shapes.
            size_jitter: what is not known of the solids, as the environment's keyword argument of the same name.
            yaw_jitter: likewise.
            position_jitter: likewise.
            rotation_jitter: likewise; only with one pose sample.
            variants: V, samples of what is not known, for each solid.
            none: prior probability of one label more, "none" of the candidates; 0: no such label.
            samples: S, of the pose; 1: its mean, and what is not known of it makes each link's tolerance wider.
            tolerance: m, SD of the gap between a patch that feels contact and the surface.
            press: m, how deep a link that feels contact may lie inside, as in recordings that were fitted to markers.
            surprise: probability of what the model cannot explain.
            temper: exponent of the evidence of a look; None: 0.15 for solids that are known exactly, 0.07 with jitter;
                any way 1, and less while a touch lasts (`observer.shape.exponents`), or 0.15 with `alike=0`.
            stride: only one step in so many is taken in.
            alike: looks of a link within so many times what is not known of its place share an exponent of one
                (`observer.novelty`), those of a touch that lasts likewise; 0: each counts as news.
            memory_seconds: s, time constant with which evidence for names fades (`observer.shape.fading`); inf: none.
            control_hz: Hz, of the beliefs.

        Raises:
            ValueError: for a value out of range.
        """
        edge.world(hand=hand)
        self.none = validate.number("none", none, 0.0, 0.99)
        candidates = checked(candidates, hand, self.none)
        self.hand = hand
        self.labels = (*candidates, *([NONE] if self.none else []))
        self.tolerance = validate.number("tolerance", tolerance, 0.0, LOOSEST, above=0.0, unit="m")
        self.press = validate.number("press", press, 0.0, unit="m")
        self.surprise = validate.number("surprise", surprise, 0.0, 1.0, above=0.0)
        self.samples = validate.integer("samples", samples, 1, edge.COUNT)
        self._skin, spread = skin_of(hand), WIDEST if self.samples == 1 else 0.0
        solids = [solid for several in candidates.values() for solid in several]
        self.variants = Variants(
            solids,
            variants,
            size_jitter=size_jitter,
            yaw_jitter=yaw_jitter,
            position_jitter=position_jitter,
            rotation_jitter=rotation_jitter,
            far=far_of(solids, size_jitter, self.tolerance, spread, self._skin.ball.max()),
        )
        needed = memory.of_hypotheses(hand.joints, self.variants.hypotheses, self.samples)
        memory.check(f"samples={self.samples}", needed)
        if self.variants.turns.most and self.samples > 1:
            raise ValueError(f"rotation_jitter above 0 needs samples=1, the mean pose, got samples={self.samples}")
        self.alike = validate.number("alike", alike, 0.0)
        self.temper, self._lasting = exponents.chosen(temper, self.variants, self.alike)
        self.stride = validate.integer("stride", stride, 1)
        self.memory_seconds = fading.check(memory_seconds)
        self.control_hz = validate.number("control_hz", control_hz, 1.0, 500.0, unit="Hz")
        self._of_labels = OfLabels([len(solids) for solids in candidates.values()], self.variants.count)
        self._tree = tree_of(hand)
        self._lengths = np.array([link.length for link in hand.links])
        self._parts = parts_of(hand)
        self.reset()

    def __repr__(self) -> str:
        told = ", ".join(f"{label} {p:.0%}" for label, p in zip(self.labels, self.posterior, strict=True))
        few = told if len(self.labels) <= MANY else f"{len(self.labels)} names"
        return f"<ShapePosterior of {self.hand.name}: {few}>"

    def reset(self, seed: int | None = None) -> Array:
        """Start a trial.

        Args:
            seed: of samples and variants.

        Returns:
            The prior of the labels (C,): all the same, but for "none".

        Raises:
            ValueError: for a seed that is none.
        """
        self._rng = np.random.default_rng(validate.seed(seed))
        self._units = self.variants.draw(self._rng)
        self._solids = self.variants.place(self._units)
        self._rejuvenation = Rejuvenation(self.variants, self._skin, self.temper)
        # Of each hypothesis: the share of its solid that it stands for times its likelihood.
        self._log_evidence = np.full(len(self._units), -np.log(self.variants.count))
        self._poses = np.tile(self.hand.rest_pose[self._parts.joint], (self.samples, 1)).astype(np.float64)
        self._weights = np.full((len(self._parts.column), len(self._units), self.samples), 1.0 / self.samples)
        self._likelihood = np.empty_like(self._weights)
        self.said = LinkHistory.nothing(self.hand)
        self._misfit = Misfit(len(self.hand.patches), self.surprise)  # a copy has one of its own
        self._news = np.ones(len(self._lengths))
        self._null = null_for(self.variants, self.hand, self.none, self.press)
        self._moved: Any = None  # how the pose moved since the samples did
        self._steps, self._passed, self._unfit = 0, 0, 0.0  # the steps that were told of, and all
        self.sustained = exponents.sustained(self.temper, self._lasting, self.stride / self.control_hz)
        weight = self.none, self._null.weight(self.temper * self.sustained, self.stride)
        self._names = NamePosterior(self.log_likelihood, *weight, 1.0 / self.control_hz, self.memory_seconds)
        return self.posterior

    @property
    def log_likelihood(self) -> Array:
        """(C,) log probability of what was felt so far under each of `labels`, with the exponent `temper`."""
        result = self._of_labels.log_likelihood(self._log_evidence)
        return np.append(result, self._null.evidence(result, self.temper)) if self.none else result

    @property
    def posterior(self) -> Array:
        """(C,) probability of each of `labels`; before anything was felt that of a candidate is the same for all."""
        return self._names.posterior

    @property
    def log_posterior(self) -> Array:
        """(C,) nats, the log of `posterior`, however improbable a name is."""
        return self._names.log_posterior

    @property
    def unexplained(self) -> float:
        """Share of all patches that the likeliest candidate does not explain, over the last `misfit.RECENT` steps that
        were taken in; about 0 where contacts fit. Above `misfit.TOO_MANY` `ContactsDoNotFit` warns, once a trial."""
        return self._misfit.share

    @property
    def hypotheses(self) -> Hypotheses:
        """Each solid, size and place that is held possible now, "none" left out; not to be changed."""
        return self._of_labels.hypotheses(self._solids, self._log_evidence)

    def update(self, belief: Belief) -> Array:
        """Take in what a belief felt at its lagged pose.

        Args:
            belief: of an observer.

        Returns:
            The posterior (C,).

        Raises:
            ValueError: for the belief of another hand, and for one that is not finite or beyond all angles; that
                changes nothing.
        """
        validate.instance("belief", belief, Belief, "a Belief, as an observer gives")
        if belief.transition is None or belief.lagged_contacts is None:
            self._passed += 1
            self._names.pass_by()
            return self.posterior
        told, self._unfit = edge.belief(self.hand, belief), belief.unfit or 0.0
        self._hear(told)
        return self.posterior

    def take(self, lagged: LaggedPose | None) -> None:
        """Take in what `PoseOnly.advance` tells of: with a single pose sample the same as `update` by its belief.

        Args:
            lagged: the pose, and what was felt there; None: nothing is told of.

        Raises:
            ValueError: for more samples, which have to be told how poses follow from each other.
        """
        if self.samples > 1:
            raise ValueError(f"take() needs samples=1, the mean pose, got samples={self.samples}; call update()")
        if lagged is None:
            self._passed += 1
            self._names.pass_by()
        else:
            self._hear(edge.Followed(lagged, lagged.covariance, lagged.contacts, None, lagged.unmeasured))

    def _hear(self, told: edge.Followed) -> None:
        now, covariance, contacts, root, unmeasured = told
        self._moved = now if self.samples == 1 or self._moved is None else self._moved.then(now)
        self._steps, self._passed = self._steps + 1, self._passed + 1
        if self._steps % self.stride:
            self._move()
            self._names.pass_by()
            return
        anew = self._steps == self.stride  # the first time nothing was known of the pose before
        self._poses = propagated(self._poses, self._weights, self._parts, self._moved, covariance, anew, self._rng)
        self._moved = None
        tree = placed(self._tree, root)
        near, *frames = link_stances(tree, self._lengths, now.mean, covariance, (self.tolerance, WIDEST))
        if self.alike:
            time = self._passed / self.control_hz, self._lasting
            note(self.said, tuple(frames), contacts, self.alike * near, self.temper, LITTLE, time, self._news)
        news = self._news if unmeasured is None else self._news * ~unmeasured_links(self.hand, unmeasured)
        model = TouchModel(near if self.samples == 1 else np.full_like(near, self.tolerance), self.press, self.surprise)
        before, touch = self._log_evidence.copy(), contacts.view(np.int8)
        if unmeasured is not None:
            touch = np.where(unmeasured, UNKNOWN, touch).astype(np.int8)
        felt = PoseSamples(self._poses, self._parts.column), touch, news, model
        if self.none and isinstance(self._null, NullModel):
            self._null.update(contacts, news[self.hand.patches.link], unmeasured)
        elif self.none and isinstance(self._null, LooseFit):
            self._null.take((tree, self._skin), self._solids, (self._weights, before), felt, self.temper)
        if self.variants.turns.most:
            self._rejuvenation.take(Look(frames[0], frames[1], touch, news, model), self._solids, self._log_evidence)
        else:
            contact_likelihood(tree, self._skin, self._solids, *felt, self._likelihood)
            weigh(self._weights, self._likelihood, self.temper, self._log_evidence)
        self._misfit.update(before, self._log_evidence, self.temper * max(float(news.mean()), self.sustained))
        self._follow()
        self._names.take(self.log_likelihood, self._unfit)

    def _follow(self) -> None:
        """Let samples and variants go where the evidence is."""
        if self.variants.turns.most:
            self._move(self._rejuvenation.resample(self._units, self._log_evidence, self._rng))
            return
        uniform = self._rng.random(len(self._weights))
        choose_again(self._poses, self._weights, self._parts, self._log_evidence, uniform)
        if (source := self.variants.move(self._units, self._log_evidence, self._rng)) is not None:
            self._weights = np.ascontiguousarray(self._weights[:, source])
            self._solids = self.variants.place(self._units)

    def _move(self, changed: Set[int] = frozenset()) -> None:
        """Let hypotheses that lie any way find what fits better; the variants of some solids have `changed` before."""
        if changed := changed | self._rejuvenation.move(self._units, self._log_evidence, self._rng):
            self._solids = self.variants.place_again(self._solids, self._units, np.array(sorted(changed)))
