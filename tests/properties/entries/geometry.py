"""Grids, poses, shapes and meshes: where things are, and what they are."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from haptic_env import shapes
from haptic_env.grid import Grid
from haptic_env.pose import Pose
from tests.properties import samples
from tests.properties.entry import Entry
from tests.properties.files import file
from tests.properties.parameters import Parameter, array, integer, name, number, one_of, several
from tests.properties.rule import Allowed
from tests.properties.strategies import odd_names, odd_paths

PLACE, TURN, SIZE = array((3,), -0.1, 0.1), array((4,)), array((3,), 0.01, 0.1)
MESHES = {
    "stl": (".stl", samples.stl(), samples.stl_text()),
    "obj": (".obj", samples.obj(), samples.obj(squares=True)),
    "ply": (".ply", samples.ply(), samples.ply(text=False)),
}
SET = Parameter(name(shapes.SETS).valid, odd_names | odd_paths, needed=True)
NAMED = Parameter(name(shapes.SHAPES).valid, odd_names | odd_paths, needed=True)
OBJECT = Allowed(words=("object", "mesh", "shape"), files=False)


def _grid(**call: Any) -> Any:
    made = Grid(**call)
    return made.centre, made.extent, made.index(np.zeros((2, 3))) if np.prod(made.shape) < 1e5 else None


def _around(**call: Any) -> Any:
    made = Grid.around(**call)
    return made, made.centre, made.extent


def _pose(made: Pose) -> Any:
    return made, made.inverse(), made @ made.inverse(), made.checked("pose")


def _solid(points: Any = None, **call: Any) -> Any:
    made = shapes.make(**call)
    near = np.linspace(-0.1, 0.1, 12).reshape(4, 3)
    return made.size, made.signed_distance(near if points is None else points), made.occupancy(samples.grid()).mean()


def _mesh(path: Any, **call: Any) -> Any:
    return _solid(name=path, **call)


def _explored(path: Any) -> Any:
    """By a hand, for which it is cut into convex pieces."""
    env = samples.environment(shape=path)
    seen = env.reset(seed=0)
    env.close()
    return seen


ENTRIES: dict[str, Entry] = {
    "haptic_env.grid.Grid": Entry(
        _grid,
        {
            "origin": array((3,)).always,
            "resolution": number(0.001, 0.1).always,
            "shape": Parameter(
                one_of((4, 5, 6), [2, 2, 2], np.array([3, 3, 3])).valid,
                array((3,)).odd | several(integer(1, 2)).odd,
                True,
            ),
        },
        Allowed(words=("grid",)),
    ),
    "haptic_env.grid.Grid.around": Entry(
        _around,
        {"centre": PLACE.always, "extent": SIZE.always, "resolution": number(0.002, 0.1).always},
        Allowed(words=("grid",)),
    ),
    "haptic_env.grid.Grid.index": Entry(lambda points: samples.grid().index(points), {"points": array((5, 3)).always}),
    "haptic_env.pose.Pose": Entry(
        lambda position, rotation: _pose(Pose(position, rotation)),
        {"position": PLACE.always, "rotation": Parameter(one_of(lambda: np.eye(3)).valid, array((3, 3)).odd, True)},
    ),
    "haptic_env.pose.Pose.of": Entry(
        lambda position, quaternion: _pose(Pose.of(position, quaternion)),
        {"position": PLACE.always, "quaternion": TURN.always},
    ),
    "haptic_env.shapes.check": Entry(
        lambda what, name: shapes.check("shape", name), {"what": one_of("shape"), "name": NAMED}, OBJECT
    ),
    "haptic_env.shapes.read_set": Entry(shapes.read_set, {"name": SET}, OBJECT),
    "haptic_env.shapes.allow": Entry(lambda several: shapes.allow([several]), {"several": NAMED}, OBJECT),
    "haptic_env.shapes.find": Entry(lambda name: shapes.find(name).default_size, {"name": NAMED}, OBJECT),
    "haptic_env.shapes.default_size": Entry(shapes.default_size, {"name": NAMED, "scale": number(0.1, 2.0)}, OBJECT),
    "haptic_env.shapes.usual": Entry(
        lambda name, scale: shapes.usual(name, samples.hand(), scale).size,
        {"name": NAMED, "scale": number(0.1, 2.0).always},
        OBJECT,
    ),
    **{
        f"haptic_env.shapes.SHAPES[{kind}]": Entry(
            partial(_solid, name=kind), {"size": SIZE, "position": PLACE, "quaternion": TURN}, OBJECT
        )
        for kind in shapes.SHAPES
    },
    **{
        f"haptic_env.shapes.Solid[{kind}]": Entry(
            partial(_solid, name=kind), {"points": array((2, 3, 3)).always}, OBJECT
        )
        for kind in shapes.SHAPES
    },
    "haptic_env.shapes.make": Entry(
        _solid, {"name": NAMED, "size": SIZE, "position": PLACE, "quaternion": TURN}, OBJECT
    ),
    **{
        f"haptic_env.shapes.mesh[{kind}]": Entry(
            _mesh, {"path": file(*whole).always, "points": array((3, 3)), "size": SIZE}, OBJECT, weight=3
        )
        for kind, whole in MESHES.items()
    },
    **{
        f"haptic_env.shapes.mesh.prepare[{kind}]": Entry(
            _explored, {"path": file(*whole, there=True).always}, OBJECT, weight=0.3
        )
        for kind, whole in MESHES.items()
    },
}
