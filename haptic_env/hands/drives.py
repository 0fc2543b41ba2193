"""What moves the joints of human fingers, shared by the hands.

Damping and stiffness are of the size measured at the index MCP joint by Hajian & Howe 1997 (J. Biomech. Eng. 119,
109-114); the pull to the relaxed, half-flexed posture is passive tissue. Those of the wrist are of the order that
Formica et al. 2012 measured (J. Neurophysiol. 108, 1158-1166). Weight is taken as borne by posture: there is no
gravity. With these torque limits the random policy moves the joints at human speeds (see tests), and turns a wrist by
some ten degrees.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from haptic_env.composer import mjcf


class Drive(NamedTuple):
    """A motor, and the passive tissue about its joint.

    Attributes:
        torque: N·m at most.
        damping: N·m·s/rad.
        stiffness: N·m/rad, of the tissue.
        relaxed: degrees, the angle to which the tissue pulls.
    """

    torque: float
    damping: float
    stiffness: float
    relaxed: float


MCP_ABDUCTION = Drive(0.030, 0.0080, 0.050, 0.0)
MCP_FLEXION = Drive(0.040, 0.0090, 0.025, 15.0)
PIP_FLEXION = Drive(0.016, 0.0040, 0.012, 30.0)
DIP_FLEXION = Drive(0.008, 0.0020, 0.008, 25.0)
THUMB_BASE = Drive(0.040, 0.0090, 0.040, 0.0)
WRIST = Drive(0.100, 0.0300, 0.300, 0.0)


def add_joint(tree: mjcf.RootElement, body: Any, name: str, drive: Drive, **attributes: Any) -> None:
    """Add a hinge and its motor to a body.

    Args:
        tree: the hand's MJCF.
        body: of the tree, gets the hinge.
        name: of hinge and motor.
        drive: what moves it.
        **attributes: of the hinge; angles in the unit of the tree's compiler.
    """
    degrees = tree.compiler.angle != "radian"
    hinge = body.add(
        "joint",
        name=name,
        damping=drive.damping,
        stiffness=drive.stiffness,
        springref=drive.relaxed if degrees else np.deg2rad(drive.relaxed),
        armature=1e-6,
        solreflimit=(0.006, 1),
        solimplimit=(0.98, 0.99, 0.01),
        **attributes,
    )
    tree.actuator.add("motor", name=name, joint=hinge, gear=[drive.torque], ctrllimited=False)
