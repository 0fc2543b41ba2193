"""Hands of one's own for tests: the gripper of the examples with changes, and small ones made here."""

from __future__ import annotations

from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
GRIPPER = ROOT / "examples" / "gripper"

PARALLEL = """
<mujoco model="parallel"><worldbody><body name="base" pos="0 0 -0.08">
  <geom type="box" size="0.02 0.04 0.02"/>
  {extra}
  <body name="left" pos="0 -0.04 0.06"><joint name="left_slide" type="slide" axis="0 1 0" range="0 0.03"/>
    <geom name="left_pad" type="box" size="0.008 0.004 0.03"/></body>
  <body name="right" pos="0 0.04 0.06"><joint name="right_slide" type="slide" axis="0 -1 0" range="0 0.03"/>
    <geom name="right_pad" type="box" size="0.008 0.004 0.03"/></body>
</body></worldbody>{after}</mujoco>
"""
PARALLEL_TOML = """
model = "parallel.xml"
grasp_centre = [0.0, 0.0, 0.0]
[[finger]]
name = "left"
bodies = ["left"]
[[finger]]
name = "right"
bodies = ["right"]
"""


def gripper(folder: Path, *changes: tuple[str, str], more: str = "", model: str = "gripper.xml") -> Path:
    """The gripper's files in `folder`: of its TOML, texts replaced by others, and more at its end."""
    for name in ("gripper.xml", "gripper.urdf"):
        (folder / name).write_text((GRIPPER / name).read_text())
    text = (GRIPPER / "gripper.toml").read_text().replace('"gripper.xml"', f'"{model}"')
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new)
    path = folder / "gripper.toml"
    path.write_text(text + more)
    return path


def parallel(folder: Path, extra: str = "", after: str = "", more: str = "") -> Path:
    """A parallel gripper of two slides, with more in its base, after its bodies and in its TOML."""
    (folder / "parallel.xml").write_text(PARALLEL.format(extra=extra, after=after))
    path = folder / "parallel.toml"
    path.write_text(PARALLEL_TOML + more)
    return path


def taxels(count: int = 3) -> str:
    """Taxels along the palmar side of each distal body of the gripper, in place of its lattice."""
    each = (
        f'\n[[taxel]]\nname = "{finger}{row}"\nbody = "{finger}_distal"\n'
        f"position = [-0.0085, 0.0, {0.008 + 0.008 * row}]\nnormal = [-1.0, 0.0, 0.0]\nradius = 0.004\n"
        for finger in ("thumb", "left", "right")
        for row in range(count)
    )
    return "".join(each)
