"""What one step has to say to the maps.

Shapes: J joints, L links, P patches. Angles in radians.
"""

from __future__ import annotations

import numpy as np

from haptic_env.arrays import Array
from haptic_env.grid import Grid
from haptic_env.hand import Hand
from observer.kinematics import placed, tree_of
from observer.maps import capsules
from observer.maps.capsules import MapInput, MeanFrames
from observer.maps.contact_model import ContactModel
from observer.maps.hindsight import Hindsight, Moment
from observer.novelty import unmeasured_links
from observer.state import FilterState, Waiting


class Sensing:
    """The hand, the grid and the contact model as kernels read them, and what they make of a step.

    Attributes:
        tree: the hand's kinematics.
        grid: of the maps.
        model: of contacts.
        in_hindsight: whether steps are kept for the map in hindsight.
        body: the hand's patches and links, for kernels.
        evidence: the contact model, for kernels.
    """

    def __init__(self, hand: Hand, grid: Grid, model: ContactModel, in_hindsight: bool) -> None:
        """Put into words of the kernels what stays the same.

        Args:
            hand: with L links and P patches.
            grid: of the maps.
            model: of contacts.
            in_hindsight: keep steps for the map in hindsight.
        """
        self.tree, self._hand = tree_of(hand), hand
        self.grid, self.model, self.in_hindsight = grid, model, in_hindsight
        self.body = capsules.body_of(hand.patches, grid.resolution)
        self.evidence = model.evidence(grid.resolution)
        self._lattice = capsules.lattice_of(grid)
        self._link = hand.patches.link
        self._watches = hand.link_group[self._link][:, None] == hand.link_group  # (P, L): whose patches a touch calls

    def stand(self, state: FilterState, step: Waiting, pose: Array, covariance: Array) -> tuple[MapInput, MeanFrames]:
        """Tell how the hand stands at a step, and what it feels there; the filter's state takes note of it.

        Args:
            state: changed.
            step: the contacts, and where the hand as a whole is.
            pose: (J,) rad.
            covariance: (J, J) rad² of the pose.

        Returns:
            What the step has to say to the maps, and the frames of the mean pose.
        """
        contacts, root, unmeasured = step
        state.forgetting.step()
        if (fade := state.forgetting.now) is not None:
            state.novelty.fade(fade.share)
            state.hindsight.fade(fade)
        tree = placed(self.tree, root)
        stance, reach = capsules.stand(tree, self.body, self.evidence, self.model.caution, pose, covariance)
        touch = np.where(state.contacts, self.model.sustained, self.model.touch)
        mute = None if unmeasured is None else unmeasured_links(self._hand, unmeasured)
        heard = state.novelty.heard(stance, contacts, mute)
        if self.in_hindsight and heard.any():
            state.hindsight.note(Moment(stance.position, stance.rotation, reach.place, contacts, touch, heard))
        if contacts.any():
            state.touches.note(tree, stance, covariance, contacts & heard[self._link])
        state.contacts = contacts if unmeasured is None else np.where(unmeasured, state.contacts, contacts)
        said, watched = reach.of(heard), self._watches[contacts].any(axis=0)
        if mute is not None:
            said, watched = said.without(mute), watched & ~mute
        felt = MapInput(
            tree,
            self.body,
            self._lattice,
            self.evidence,
            said,
            contacts,
            np.where(heard[self._link], touch, 0.0),
            watched,
        )
        return felt, stance

    def hindsight(self) -> Hindsight:
        """Begin the map in hindsight of a trial.

        Returns:
            One to which nothing was noted yet.
        """
        return Hindsight(self.tree, self.grid, self.body, self.model)
