"""Whether a state that was read fits the observer that takes it up: kernels look nothing up outside their arrays.

Shapes: N particles, J joints, P patches, L links, B bodies, V voxels, T slots, E errors of the angles, W steps of a
window, M looks.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from haptic_env.pose import Pose
from observer.maps.hindsight import Moment
from observer.maps.occupancy import Maps
from observer.novelty import LinkHistory
from observer.pose.kalman import PoseFilter
from observer.pose.lagged_moments import LaggedMoments
from observer.pose.smooth_motion import KinematicPose
from observer.state import Waiting

if TYPE_CHECKING:
    from observer.configuration import Configured

Shape = tuple[int, ...]
BOOL, REAL, BYTE = np.dtype(np.bool_), np.dtype(np.float64), np.dtype(np.int8)
SLOT, WHOLE = np.dtype(np.int32), np.dtype(np.int64)


def array(name: str, given: Any, kind: np.dtype[Any], shape: Shape, *, finite: bool = True) -> None:
    """Check an array.

    Args:
        name: of it, for messages.
        given: that was read.
        kind: of its numbers.
        shape: of it.
        finite: whether all must be.

    Raises:
        ValueError: for anything else.
    """
    if type(given) is not np.ndarray or given.dtype != kind or given.shape != shape:
        got = f"{given.dtype} {given.shape}" if isinstance(given, np.ndarray) else type(given).__name__
        raise ValueError(f"{name} must be {kind} {shape}, got {got}")
    if kind == REAL and finite and not np.isfinite(given).all():
        raise ValueError(f"{name} has numbers that are not finite")


def number(name: str, given: Any) -> None:
    """Check a number.

    Args:
        name: of it, for messages.
        given: that was read.

    Raises:
        ValueError: for anything else.
    """
    if type(given) not in (int, float):
        raise ValueError(f"{name} must be a number, got {type(given).__name__}")


def _within(name: str, given: Any, low: int, high: int) -> None:
    if len(given) and not (given.min() >= low and given.max() < high):
        raise ValueError(f"{name} must be indices from {low} to {high - 1}, got {given.min()} to {given.max()}")


def maps(given: Maps) -> None:
    """Check the maps of particles, of which N and V are those of an observer.

    Args:
        given: the maps, whose `arrays` are not those that were read yet.

    Raises:
        ValueError: for arrays that do not fit together.
    """
    count, particles = int(np.prod(given._shape)), len(given.arrays.own)
    for name, kind in (("common", BYTE), ("slot", SLOT), ("_told", BYTE)):
        array(f"maps.{name}", getattr(given, name), kind, (count,))
    for name in ("touched", "solid", "seen", "stale"):
        array(f"maps.{name}", getattr(given, name), BOOL, (count,))
    array("maps._mean", given._mean, REAL, tuple(given._shape.tolist()))
    room, used = len(given._kept), len(given.cells)
    array("maps._kept", given._kept, WHOLE, (room,))
    array("maps.cells", given.cells, WHOLE, (used,))
    array("maps.own", given.own, BYTE, (particles, room))
    if not np.array_equal(given.cells, given._kept[:used]):
        raise ValueError("maps.cells are not the first of maps._kept")
    _within("maps._kept", given._kept, 0, count)
    _within("maps.slot", given.slot, -1, max(used, 1))


def check(made: Configured) -> None:
    """Check the state of an observer.

    Args:
        made: the observer, its state having been read.

    Raises:
        ValueError: for what does not fit its hand and keywords.
    """
    _pose(made.pose)
    patches = len(made.hand.patches)
    if made._reports is not None:
        window = made._reports
        steps = len(window._contacts)
        for name in ("_start", "_first", "_last"):
            array(f"reports.{name}", getattr(window, name), REAL, window._model.prior.shape)
        array("reports._contacts", window._contacts, BOOL, (steps, patches))
        array("reports._apart", window._apart, REAL, (steps, patches))
        array("reports._touched", window._touched, REAL, (steps, patches))
        if steps > made.lag + 1:
            raise ValueError(f"reports must be of {made.lag + 1} steps at most, got {steps}")
    if made._state is not None:
        _trial(made)
        if made._known is not None:
            _known(made)


def history(name: str, said: Any, fresh: LinkHistory) -> None:
    """Check what links have said.

    Args:
        name: of it, for messages.
        said: that was read.
        fresh: of the same hand.

    Raises:
        ValueError: for what is of other links.
    """
    record(name, said, LinkHistory)
    for field, mine in fresh._asdict().items():
        array(f"{name}.{field}", getattr(said, field), mine.dtype, mine.shape)
    if (said.looks < 0).any() or not np.array_equal(said.first_patch, fresh.first_patch):
        raise ValueError(f"{name} is of other links")


def _waiting(name: str, step: Any, patches: int) -> None:
    record(name, step, Waiting)
    array(name, step.contacts, BOOL, (patches,))
    if step.root is not None:
        record(name, step.root, Pose)
    if step.unmeasured is not None:
        array(name, step.unmeasured, BOOL, (patches,))


def null_model(name: str, given: Any, parts: int) -> None:
    """Check what was learned of touch without any object.

    Args:
        name: of it, for messages.
        given: the `NullModel` that was read.
        parts: how many patches, or links, it is of.

    Raises:
        ValueError: for what does not fit.
    """
    number(f"{name}.log_likelihood", given.log_likelihood)
    array(f"{name}._felt", given._felt, BOOL, (parts,))
    array(f"{name}._counts", given._counts, REAL, (2, 2))
    changed, among = given._counts.T
    if not ((changed > 0.0) & (changed < among)).all():
        raise ValueError(f"{name}._counts must each be more than 0, and fewer than those they are among")


def _known(made: Any) -> None:
    """What corrects the pose by solids; what these are like now was checked as it was read."""
    known, patches, links = made._known, len(made.hand.patches), len(made.hand.links)
    number("known._against", known._against)
    number("known._missed", known._missed)
    array("known._touching", known._touching, BOOL, (links,))
    null_model("known._without", known._without, links)
    if not isinstance(known._before, list) or len(known._before) > 1:
        raise ValueError("known._before must be one step at most")
    for step in known._before:
        _waiting("known._before", step, patches)


def _pose(pose: Any) -> None:
    joints, patches = pose.hand.joints, len(pose.hand.patches)
    size = len(pose.mean)
    if size != pose.lagged(pose.lag).stop and not (type(pose).__name__ == "DeltaPose" and size == _of_delta(pose)):
        raise ValueError(f"pose.mean must have {pose.lagged(pose.lag).stop} numbers, got {size}")
    array("pose.mean", pose.mean, REAL, (size,))
    kept = not isinstance(pose, KinematicPose)  # that one has no number where nothing is kept
    array("pose.covariance", pose.covariance, REAL, (size, size), finite=kept)
    number("pose.log_evidence", pose.log_evidence)
    gate = getattr(pose, "_gate", None)
    if gate is not None:
        array("pose._gate.set_aside", gate.set_aside, WHOLE, (joints,))
        array("pose._gate._row", gate._row, WHOLE, (joints,))
        array("pose._gate._last", gate._last, REAL, (joints,), finite=False)  # NaN: it was not measured
    sigma = np.asarray(pose.sigma)
    if sigma.shape not in ((), (joints,)) or sigma.dtype.kind != "f" or not (sigma >= 0.0).all():
        raise ValueError("pose.sigma must be a number or one of each joint")
    if isinstance(pose, PoseFilter):
        array("pose._contacts", pose._contacts, BOOL, (patches,))
        array("pose.doubted", pose.doubted, BOOL, (patches,))
    if isinstance(pose, KinematicPose):
        bank = pose._bank
        array("pose._bank.level", bank.level, REAL, bank._log_prior.shape)
        record("pose._bank.moments", bank.moments, LaggedMoments)
        for name, each in bank._ahead._asdict().items():
            array(f"pose._bank.moments.{name}", getattr(bank.moments, name), REAL, each.shape)
        array("pose.partners._advantage", pose.partners._advantage, REAL, pose.partners._first.shape)
    if hasattr(pose, "_unfelt"):
        array("pose._unfelt", pose._unfelt, REAL, (size,))


def _of_delta(pose: Any) -> int:
    return (pose.lag + 1) * int(pose.hand.joints) + len(pose.noise.decay)


def _trial(made: Any) -> None:
    """What a trial has come to; the maps were checked as they were read."""
    state, hand = made._state, made.hand
    count, joints, patches, links = made.n_particles, hand.joints, len(hand.patches), len(hand.links)
    errors = made.pose.constant.stop - made.pose.constant.start
    number("state.forgetting.steps", state.forgetting.steps)
    array("state.poses", state.poses, REAL, (count, joints))
    array("state.errors", state.errors, REAL, (count, errors))
    mean, factor = state.drawn
    array("state.drawn.0", mean, REAL, (joints + errors,))
    array("state.drawn.1", factor, REAL, (joints + errors, joints + errors))
    array("state.contacts", state.contacts, BOOL, (patches,))
    array("state.weights", state.weights, REAL, (count,))
    array("state.log_weights", state.log_weights, REAL, (count,), finite=False)  # of one that is impossible
    number("state.log_evidence", state.log_evidence)
    number("state.n_eff", state.n_eff)
    if len(state.waiting) > made.lag:
        raise ValueError(f"state.waiting must be {made.lag} steps at most, got {len(state.waiting)}")
    for step in state.waiting:
        _waiting("state.waiting", step, patches)
    history("state.novelty", state.novelty._said, LinkHistory.nothing(hand))
    array("state.novelty._news", state.novelty._news, REAL, (links,))
    _hindsight(made, int(made._sensing.tree.parent.shape[0]))
    for link in state.touches._links:
        array("state.touches.patches", link.patches, WHOLE, (len(link.patches),))
        _within("state.touches.patches", link.patches, 0, patches)
        array("state.touches.position", link.position, REAL, (3,))
        array("state.touches.rotation", link.rotation, REAL, (3, 3))
        array("state.touches.covariance", link.covariance, REAL, (6, 6))


def _hindsight(made: Any, bodies: int) -> None:
    found, patches, links = made._state.hindsight, len(made.hand.patches), len(made.hand.links)
    cells = int(np.prod(made.grid.shape))
    array("state.hindsight._swept", found._swept, WHOLE, (cells,))
    array("state.hindsight._seen", found._seen, BOOL, (cells,))
    for suspects, weight, cell, hits in found._touches:
        array("state.hindsight.suspects", suspects, WHOLE, (len(weight),))
        array("state.hindsight.weight", weight, REAL, (len(weight),))
        array("state.hindsight.cell", cell, WHOLE, (len(hits),))
        array("state.hindsight.hits", hits, REAL, (len(hits),))
        _within("state.hindsight.cell", cell, 0, cells)
        if (suspects < 0).any() or suspects.sum() != len(cell):
            raise ValueError("state.hindsight.suspects do not fit its cells")
    for moment in found._fresh:
        record("state.hindsight._fresh", moment, Moment)
        shapes = (bodies, 3), (bodies, 3, 3), (links,), (patches,), (patches,), (links,)
        for name, each, shape in zip(Moment._fields, moment, shapes, strict=True):
            array(f"state.hindsight.{name}", each, BOOL if name in ("contacts", "heard") else REAL, shape)
    if type(found.empty) is not bool:
        raise ValueError("state.hindsight.empty must be true or false")


def record(name: str, given: Any, kind: type) -> None:
    """Check a named tuple.

    Args:
        name: of it, for messages.
        given: that was read.
        kind: of which it must be.

    Raises:
        ValueError: for anything else.
    """
    if not isinstance(given, kind):
        raise ValueError(f"{name} must be a {kind.__name__}, got {type(given).__name__}")
