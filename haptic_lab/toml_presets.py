"""What ships as TOML files and may also be a file of one's own: it is told by its name, or by the path of that file."""

from __future__ import annotations

from pathlib import Path

from haptic_env import validate


def names(folder: Path) -> list[str]:
    """List what ships.

    Args:
        folder: of the files.

    Returns:
        Their names, sorted.
    """
    return sorted(path.stem for path in folder.glob("*.toml"))


def path_of(what: str, name: str, folder: Path) -> Path:
    """Find a file.

    Args:
        what: it describes, for the message.
        name: of one that ships, or the path of a TOML file.
        folder: of those that ship.

    Returns:
        Its path.

    Raises:
        ValueError: for a name that is neither; it lists those that ship.
    """
    return Path(name) if name.endswith(".toml") else folder / f"{validate.choice(what, name, names(folder))}.toml"
