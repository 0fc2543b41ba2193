"""Solids whose size and place are not known exactly: samples of what they may be, moved as the evidence comes in.

Shapes: K solids, V variants of each, H = K·V hypotheses, solid k having those from k·V on. Lengths in metres.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from haptic_env import rotation, validate
from haptic_env.arrays import Array
from haptic_env.shapes.base import Solid
from observer import edge, memory, resampling
from observer.gaussian import lower_factor
from observer.shape.contact_likelihood import CLEAR
from observer.shape.distance_fields import Solids, farthest, solids_of
from observer.shape.drawn_fields import FIELD_RESOLUTION
from observer.shape.registration import Ranges
from observer.shape.symmetry import symmetries
from observer.shape.turns import Turns

MOST_JITTER = 0.5  # of the size
RANGES = 5  # size, yaw and three of position, each in units of its range
SHRINK = 0.97  # Liu & West's a: a moved variant lies this far from the mean of all, plus noise that restores the spread


def far_of(solids: Sequence[Solid], size_jitter: float, tolerance: float, spread: float, ball: float) -> float:
    """Tell how far the tables of `Variants` have to reach.

    Args:
        solids: what the object may be.
        size_jitter: as of `Variants`.
        tolerance: m, SD of a gap.
        spread: m, to which the place of a link is known.
        ball: m, radius about the largest link.

    Returns:
        `far`, m.

    Raises:
        ValueError: where no table is so large, and for a jitter out of range.
    """
    size = validate.number("size_jitter", size_jitter, 0.0, MOST_JITTER)
    near = ball + FIELD_RESOLUTION
    far, most = near + CLEAR * np.hypot(tolerance, spread), (1.0 - size) * farthest(solids)
    if far <= most:
        return float(far)
    sizes = [extent for solid in solids for extent in solid.size]
    why = f"for size_jitter={size:g} and candidates with extents of {min(sizes):g} to {max(sizes):g} m"
    widest = (most - near) / CLEAR
    if widest <= spread:
        raise ValueError(f"candidates of one shape must differ less in size: no tolerance is possible {why}")
    valid = np.floor(1e4 * np.sqrt(widest**2 - spread**2)) / 1e4
    raise ValueError(f"tolerance must be at most {valid:g} m {why}, got {tolerance:g}")


class Variants:
    """Every solid as V samples of size, turn and offset, uniform in their ranges.

    Attributes:
        ranges: (5,) of size (fraction), yaw (rad) and place (m), plus or minus.
        turns: about any axis.
        unknown: whether any is not 0.
        count: V; 1 where all is known.
        hypotheses: H.
        nominal: tables of the K solids as they were told.
        alike: of each solid, (G, 4) turns in the world by which it looks the same; none where it is not turned.
    """

    def __init__(
        self,
        solids: Sequence[Solid],
        variants: int,
        *,
        size_jitter: float,
        yaw_jitter: float,
        position_jitter: float,
        far: float,
        rotation_jitter: float = 0.0,
    ) -> None:
        """Check the ranges, which are the environment's keyword arguments of the same names.

        Args:
            solids: K of them.
            variants: V.
            size_jitter: of the whole size, a fraction.
            yaw_jitter: degrees about the vertical.
            position_jitter: m, of each coordinate of the place.
            far: m, as of `solids_of`.
            rotation_jitter: degrees, of a turn about any axis.

        Raises:
            ValueError: for a value out of range.
        """
        size = validate.number("size_jitter", size_jitter, 0.0, MOST_JITTER)
        yaw = validate.number("yaw_jitter", yaw_jitter, 0.0, 180.0, unit="degrees")
        offset = validate.number("position_jitter", position_jitter, 0.0, 0.05, unit="m")
        self.ranges = np.array([size, np.deg2rad(yaw), offset, offset, offset])
        self.turns = Turns(rotation.jitter(rotation_jitter, yaw))
        count = validate.integer("variants", variants, 1, edge.COUNT)
        self.unknown = bool(self.ranges.any() or self.turns.most)
        self.count = count if self.unknown else 1
        self.hypotheses = self.count * len(solids)
        memory.check(f"variants={self.count} of {len(solids)} solids", memory.of_hypotheses(1, self.hypotheses, 1))
        self.nominal = solids_of(solids, far / (1.0 - size))
        self.alike = [self._alike(solid) for solid in range(len(solids))] if self.turns.most else []
        self._radius = np.array([0.5 * float(np.linalg.norm(solid.size)) for solid in solids])
        self._solid_of = np.repeat(np.arange(len(solids)), self.count)

    def _alike(self, solid: int) -> Array:
        """(G, 4), turns by which a solid looks the same, before it is turned."""
        usual = Rotation.from_matrix(self.nominal.rotation[solid])
        return np.asarray((usual * Rotation.from_quat(symmetries(self.nominal, solid)) * usual.inv()).as_quat())

    def draw(self, rng: np.random.Generator) -> Array:
        """Draw what is not known.

        Args:
            rng: draws.

        Returns:
            (H, 5) in [-1, 1], the unknowns of each hypothesis in units of their ranges; 0 where all is known. (H, 9)
            where the turn is not known either: a quaternion xyzw besides.
        """
        units = np.zeros((self.hypotheses, RANGES))
        units = rng.uniform(-1.0, 1.0, units.shape) if self.unknown else units
        if not self.turns.most:
            return units
        return np.concatenate([units, self.turns.draw(len(units), rng)], axis=1)

    def place(self, units: Array, which: NDArray[np.int64] | None = None) -> Solids:
        """Make the solids of what was drawn.

        Args:
            units: (H, 5) or (H, 9) as of `draw`.
            which: hypotheses they are of, (H,); None: all.

        Returns:
            The tables.
        """
        size, yaw, *offset = (units[:, :RANGES] * self.ranges).T
        if self.turns.most:
            turn = Rotation.from_quat(units[:, RANGES:]).as_matrix()
        else:
            turn = np.zeros((len(units), 3, 3))
            turn[:, 0, 0] = turn[:, 1, 1] = np.cos(yaw)
            turn[:, 1, 0] = np.sin(yaw)
            turn[:, 0, 1] = -turn[:, 1, 0]
            turn[:, 2, 2] = 1.0
        nominal = self.nominal
        of = self._solid_of if which is None else self._solid_of[which]
        return nominal._replace(
            drawn_in=nominal.drawn_in[of],
            scale=nominal.scale[of] * (1.0 + size),
            rotation=turn @ nominal.rotation[of],
            position=nominal.position[of] + np.stack(offset, axis=1),
        )

    def place_again(self, solids: Solids, units: Array, changed: NDArray[np.int64]) -> Solids:
        """Make the solids of what was drawn where some of it has changed.

        Args:
            solids: H as they were; left as they are.
            units: (H, 9) as of `draw`.
            changed: (K,) which of the K solids' variants have.

        Returns:
            The tables.
        """
        which = (changed[:, None] * self.count + np.arange(self.count)).ravel()
        anew = self.place(units[which], which)
        scale, rotation, position = solids.scale.copy(), solids.rotation.copy(), solids.position.copy()
        scale[which], rotation[which], position[which] = anew.scale, anew.rotation, anew.position
        return solids._replace(scale=scale, rotation=rotation, position=position)

    def balls(self) -> tuple[Array, Array]:
        """Find what no variant reaches out of.

        Returns:
            The middles (K, 3) m and radii (K,) m of a ball for each solid.
        """
        size, _, *offset = self.ranges
        return self.nominal.position, (1.0 + size) * self._radius + float(np.linalg.norm(offset))

    def bounds(self, solid: int) -> Ranges:
        """Tell what a solid may be.

        Args:
            solid: index.

        Returns:
            Its ranges.
        """
        scale, middle = self.nominal.scale[solid], self.nominal.position[solid]
        size, offset = self.ranges[0], self.ranges[2:]
        return Ranges((scale * (1 - size), scale * (1 + size)), middle - offset, middle + offset, bool(self.turns.most))

    def units_of(self, solids: Solids, solid: int) -> Array:
        """Tell how hypotheses differ from a solid: the inverse of `place`, for any turn.

        Args:
            solids: M hypotheses.
            solid: index, of which they are variants.

        Returns:
            (M, 9) as of `draw`.
        """
        nominal, known = self.nominal, np.maximum(self.ranges, np.finfo(float).tiny)
        units = np.zeros((len(solids.scale), RANGES + 4))
        units[:, 0] = (solids.scale / nominal.scale[solid] - 1.0) / known[0]
        units[:, 2:RANGES] = (solids.position - nominal.position[solid]) / known[2:]
        units[:, RANGES:] = Rotation.from_matrix(solids.rotation @ nominal.rotation[solid].T).as_quat()
        return np.where(np.append(self.ranges == 0.0, [False] * 4), 0.0, units)

    def resampled(
        self,
        log_evidence: Array,
        rng: np.random.Generator,
        awake: NDArray[np.int64] | None = None,
        wanted: NDArray[np.int64] | None = None,
    ) -> Iterator[tuple[int, Array, NDArray[np.int64]]]:
        """Resample the variants of each solid of which fewer than half are effective, or not as many as wanted.

        Args:
            log_evidence: (H,), made alike among a solid's variants, their sum staying; -inf behind as many as wanted.
            rng: draws.
            awake: (K,) how many of each solid's variants, the first ones, there are; None: all V.
            wanted: (K,) how many there are to be; None: all V.

        Yields:
            Each solid that has changed, the weights that its variants had, and which hypotheses they are copies of.
        """
        every = np.full(self.hypotheses // self.count, self.count)
        awake, wanted = every if awake is None else awake, every if wanted is None else wanted
        effective = np.empty(len(every))
        resampling.effective_of_groups(log_evidence, self.count, awake, effective)
        for solid, (now, then) in enumerate(zip(awake, wanted, strict=True)):
            if now != then or effective[solid] < 0.5 * now:
                first = solid * self.count
                mine = slice(first, first + now)
                total = np.logaddexp.reduce(log_evidence[mine])
                weights = np.exp(log_evidence[mine] - total)
                log_evidence[first : first + self.count] = -np.inf
                log_evidence[first : first + then] = total - np.log(then)
                copies = resampling.systematic_counts(weights, rng.random(), then)
                yield solid, weights, first + np.arange(now).repeat(copies)

    def move(self, units: Array, log_evidence: Array, rng: np.random.Generator) -> NDArray[np.int64] | None:
        """Resample and move the variants of each solid of which fewer than half are effective.

        Their mean and covariance stay what they were (Liu & West 2001, in Sequential Monte Carlo Methods in Practice,
        ch. 10).

        Args:
            units: (H, 5), changed.
            log_evidence: (H,), changed; the sum over a solid's variants stays.
            rng: draws.

        Returns:
            Which hypothesis each one comes from (H,); None where none has moved.
        """
        if self.count == 1:
            return None
        source = None
        for solid, weights, kept in self.resampled(log_evidence, rng):
            source = np.arange(len(units)) if source is None else source
            mine = slice(solid * self.count, (solid + 1) * self.count)
            mean = weights @ units[mine]
            apart = units[mine] - mean
            spread = lower_factor((weights[:, None] * apart).T @ apart)
            noise = rng.standard_normal(apart.shape) @ spread.T
            moved = mean + SHRINK * apart[kept - mine.start] + np.sqrt(1.0 - SHRINK**2) * noise
            units[mine] = reflected(moved)
            source[mine] = kept
        return None if source is None or np.array_equal(source, np.arange(len(units))) else source


def reflected(units: Array) -> Array:
    """Turn back at the ends of the range what has left it.

    Args:
        units: of any shape.

    Returns:
        The same in [-1, 1].
    """
    return np.abs((units + 3.0) % 4.0 - 2.0) - 1.0
