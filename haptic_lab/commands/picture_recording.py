"""Draw a person's hand on an object at a few moments, the patches that feel it lit, and the map that the observer had
built from them by then (the paper's Figure 1). The object's pose must be known, as it is in motion capture.
"""

from __future__ import annotations

import argparse
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from haptic_env import hand_env, validate
from haptic_env.pose import Pose
from haptic_env.recordings import Recording
from haptic_env.rendering import without_opengl
from haptic_env.replay import KinematicReplay
from haptic_lab import recorded, replay
from haptic_lab.exploration.settings import DEFAULTS, OBSERVER, ExplorationSettings
from haptic_lab.files import atomic, check_writable
from haptic_lab.folder_lock import made
from haptic_lab.style import OCCUPANCY, styled
from haptic_lab.terminal import Parser, as_path
from haptic_lab.trial import Trial, make_observers
from haptic_lab.worlds import HANDS_OR_IDS, environment
from observer import Belief, metrics

EXAMPLE = "example: haptic-slam picture-recording --recording inspect.npz --mesh cube.stl --at 0.8 1.3 2"
WIDTH, HEIGHT = 480, 400  # pixels of one panel
THIN, GLASS = 0.6, 0.2  # how much of the object is seen beneath a hand, and about a map
LARGER = 1.7  # a touching patch in a picture this small
UNKNOWN = 0.5  # where the hand never came near
LONGEST = 36_000.0  # seconds
PICTURES = (".jpg", ".pdf", ".png", ".svg")
LEAST = 0.15  # probability from which on a voxel is drawn; that of one that was never touched is 0.03 or 0.5


@styled
def main(arguments: list[str] | None = None) -> int:
    """Run the command.

    Args:
        arguments: of the command line; None: those of this process.

    Returns:
        Its exit code.
    """
    parser = Parser(description=__doc__, epilog=EXAMPLE, formatter_class=argparse.RawDescriptionHelpFormatter)
    add = parser.add_argument
    add("--recording", required=True, metavar="FILE", help="motion capture, .npz")
    add("--mesh", "--shape", required=True, metavar="FILE", help="the object that was held")
    add("--hand", help=f"whose joints it has: {HANDS_OR_IDS} (default: the one that has them)")
    add("--at", nargs="+", type=float, default=[0.8, 1.3, 2.0], help="moments, s (default 0.8 1.3 2)")
    add("--sigma", type=float, default=3.0, help="noise of the felt joint angles, SD in degrees (default 3)")
    add("--seed", type=int, default=0, help="of the noise (default 0)")
    add("--view", nargs=2, type=float, default=[150.0, 30.0], help="azimuth and elevation, degrees (default 150 30)")
    add("--out", type=as_path, default="out/recording.png", help="the picture (default out/recording.png)")
    given = parser.parse_args(arguments)
    try:
        for moment in given.at:
            validate.number("--at", moment, 0.0, LONGEST, unit="s")
        for angle in given.view:
            validate.number("--view", angle, -360.0, 360.0, unit="degrees")
        validate.choice("kind of picture in --out", Path(given.out).suffix.lower(), PICTURES)
        recording = recorded.load(given.recording, None, None, None)
        if not isinstance(recording, Recording):
            parser.error(f"{given.recording}: the recording does not say where the hand and the object were")
        env = recorded.environment_of(recording) if given.hand is None else environment(given.hand)
        told = {"env": env, "shape": given.mesh, "sigma": given.sigma}
        more: dict[str, Any] = {"seconds": None, "policy": "random_torque", "out": given.out, "seed": given.seed}
        settings = ExplorationSettings(**{**DEFAULTS, **told, **more})
        session = replay.session(settings, recording, render_mode="rgb_array")
        if not isinstance(session.env, KinematicReplay):
            parser.error(f"{given.recording}: the recording does not say where the hand and the object were")
        with ExitStack() as stack:
            try:
                stack.enter_context(made(Path(given.out).parent))
            except OSError as error:
                parser.error(f"--out must be in a folder that can be written to: {error}")
            check_writable("--out", Path(given.out))
            picture(Path(given.out), session, settings, sorted(given.at), *given.view)
    except (ImportError, ValueError, OSError) as error:
        parser.error(str(error))
    return 0


