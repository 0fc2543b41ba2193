"""Which object is explored in an episode: what `reset` is told of it, and the rest drawn at random."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from haptic_env import rotation, shapes, validate
from haptic_env.hand import Hand
from haptic_env.shapes.base import Solid

RESET_OPTIONS = ("position", "quaternion", "shape", "sigma_deg", "size")


def reset_options(options: Mapping[str, Any] | None) -> Mapping[str, Any]:
    """Check that the options of a reset are a dictionary; `ObjectPrior.draw` checks what is in it.

    Args:
        options: as `ExploreEnv.reset`'s.

    Returns:
        The options, none for None.

    Raises:
        ValueError: for something else.
    """
    if options is not None and not isinstance(options, Mapping):
        valid = f"a dictionary of {', '.join(RESET_OPTIONS)}"
        raise ValueError(f"reset options must be {valid}, got {validate.shown(options)}")
    return options or {}


class ObjectPrior(NamedTuple):
    """What objects there may be, before anything is felt.

    Attributes:
        names: of the shapes or paths of the meshes, each as probable as the others.
        scale: metres that the unit of mesh files is long.
        size_jitter: fraction by which the size varies, uniformly and as a whole.
        position_jitter: m by which the place varies along each axis, uniformly.
        yaw_jitter: degrees by which the turn about z varies, uniformly.
        rotation_jitter: degrees by which the turn about any axis does; 180: the object lies any way.
    """

    names: tuple[str, ...]
    scale: float
    size_jitter: float
    position_jitter: float
    yaw_jitter: float
    rotation_jitter: float = 0.0

    @classmethod
    def checked(
        cls,
        shape: str | Path | Sequence[str | Path] | None,
        scale: float,
        size_jitter: float,
        position_jitter: float,
        yaw_jitter: float,
        rotation_jitter: float = 0.0,
    ) -> ObjectPrior:
        """Check what a user gives.

        Args:
            shape: a name or the path of a mesh, several of them, or None for all named shapes.
            scale: m, above 0.
            size_jitter: in [0, 0.5].
            position_jitter: m, in [0, 0.05].
            yaw_jitter: degrees, in [0, 180].
            rotation_jitter: degrees, in [0, 180]; above 0 only without `yaw_jitter`.

        Returns:
            The prior.

        Raises:
            ValueError: for an unknown shape, a mesh of impossible size, an empty list or a number out of range.
        """
        scale = validate.number("scale", scale, above=0.0, unit="m")
        return cls(
            _names(shape, scale),
            scale,
            validate.number("size_jitter", size_jitter, 0.0, 0.5),
            validate.number("position_jitter", position_jitter, 0.0, 0.05, unit="m"),
            validate.number("yaw_jitter", yaw_jitter, 0.0, 180.0, unit="degrees"),
            rotation.jitter(rotation_jitter, yaw_jitter),
        )

    @property
    def varies(self) -> bool:
        """Whether size or pose are drawn."""
        return bool(self.size_jitter or self.position_jitter or self.yaw_jitter or self.rotation_jitter)

    def draw(self, rng: np.random.Generator, hand: Hand, options: Mapping[str, Any]) -> Solid:
        """Draw the object of an episode; always takes the same draws from `rng`, whatever the options.

        Args:
            rng: gives the draws.
            hand: in whose workspace a place that is told must lie; one that is not has the near side within reach.
            options: as `ExploreEnv.reset`'s; what they tell is not drawn.

        Returns:
            The object.

        Raises:
            ValueError: for an unknown option, an impossible shape, size or pose, or an object out of reach.
        """
        for option in options:
            validate.choice("reset option", option, RESET_OPTIONS)
        drawn = self.names[rng.integers(len(self.names))]
        jitter = 1 + self.size_jitter * rng.uniform(-1, 1)
        shift = self.position_jitter * rng.uniform(-1, 1, 3)
        yaw = np.deg2rad(self.yaw_jitter) * rng.uniform(-1, 1)
        turn = np.array([np.cos(yaw / 2), 0.0, 0.0, np.sin(yaw / 2)])
        if self.rotation_jitter:
            turn = np.roll(rotation.drawn(rng, np.deg2rad(self.rotation_jitter), 1).as_quat()[0], 1)
        name = options.get("shape")
        name = drawn if name is None else shapes.check("shape", name)
        size = options.get("size")
        position = options.get("position")
        quaternion = options.get("quaternion")
        usual = shapes.default_size(name, self.scale)
        told = shapes.find(name).check_size(usual if size is None else size)
        solid = shapes.make(
            name,
            jitter * told if size is None else told,
            hand.place(told) + shift if position is None else position,
            turn if quaternion is None else quaternion,
        )
        reach = hand.workspace / 2
        if position is not None and (np.abs(np.asarray(solid.position) - hand.grasp_centre) > reach).any():
            low, high = hand.grasp_centre - reach, hand.grasp_centre + reach
            raise ValueError(
                f"object position {solid.position} m is out of reach; choose it between {low.tolist()} and "
                f"{high.tolist()} m"
            )
        return solid


def _names(shape: str | Path | Sequence[str | Path] | None, scale: float) -> tuple[str, ...]:
    """The shapes to draw from; raises `ValueError` for an unknown one, a mesh of impossible size or an empty list."""
    if shape is None:
        return tuple(shapes.SHAPES)
    single = isinstance(shape, str) or not isinstance(shape, Iterable) or getattr(shape, "ndim", 1) == 0
    given: tuple[Any, ...] = (shape,) if single else tuple(shape)  # type: ignore[arg-type]
    names = tuple(shapes.check("shape", name) for name in given)
    if not names:
        raise ValueError(f"shape must name at least one of {', '.join(shapes.SHAPES)}, got an empty list")
    for name in names:
        shapes.default_size(name, scale)
    if len(names) == 1:  # each reset needs it; of several, those that are drawn
        shapes.find(names[0]).prepare()
    return names
