"""What an exploration needs to have compiled, in parts that can be compiled side by side (`observer.compiling`).

Each part calls with few numbers all that it stands for. Shapes: P patches.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from haptic_env import validate
from haptic_env.grid import Grid
from haptic_env.hand import Hand
from observer import compiling, edge, metrics
from observer.brackets import DeadReckoning
from observer.compiling import Progress
from observer.configuration import RESOLUTION
from observer.contacts.contact_filter import believed_contacts
from observer.fastslam import HapticSLAM
from observer.kinematics import tree_of
from observer.maps import capsules
from observer.maps.contact_model import ContactModel
from observer.maps.hindsight import Moment, occupancy
from observer.maps.occupancy import Maps
from observer.pose_only import PoseOnly
from observer.shape.posterior import ShapePosterior

UNKNOWN: dict[str, Any] = {"size_jitter": 0.1, "yaw_jitter": 10.0, "variants": 8}


def warm_up(hand: Hand, progress: Progress | None = None, observer: HapticSLAM | None = None) -> None:
    """Compile, or load, all that an exploration needs, so that no step of it waits for the compiler.

    Compiling takes its time once for each version of the code on each kind of processor.

    Args:
        hand: that explores.
        progress: called with how many functions are done and how many there are; None: a line is logged where anything
            has to be compiled.
        observer: whose settings ask for more than is usual: motion without torques, doubtful contacts, known solids;
            None: one as it is by default.

    Raises:
        ValueError: for what is no hand, no such function, or no such observer.
    """
    edge.world(hand=hand)
    if progress is not None and not callable(progress):
        raise ValueError(f"progress must be a function of two numbers, or None, got {validate.shown(progress)}")
    if observer is not None:
        validate.instance("observer", observer, HapticSLAM, "a HapticSLAM, or None")
    needed = compiling.USUAL if observer is None else observer.needs
    compiling.ensure(needed, hand, progress)
    for name in needed:
        globals()[name.partition(":")[2]](hand)


def maps(hand: Hand) -> None:
    """Take steps of an observer with a map.

    Args:
        hand: any.
    """
    observer = DeadReckoning(hand, in_hindsight=False)
    _explore(observer)
    Maps(2, observer.grid, ContactModel().evidence(RESOLUTION).probability).weights_changed()


def pose_and_hindsight(hand: Hand) -> None:
    """Call the pose filter, the posterior over names, and the map in hindsight.

    Args:
        hand: any.
    """
    posteriors = ShapePosterior(hand), ShapePosterior(hand, **UNKNOWN)
    observer = PoseOnly(hand, control_hz=10.0)
    observer.reset()
    for contacts in _felt(hand):
        belief = observer.step(np.zeros(hand.joints), hand.rest_pose, contacts)
        for posterior in posteriors:
            posterior.update(belief)
    tree, grid = tree_of(hand), Grid.around(hand.grasp_centre, hand.workspace, RESOLUTION)
    frames = np.zeros((len(tree.parent), 3)), np.tile(np.eye(3), (len(tree.parent), 1, 1))
    sure, weight, heard = np.zeros(len(hand.links)), np.ones(len(hand.patches)), np.ones(len(hand.links), dtype=bool)
    moments = [Moment(*frames, sure, contacts, weight, heard) for contacts in _felt(hand)]
    occupancy(moments, tree, grid, capsules.body_of(hand.patches, grid.resolution), ContactModel())


def sampled_matching(hand: Hand) -> None:
    """Take steps of `HapticSLAM(matching="sample")`.

    Args:
        hand: any.
    """
    _explore(HapticSLAM(hand, particles=2, matching="sample", lag=1))


def smooth_motion(hand: Hand) -> None:
    """Take steps of `HapticSLAM(motion="kinematic")`.

    Args:
        hand: any.
    """
    _explore(HapticSLAM(hand, particles=2, motion="kinematic", lag=1))


def known_solids(hand: Hand) -> None:
    """Take steps of `HapticSLAM(solids=…)`.

    Args:
        hand: any.
    """
    _explore(HapticSLAM(hand, particles=2, solids=ShapePosterior(hand), lag=1))


def contacts(hand: Hand) -> None:
    """Doubt what is reported.

    Args:
        hand: any.
    """
    reports = believed_contacts(hand, 50.0, 1, 0.1, 0.01, 0.1, 0.01, 0.01)
    assert reports is not None
    for told in _felt(hand):
        reports.step(told)


def _explore(observer: HapticSLAM) -> None:
    hand = observer.hand
    observer.reset(seed=0, joint_angles=hand.rest_pose)
    for contacts in _felt(hand):
        observer.step(np.zeros(hand.joints), hand.rest_pose, contacts).occupancy  # noqa: B018 - computed when asked for
    for belief in observer.flush():
        belief.occupancy  # noqa: B018
    metrics.swept(hand, hand.rest_pose[None], observer.grid)


def _felt(hand: Hand) -> list[NDArray[np.bool_]]:
    """Contacts (P,) of some steps: the same patches of all links begin to feel something and cease to."""
    touch = np.arange(len(hand.patches)) % 3 == 0
    return [touch, touch, ~touch, ~touch, np.zeros_like(touch), np.zeros_like(touch)]
