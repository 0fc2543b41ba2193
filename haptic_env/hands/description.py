"""A hand of one's own as a TOML file says it: which model, which bodies are fingers, where what is felt.

Lengths in metres, angles in degrees, as whoever writes the file thinks. What the file does not say has a default; what
it says is checked here as far as it can be without the model.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from haptic_env import reading, validate
from haptic_env.arrays import Array

KEYS = (
    "name", "model", "root", "packages", "position", "quaternion", "grasp_centre", "workspace", "opening",
    "wrist_centre", "finger", "palm", "capsule", "patches", "taxel", "joint",
)  # fmt: skip
FINGER, PALM = ("name", "bodies", "geoms", "tip"), ("bodies", "geoms")
CAPSULE, PATCHES = ("body", "start", "end", "radius"), ("along", "around")
TAXEL = ("name", "body", "position", "normal", "radius")
HINGE = ("rest_deg", "range_deg", "torque", "damping", "stiffness")
SLIDE = ("rest_m", "range_m", "lever_arm", "torque", "damping", "stiffness")
THINNEST, THICKEST = 1e-4, 0.2  # m, radii of capsules
FEELS = 0.005  # m about its place, a taxel of which nothing else is said
MOST_TAXELS = 10_000
MODELS = (".xml", ".mjcf", ".urdf")


class Finger(NamedTuple):
    """Bodies of a finger, or of the palm.

    Attributes:
        name: of the finger; "" of the palm.
        bodies: from its base to its tip.
        geoms: the only ones that are skin; empty: all that collide.
        tip: whether its last body ends in a fingertip.
    """

    name: str
    bodies: tuple[str, ...]
    geoms: tuple[str, ...] = ()
    tip: bool = False

    @property
    def title(self) -> str:
        """What errors call it."""
        return f"finger {self.name!r}" if self.name else "the palm"


class ToldCapsule(NamedTuple):
    """A capsule of skin in place of the geoms of its body.

    Attributes:
        body: in whose frame the others are.
        start: (3,) m, centre of the proximal cap.
        end: (3,) m, centre of the distal cap.
        radius: m.
    """

    body: str
    start: Array
    end: Array
    radius: float


class ToldTaxel(NamedTuple):
    """A place that feels.

    Attributes:
        name: of the patch.
        body: in whose frame the others are.
        position: (3,) m.
        normal: (3,), outward.
        radius: m, how far from its place it feels.
    """

    name: str
    body: str
    position: Array
    normal: Array
    radius: float


@dataclass(frozen=True)
class HandDescription:
    """What a TOML file says of a hand.

    Attributes:
        name: of the hand.
        model: path of the MJCF or URDF.
        packages: by the name of each ROS package that a URDF names, its folder.
        root: body from which the hand hangs; None: what all fingers hang from.
        position: (3,) m, of the root in the world; None: as the model has it.
        quaternion: (4,) wxyz, of the root in the world; None: as the model has it.
        grasp_centre: (3,) m, as `Hand`'s; None: not said.
        workspace: (3,) m, as `Hand`'s.
        opening: (3,), as `Hand`'s.
        wrist_centre: (3,) m in the world, about which a free wrist turns; None: where the root is.
        fingers: the fingers, and the palm.
        capsules: of skin, in place of geoms.
        along: rows of patches along each capsule.
        around: sectors around each.
        taxels: in place of such patches; None: these.
        joints: by its name, what is said of each joint.
    """

    name: str
    model: Path
    packages: Mapping[str, Path]
    root: str | None
    position: Array | None
    quaternion: Array | None
    grasp_centre: Array | None
    workspace: Array
    opening: Array
    wrist_centre: Array | None
    fingers: tuple[Finger, ...]
    capsules: tuple[ToldCapsule, ...]
    along: int
    around: int
    taxels: tuple[ToldTaxel, ...] | None
    joints: Mapping[str, Mapping[str, Any]]


def read(path: Path | str) -> HandDescription:
    """Read a TOML file.

    Args:
        path: of the file; paths in it are relative to its folder.

    Returns:
        What it says.

    Raises:
        ValueError: for an unknown key, a missing one, and a value that makes no sense; it names the file.
    """
    place = validate.path("hand", path)
    try:
        return _described(place, reading.toml(place))
    except OSError as error:
        raise ValueError(f"hand {place} cannot be read: {error.strerror or error}") from error
    except ValueError as error:
        raise ValueError(f"{place}: {error}") from error


def _described(place: Path, told: Mapping[str, Any]) -> HandDescription:
    _keys("hand", told, KEYS)
    model = place.parent / validate.path("model", _wanted("hand", told, "model"))
    if model.suffix.lower() not in MODELS:
        raise ValueError(f"model must be a file {', '.join(MODELS)}, got {validate.shown(told['model'])}")
    packages = _table("packages", told.get("packages", {}))
    if "taxel" in told and "patches" in told:
        raise ValueError("patches are a lattice ([patches]) or a list ([[taxel]]), not both")
    lattice = _table("patches", told.get("patches", {}), PATCHES)
    fingers = [_finger(each) for each in _tables("finger", told.get("finger", []))]
    if "palm" in told:
        palm = _table("palm", told["palm"], PALM)
        fingers.append(Finger("", _names("bodies of the palm", palm), _names("geoms of the palm", palm, "geoms")))
    if not fingers:
        raise ValueError("a hand needs at least one [[finger]], with its name and its bodies from base to tip")
    bodies = [body for finger in fingers for body in finger.bodies]
    for body in bodies:
        if bodies.count(body) > 1:
            raise ValueError(f"body {body!r} is listed twice; a body is of one finger, or of the palm")
    capsules = tuple(_capsule(index, each) for index, each in enumerate(_tables("capsule", told.get("capsule", []))))
    for capsule in capsules:
        validate.choice("body of a capsule, of those of fingers and palm,", capsule.body, bodies)
    taxels = None
    if "taxel" in told:
        taxels = tuple(_taxel(index, each) for index, each in enumerate(_tables("taxel", told["taxel"])))
        _check_taxels(taxels, bodies)
    joints = {name: _table(f"joint.{name}", each) for name, each in _table("joint", told.get("joint", {})).items()}
    return HandDescription(
        name=_text("name", told.get("name", place.stem)),
        model=model,
        packages={name: place.parent / validate.path(f"packages.{name}", each) for name, each in packages.items()},
        root=None if "root" not in told else _text("root", told["root"]),
        position=_optional(validate.place, "position", told),
        quaternion=_optional(validate.quaternion, "quaternion", told),
        grasp_centre=_optional(validate.place, "grasp_centre", told),
        workspace=_workspace(told.get("workspace", 0.128)),
        opening=validate.array("opening", told.get("opening", (0.0, 0.0, 0.0)), (3,), bound=1.0),
        wrist_centre=_optional(validate.place, "wrist_centre", told),
        fingers=tuple(fingers),
        capsules=capsules,
        along=validate.integer("along of patches", lattice.get("along", 2), 1, 100),
        around=validate.integer("around of patches", lattice.get("around", 4), 1, 100),
        taxels=taxels,
        joints=joints,
    )


def joint_keys(name: str, told: Mapping[str, Any], slides: bool) -> None:
    """Check the keys of a joint.

    Args:
        name: of the joint.
        told: what is said of it.
        slides: whether it slides, else it turns.

    Raises:
        ValueError: for one that such a joint has not.
    """
    _keys(f"joint.{name}, which {'slides' if slides else 'turns'},", told, SLIDE if slides else HINGE)


def _finger(told: Mapping[str, Any]) -> Finger:
    _keys("finger", told, FINGER)
    name = _text("name of a finger", _wanted("finger", told, "name"))
    bodies, geoms = _names(f"bodies of finger {name!r}", told), _names(f"geoms of finger {name!r}", told, "geoms")
    return Finger(name, bodies, geoms, validate.boolean(f"tip of finger {name!r}", told.get("tip", True)))


def _capsule(index: int, told: Mapping[str, Any]) -> ToldCapsule:
    what = f"capsule {index + 1}"
    _keys(what, told, CAPSULE)
    start, end = (validate.place(f"{key} of {what}", _wanted(what, told, key)) for key in ("start", "end"))
    radius = validate.number(f"radius of {what}", _wanted(what, told, "radius"), THINNEST, THICKEST, unit="m")
    return ToldCapsule(_text(f"body of {what}", _wanted(what, told, "body")), start, end, radius)


def _taxel(index: int, told: Mapping[str, Any]) -> ToldTaxel:
    what = f"taxel {told['name']!r}" if isinstance(told.get("name"), str) else f"taxel {index + 1}"
    _keys(what, told, TAXEL)
    normal = validate.array(f"normal of {what}", _wanted(what, told, "normal"), (3,), bound=1e3)
    length = float((normal @ normal) ** 0.5)
    if length < 1e-6:
        raise ValueError(f"normal of {what} must not be zero, got {normal.tolist()}")
    return ToldTaxel(
        _text(f"name of {what}", told.get("name", f"taxel{index + 1}")),
        _text(f"body of {what}", _wanted(what, told, "body")),
        validate.place(f"position of {what}", _wanted(what, told, "position")),
        normal / length,
        validate.number(f"radius of {what}", told.get("radius", FEELS), THINNEST, THICKEST, unit="m"),
    )


def _check_taxels(taxels: tuple[ToldTaxel, ...], bodies: list[str]) -> None:
    if not 0 < len(taxels) <= MOST_TAXELS:
        raise ValueError(f"[[taxel]] must list 1 to {MOST_TAXELS} places that feel, got {len(taxels)}")
    for taxel in taxels:
        validate.choice(f"body of taxel {taxel.name!r}, of those of fingers and palm,", taxel.body, bodies)
    names = [each.name for each in taxels]
    twice = next((name for name in names if names.count(name) > 1), None) if len({*names}) < len(names) else None
    if twice is not None:
        raise ValueError(f"two taxels have the name {twice!r}")


def _keys(what: str, told: Mapping[str, Any], valid: tuple[str, ...]) -> None:
    for key in told:
        validate.choice(f"key of {what}", key, valid)


def _wanted(what: str, told: Mapping[str, Any], key: str) -> Any:
    if key not in told:
        raise ValueError(f"{what} has no {key}")
    return told[key]


def _table(what: str, value: Any, valid: tuple[str, ...] | None = None) -> Mapping[str, Any]:
    if not isinstance(value, dict):
        raise ValueError(f"{what} must be a table, [{what}], got {validate.shown(value)}")
    if valid is not None:
        _keys(what, value, valid)
    return value


def _tables(what: str, value: Any) -> list[Mapping[str, Any]]:
    if not isinstance(value, list) or not all(isinstance(each, dict) for each in value):
        raise ValueError(f"{what} must be a list of tables, [[{what}]], got {validate.shown(value)}")
    return value


def _text(what: str, value: Any) -> str:
    if not isinstance(value, str) or not value or not value.isprintable():
        raise ValueError(f"{what} must be a text in a line, got {validate.shown(value)}")
    return value


def _names(what: str, told: Mapping[str, Any], key: str = "bodies") -> tuple[str, ...]:
    return () if key == "geoms" and key not in told else validate.names(what, told.get(key, []))


def _optional(check: Any, what: str, told: Mapping[str, Any]) -> Any:
    return None if what not in told else check(what, told[what])


def _workspace(value: Any) -> Array:
    size = [value] * 3 if isinstance(value, int | float) else value
    edges = validate.array("workspace", size, (3,), "m", bound=1.0)
    if edges.min() < 0.02:
        raise ValueError(f"workspace must be edges of 0.02 to 1 m, got {validate.shown(value)}")
    return edges
