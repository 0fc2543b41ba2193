"""What an observer was told that the object may be, in its saved state: what has become of it is kept, solids are not.

Whoever loads the state gives them, as they were given at first; here is told whether they are the same.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from haptic_env import validate
from observer.belief import Transition
from observer.saved_checks import REAL, array, history, null_model, number, record
from observer.shape.loose_fit import SPREADS, LooseFit
from observer.shape.pose_correction import PoseCorrection
from observer.shape.posterior import ShapePosterior

SAID = (
    "none", "tolerance", "press", "surprise", "samples", "temper", "stride", "alike", "memory_seconds", "control_hz",
)  # fmt: skip
PREFIX = "solids."


def tell(known: PoseCorrection, arrays: dict[str, NDArray[Any]]) -> dict[str, Any]:
    """Say what was told.

    Args:
        known: of the observer.
        arrays: to which those that tell solids apart are added.

    Returns:
        The rest, in JSON's words.

    Raises:
        ValueError: for solids that lie any way, of which all that was felt is kept.
    """
    shape = known.shape
    if shape.variants.turns.most:
        raise ValueError("an observer that was told solids with rotation_jitter cannot be saved, one without can")
    arrays |= {PREFIX + name: each for name, each in _arrays(shape).items()}
    return {"labels": list(shape.labels), **{name: getattr(shape, name) for name in SAID}}


def check(told: Any, content: Mapping[str, NDArray[Any]], given: ShapePosterior | None) -> None:
    """Check that solids are those that an observer was told.

    Args:
        told: as of `tell`; None: it was told none.
        content: arrays of the file.
        given: by whoever loads it.

    Raises:
        ValueError: where they are not.
    """
    if told is None:
        if given is not None:
            raise ValueError("saved without solids: load it without solids=")
        return
    labels = validate.listed([str(each) for each in told["labels"]])
    if given is None:
        raise ValueError(f"saved with solids: give the ShapePosterior of {labels} that it was told, solids=...")
    validate.instance("solids", given, ShapePosterior, "a ShapePosterior of what the object may be")
    mine = {"labels": list(given.labels), **{name: getattr(given, name) for name in SAID}}
    for name, now in mine.items():
        if told[name] != now:
            raise ValueError(
                f"saved with other solids, of {labels}: {name} was {validate.shown(told[name])}, and of those that are "
                f"given is {validate.shown(now)}"
            )
    for name, each in _arrays(given).items():
        other = content[PREFIX + name]
        if other.shape != each.shape or other.dtype != each.dtype or not np.allclose(other, each, atol=1e-6):
            raise ValueError(f"saved with other solids, of {labels}: their {name} differ from those that are given")


def _arrays(shape: ShapePosterior) -> dict[str, NDArray[Any]]:
    """What tells solids apart."""
    variants, nominal = shape.variants, shape.variants.nominal
    middle = [nominal.field(f).mean(dtype=np.float64) for f in range(len(nominal.first))]
    ends = zip(nominal.spread, nominal.spread + nominal.shape.prod(axis=1), strict=True)
    vague = [nominal.nodes[first:end].mean(dtype=np.float64) if first >= 0 else -1.0 for first, end in ends]
    return {
        "ranges": variants.ranges,
        "count": np.array([variants.count]),
        "size": nominal.shape,
        "distance": np.array(middle),
        "spread": np.array(vague),
        "drawn_in": nominal.drawn_in,
        "scale": nominal.scale,
        "rotation": nominal.rotation,
        "position": nominal.position,
    }


def check_state(read: ShapePosterior) -> None:
    """Check what has become of solids in a trial: kernels look nothing up outside their tables.

    Args:
        read: with what was read in place of what it was, but for the tables of its solids.

    Raises:
        ValueError: for what does not fit.
    """
    fresh = copy.copy(read)
    fresh.reset(seed=0)
    for name in ("_units", "_log_evidence", "_poses", "_weights", "_news"):
        array(f"known.{name}", getattr(read, name), REAL, getattr(fresh, name).shape)
    array("known._likelihood", read._likelihood, REAL, fresh._likelihood.shape, finite=False)  # filled anew
    if np.abs(read._units).max() > 1.0:
        raise ValueError("known._units must lie in [-1, 1]")
    history("known.said", read.said, fresh.said)
    if isinstance(read._null, LooseFit):
        array("known._null.gained", read._null.gained, REAL, (len(SPREADS),))
    else:
        null_model("known._null", read._null, len(read.hand.patches))
    _names(read, fresh)
    for each in (read._unfit, *read._misfit._recent):
        number("known", each)
    for steps in (read._steps, read._passed):
        if type(steps) is not int or steps < 0:
            raise ValueError("known._steps and known._passed must be whole numbers")
    if read._moved is not None:
        record("known._moved", read._moved, Transition)
        joints = read.hand.joints
        for name, each in read._moved._asdict().items():
            array(f"known._moved.{name}", each, REAL, (joints, joints)[: 2 if name in ("follow", "rest") else 1])


def _names(read: ShapePosterior, fresh: ShapePosterior) -> None:
    mine, usual = read._names, fresh._names
    array("known._names._posterior", mine._posterior, REAL, usual._posterior.shape)
    if not isinstance(mine._told, tuple) or len(mine._told) != len(usual._told):
        raise ValueError("known._names._told is of other names")
    array("known._names._told", mine._told[0], REAL, usual._told[0].shape)
    for each in mine._told[1:]:
        number("known._names._told", each)
    if mine._fading is not None and usual._fading is not None:
        for name, each in (("_last", mine._fading._last), ("_evidence", mine._fading._evidence)):
            array(f"known._names._fading.{name}", each, REAL, usual._fading._last.shape)
        array("known._names._forgetful", mine._forgetful, REAL, usual._forgetful.shape)