def picture(
    path: Path,
    session: replay.ExplorationSession,
    settings: ExplorationSettings,
    moments: list[float],
    azimuth: float,
    elevation: float,
) -> None:
    """Replay a recording, and draw what is seen at some moments.

    Args:
        path: of the picture.
        session: the replay, with a render mode.
        settings: of the exploration.
        moments: s, at which it is drawn.
        azimuth: degrees about the object's z, from where it is seen.
        elevation: degrees above the object.
    """
    env: Any = session.env
    told = {"control_hz": hand_env(env).control_hz, **settings.believed_noise, **session.told, **session.informed}
    observers = make_observers((OBSERVER,), session.hand, particles=settings.particles, **told)
    trial = Trial(env, session.policy, observers, session.namer, settings.seed)
    steps = {min(max(1, round(moment * env.control_hz)), trial.steps) for moment in moments}
    drawn: list[tuple[int, NDArray[np.uint8], NDArray[np.uint8]]] = []
    for step in trial:
        if step in steps:
            belief = trial.observer_runs[OBSERVER].belief
            drawn.append((step, render(env, azimuth, elevation, None), render(env, azimuth, elevation, belief)))
    exploration, traces = trial.finish()
    trace = traces[OBSERVER]
    wrong = metrics.pose_rmse_deg(trace.lagged_joint_angles, exploration.true_angles)
    raw = metrics.pose_rmse_deg(exploration.felt_angles, exploration.true_angles)
    figure = Figure(figsize=(3.2 * len(drawn), 5.6), layout="constrained")
    panels = figure.subplots(2, len(drawn), squeeze=False)
    for column, (step, hand, seen) in enumerate(drawn):
        above, below = panels[:, column]
        above.imshow(hand)
        below.imshow(seen)
        above.set_title(f"{step / env.control_hz:.1f} s")
        for axes in (above, below):
            axes.set(xticks=[], yticks=[])
            axes.spines[:].set_visible(False)
    panels[0, 0].set_ylabel("the person's hand,\ntouching patches red", fontsize=10)
    panels[1, 0].set_ylabel("what the observer has mapped,\nin the true object", fontsize=10)
    figure.suptitle(
        f"“A {trace.name}”, {trace.posterior[-1].max():.0%} sure: joint angles felt to {raw:.1f}°, "
        f"inferred to {wrong:.1f}°",
        fontsize=12,
        fontweight="bold",
    )
    with atomic(path) as place:
        figure.savefig(place, dpi=110)


def render(env: Any, azimuth: float, elevation: float, belief: Belief | None) -> NDArray[np.uint8]:
    """Draw the scene as it is now.

    Args:
        env: the replay.
        azimuth: degrees, as `picture`'s.
        elevation: degrees, as `picture`'s.
        belief: whose occupied voxels are drawn in place of the hand; None: the hand.

    Returns:
        (H, W, 3) the picture.

    Raises:
        OSError: where there is no OpenGL; it says how to get it.
    """
    model, data = env.simulation
    body = model.body("object").id
    kept = model.geom_rgba.copy(), model.site_rgba.copy()
    model.site_size[env.touched, 0] *= LARGER
    model.geom_rgba[model.geom_bodyid == body, 3] = THIN if belief is None else GLASS
    if belief is not None:
        model.geom_rgba[model.geom_bodyid != body, 3] = model.site_rgba[:, 3] = 0.0
    # The scene's own light stands still while the object turns.
    model.light_active[:] = False
    model.vis.headlight.ambient[:], model.vis.headlight.diffuse[:] = 0.55, 0.5
    solid = Pose.of(env.solid.position, env.solid.quaternion)
    frame = Pose(data.xpos[body].copy(), data.xmat[body].reshape(3, 3).copy()) @ solid.inverse()
    try:
        renderer = mujoco.Renderer(model, HEIGHT, WIDTH, max_geom=20_000)
    except Exception as error:  # OpenGL fails in many ways
        raise OSError(f"picture-recording {without_opengl(error)}") from error
    with renderer:
        renderer.update_scene(data)
        look_from(renderer.scene, frame, env.solid, azimuth, elevation)
        if belief is not None:
            add_voxels(renderer.scene, frame, belief)
        image = renderer.render().copy()
    model.geom_rgba[:], model.site_rgba[:] = kept
    return image


def look_from(scene: mujoco.MjvScene, frame: Pose, solid: Any, azimuth: float, elevation: float) -> None:
    """Turn the eyes of a scene to the object.

    Args:
        scene: that is drawn.
        frame: of the object, in the world.
        solid: the object, in its frame.
        azimuth: degrees, in the object's frame.
        elevation: degrees, in the object's frame.
    """
    turn, rise = np.deg2rad([azimuth, elevation])
    away = np.array([np.cos(rise) * np.cos(turn), np.cos(rise) * np.sin(turn), np.sin(rise)])
    up = np.array([-np.sin(rise) * np.cos(turn), -np.sin(rise) * np.sin(turn), np.cos(rise)])
    eye = np.asarray(solid.position) + 3.9 * max(solid.size) * away
    for camera in scene.camera:
        camera.pos[:] = frame.position + frame.rotation @ eye
        camera.forward[:] = frame.rotation @ -away
        camera.up[:] = frame.rotation @ up


def add_voxels(scene: mujoco.MjvScene, frame: Pose, belief: Belief) -> None:
    """Put a box for every voxel that touch has made probable, the darker the surer.

    Args:
        scene: to put it into.
        frame: of the object, in the world.
        belief: whose map, in the object's frame.
    """
    half = 0.5 * belief.grid.resolution
    touched = (belief.occupancy > LEAST) & (belief.occupancy != UNKNOWN)
    for centre, sure in zip(belief.grid.centres()[touched], belief.occupancy[touched], strict=True):
        colour = np.array(OCCUPANCY(0.2 + 0.8 * sure), dtype=np.float32)
        mujoco.mjv_initGeom(
            scene.geoms[scene.ngeom],
            mujoco.mjtGeom.mjGEOM_BOX,
            np.full(3, half),
            frame.position + frame.rotation @ centre,
            frame.rotation.ravel(),
            colour,
        )
        scene.ngeom += 1
