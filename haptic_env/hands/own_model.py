"""The model of a hand of one's own, and what of it is the hand: all that hangs from one body, its root."""

from __future__ import annotations

import mujoco

from haptic_env import validate
from haptic_env.hands import model_files
from haptic_env.hands.description import HandDescription
from haptic_env.hands.skeleton import bodies_below

EQUALITY = mujoco.mjtEq


class OwnModel:
    """A model, and where the hand is in it.

    Attributes:
        told: the description of the hand.
        model: compiled, with the hand and whatever else there is.
        bodies: index of each body by its name.
        root: index of the body from which the hand hangs.
        below: indices of the bodies that hang from it.
    """

    def __init__(self, told: HandDescription) -> None:
        """Read the model.

        Args:
            told: the description of the hand.

        Raises:
            ValueError: for a model that cannot be read, bodies that it has not, and what is no tree of joints.
        """
        self.told, self.model = told, model_files.load(told.model, told.packages)
        self.bodies = {self.name(b): b for b in range(1, self.model.nbody) if self.name(b)}
        chosen = [(finger, body) for finger in told.fingers for body in finger.bodies]
        for finger, body in chosen:
            validate.choice(f"body of {finger.title}", body, self.bodies)
        self.root = self._root()
        self.below = bodies_below(self.model, self.root)
        for _, body in chosen:
            if self.bodies[body] not in (self.root, *self.below):
                raise ValueError(f"body {body!r} does not hang from root {self.name(self.root)!r}")

    def name(self, body: int) -> str:
        """Tell the name of a body.

        Args:
            body: its index.

        Returns:
            Its name; "" where it has none.
        """
        return str(self.model.body(body).name)

    def left_out(self) -> list[str]:
        """Tell what of the model is no part of a hand.

        Returns:
            A line for each kind.

        Raises:
            ValueError: for a constraint that closes a loop.
        """
        model, notes = self.model, []
        for e in range(model.neq):
            kind, name = EQUALITY(model.eq_type[e]), model.equality(e).name or f"number {e + 1}"
            ends = int(model.eq_obj1id[e]), int(model.eq_obj2id[e])
            if kind in (EQUALITY.mjEQ_CONNECT, EQUALITY.mjEQ_WELD):
                if model.eq_objtype[e] == mujoco.mjtObj.mjOBJ_SITE:
                    ends = int(model.site_bodyid[ends[0]]), int(model.site_bodyid[ends[1]])
                if all(end in self.below for end in ends):
                    raise ValueError(
                        f"constraint {name!r} closes a loop between bodies {self.name(ends[0])!r} and "
                        f"{self.name(ends[1])!r}; a hand is a tree of joints: take it out of the model"
                    )
        if model.nu:
            notes.append(f"actuators of the model ({model.nu}) are left out: torques are told by [joint.NAME]")
        return notes

    def _root(self) -> int:
        if self.told.root is not None:
            return self.bodies[validate.choice("root", self.told.root, self.bodies)]
        chosen = [self.bodies[body] for finger in self.told.fingers for body in finger.bodies]
        tops = dict.fromkeys(int(self.model.body_rootid[body]) for body in chosen)
        names = validate.listed(self.name(top) or "one without a name" for top in tops)
        if len(tops) > 1:
            raise ValueError(
                f"its fingers hang from several bodies of the world, {names}; a hand hangs from one: put one about them"
            )
        top = next(iter(tops))
        if not self.name(top):
            raise ValueError("the body from which all fingers hang needs a name in the model")
        return top
