"""Let a blind hand explore a hidden object, watch what the observer believes, and name the object.

Writes explore.png (the map over the true shape, pose error and posterior through time), explore.json (the figures),
explore.npz (belief and trace) and recording.npz (what was done and felt, for --recording) to --out.
"""

from __future__ import annotations

import argparse
from contextlib import closing
from functools import cache
from pathlib import Path
from typing import Any

from rich.console import Console

import agents
from haptic_env import hand_env, recordings, registration, shapes
from haptic_env.recordings import MeasuredTouch, Recording
from haptic_env.shapes import Solid
from haptic_lab import believed, conditions, kept, recorded, replay
from haptic_lab.conditions import TRUST
from haptic_lab.exploration import learnt, measured, playing, senses, surface
from haptic_lab.exploration.output import picture, save_trace
from haptic_lab.exploration.run import begin, explore, make_trial
from haptic_lab.exploration.settings import DEFAULTS, OBSERVER, ExplorationSettings
from haptic_lab.exploration.summary import summarise, table
from haptic_lab.files import atomic, write_json
from haptic_lab.folder_lock import claimed
from haptic_lab.style import styled, titles_of, with_article
from haptic_lab.terminal import Parser, Renamed, as_path, make_console, tell_error
from haptic_lab.view import options
from haptic_lab.view.trial_view import TrialView, verdict
from haptic_lab.view.viewer import Viewer, opened
from haptic_lab.warm_up import get_ready, told_on
from haptic_lab.worlds import HANDS_OR_IDS, SETS, WRISTS, environment, expanded, in_set, typed_shape
from observer.surface import files

EXAMPLE = """examples: haptic-slam explore --shape pyramid --sigma 5 --seed 3 --out out/pyramid
          haptic-slam replay inspect.npz --mesh cube.stl
          haptic-slam replay glove.txt --hand adroit --object sphere
          haptic-slam replay glove.csv --hand adroit --columns map.toml"""

FILES = ("explore.png", "explore.json", "explore.npz", "recording.npz", surface.PICTURE)
RECORDING = f"let the hand repeat this recording: the .txt of a CyberGlove, or {', '.join(recordings.FOREIGN)}"


def parse(
    arguments: list[str] | None,
    recording: str = "--recording",
    description: str | None = __doc__,
    example: str = EXAMPLE,
    learning: bool = False,
) -> tuple[ExplorationSettings, Recording | MeasuredTouch | None]:
    """Read and check the command line, and the recording that it names; ends the program with code 2 where either makes
    no sense.

    Args:
        arguments: of the command line; None: those of this process.
        recording: how the command is told of the recording: a flag, or the name of a positional argument.
        description: of the command, for its help.
        example: for its help.
        learning: whether the object is learnt under a name.

    Returns:
        What is explored, and the recording that the hand repeats, if it does.
    """
    parser = Parser(description=description, epilog=example, formatter_class=argparse.RawDescriptionHelpFormatter)
    add = parser.add_argument
    add("--env", "--hand", help=f"{HANDS_OR_IDS} (default two_finger, or the one that the recording is of)")
    add("--wrist", help=WRISTS)
    add(
        "--shape",
        "--object",
        type=typed_shape,
        help=f'{", ".join(shapes.SHAPES)}, "ellipsoid(1, 1, 1.3)" and such ({", ".join(shapes.FAMILIES)}), a mesh, '
        "a name of --objects, or module:Class (default: drawn at random, hidden until the end)",
    )
    written = "as --save-mesh, beside --shape or where there is no such file"
    add("--mesh", type=as_path, metavar="FILE", help=f"the object, from a mesh file; {written}")
    named = "what the object may be, shapes or sets, each at its own size (default: the four shapes, and --shape)"
    add("--candidates", type=typed_shape, nargs="+", metavar="SHAPE", help=named)
    add("--objects", type=as_path, metavar="SET", help=f"what it may be, and what is drawn from: {SETS}")
    add("--none", type=float, default=0.0, help="prior probability that it is none of these (default 0)")
    add("--scale", type=float, help="metres that the unit of a mesh file is long (default 1)")
    add("--sigma", type=float, help="noise of the felt joint angles, SD in degrees (default 3)")
    learnt.add_flags(add, learning)
    conditions.add_flags(add, "as the environment's keyword; observers are told")
    believed.add_flags(add)
    seconds = 20 if learning else 10
    add("--seconds", type=float, help=f"how long to explore, or to replay (default {seconds}, or the whole recording)")
    add("--particles", type=int, help="hypotheses of the observer (default 200)")
    add(
        "--policy",
        type=as_path,
        help=f"{', '.join(agents.POLICIES)}, or a trained model.npz; a .zip needs --trust (default random_torque)",
    )
    add("--trust", action="store_true", help=TRUST)
    add("--seed", type=int, help="the same seed is the same exploration (default 0)")
    add(recording, type=as_path, metavar="FILE", help=RECORDING)
    add("--part", metavar="NAME", help="which recording, of a file that holds several")
    add(
        "--glove-calibration",
        type=as_path,
        metavar="FILE",
        help="TOML: what the sensors of a glove mean (default: as for GraspDB14)",
    )
    meaning = "TOML: which column is which joint, and which taxel which patch (docs/recordings.md)"
    add("--columns", type=as_path, metavar="FILE", help=meaning)
    add("--calibration", dest="glove_calibration", type=as_path, action=Renamed, help=argparse.SUPPRESS)
    add("--save-offsets", type=as_path, metavar="FILE", help="keep the offsets of felt angles that were found, as TOML")
    written = (
        f"write the surface that was felt ({', '.join(files.WRITERS)}), and its picture, {surface.PICTURE}, to --out"
    )
    add("--save-mesh", type=as_path, metavar="FILE", help=written)
    out = "out/learn" if learning else "out/explore"
    add("--out", type=as_path, default=out, help=f"folder for the results (default {out})")
    options.add_flags(add)
    given = vars(parser.parse_args(arguments))
    source = given.pop("recording"), given.pop("part"), given.pop("glove_calibration")
    columns = given.pop("columns")
    found: Recording | MeasuredTouch | None = None
    usual = {**DEFAULTS, **dict.fromkeys(learnt.JITTER, 0.0), "policy": "random_torque"}
    try:
        given["view"] = options.ViewOptions.taken(given)
        surface.resolve(given, recorded=source[0] is not None)
        learnt.resolve(given)
        if given["env"] is not None:
            given["env"] = environment(given["env"])
        _resolve_objects(given)
        if source[0] is not None:
            found = recorded.load(*source, given["env"] and registration.hand_name(given["env"]), columns)
            playing.refuse_exploring(given["wrist"], given["policy"])
            if isinstance(found, MeasuredTouch):
                playing.refuse_noise(given)
                usual["env"] = environment(found.hand.source or found.hand.name)
            else:
                usual |= playing.told_by(found, given)
        elif any(source) or columns:
            parser.error("--part, --columns and --glove-calibration say how to read a --recording, which is not given")
        elif learning and given["seconds"] is None:
            given["seconds"] = float(seconds)
        told: dict[str, Any] = {name: usual.get(name) if value is None else value for name, value in given.items()}
        settings = ExplorationSettings(**told)
    except (ValueError, ImportError) as error:
        parser.error(str(error))
    except OSError as error:
        parser.error(f"--recording cannot be read: {error}")
    return settings, found


def _resolve_objects(given: dict[str, Any]) -> None:
    """Put names of shapes in the place of sets, and of what an object is called in one; raises `ValueError`."""
    if given["objects"] is not None:
        if given["candidates"] is not None:
            raise ValueError("--objects says what the object may be, and so does --candidates: say one of them")
        if given["shape"] is not None:
            given["shape"] = in_set(given["shape"], given["objects"])
        expanded(shapes.read_set(given["objects"]), trust=given["trust"])
    if given["candidates"] is not None:
        given["candidates"] = expanded(given["candidates"], trust=given["trust"])


@styled
def main(arguments: list[str] | None = None) -> int:
    """Run the command.

    Args:
        arguments: of the command line; None: those of this process.

    Returns:
        Its exit code.
    """
    settings, recording = parse(arguments)
    with claimed(Path(settings.out), FILES):
        return run(settings, recording)


def run(settings: ExplorationSettings, recording: Recording | MeasuredTouch | None) -> int:
    """Explore, and write what came of it to the folder of the settings, which is claimed.

    Args:
        settings: of the exploration.
        recording: that the hand repeats, if it does.

    Returns:
        Exit code: 2 where they do not fit together, 130 where Ctrl-C cut it short.
    """
    console = make_console()
    try:
        viewer = opened(settings.view, console)
    except ValueError as error:  # a port that is taken
        tell_error(str(error))
        return 2
    if viewer is None:
        return _run(settings, recording, console, None)
    with closing(viewer):
        code = _run(settings, recording, console, viewer)
        if code == 0:
            viewer.stay(console)
        return code


def _run(
    settings: ExplorationSettings,
    recording: Recording | MeasuredTouch | None,
    console: Console,
    viewer: Viewer | None,
) -> int:
    try:
        with told_on(console):
            session = begin(settings, recording)
            if settings.objects is not None and settings.shape is None:
                session.env.reset(seed=settings.seed)  # as it will be: what is drawn is made ready where that is seen
    except (ValueError, ImportError) as error:  # what does not fit the recording, a hand that is not installed
        tell_error(str(error))
        return 2
    played = isinstance(recording, Recording) and recording.felt is not None
    found = recording is None or (played and session.told.get("motion") != "kinematic")
    if settings.save_offsets is not None and not found:
        tell_error("--save-offsets: a recording without torques and what was felt tells nothing of its offsets")
        return 2
    get_ready(console, session.hand)
    try:
        trial = make_trial(settings, session)
    except ValueError as error:  # a policy that is not for this hand
        tell_error(str(error))
        return 2
    what = "a hidden object"
    if settings.shape:
        what = with_article(titles_of((*session.candidates, settings.shape))[settings.shape])
    base = hand_env(session.env)
    seconds = base.episode_steps / base.control_hz
    how = f", as in {recording.source}" if recording else ""
    console.print(f"Exploring {what} by blind touch for {seconds:g} s{how} …", highlight=False)
    if session.measured is not None:
        console.print(f"Touch was measured: {session.measured.coverage}.", highlight=False)
    if session.simulated:
        console.print(f"No object was recorded: contacts are simulated with {what}, as you named it.", highlight=False)

    @cache  # a library is read for it
    def right(solid: Solid) -> str:
        return learnt.truth(settings, solid, session.candidates, session.namer.none > 0.0)

    view = None if viewer is None else TrialView(viewer, trial, f"Blind touch of {what}", right)
    try:
        exploration, traces, took, stopped = explore(trial, console, view)
    except ValueError as error:  # an object that this hand cannot hold
        tell_error(str(error))
        return 2
    if viewer is not None:
        viewer.finish(verdict(traces[OBSERVER].posterior[-1], traces[OBSERVER].labels), console)
    if session.measured is not None:
        measured.finish(settings, exploration, traces, took, session.measured, console)
        learnt.tell(console, settings, exploration, traces[OBSERVER])
        return 130 if stopped else 0
    truth = right(exploration.solid)
    summary = summarise(settings, exploration, traces, truth, took, session.simulated)
    out = Path(settings.out)
    picture(out / "explore.png", exploration, traces, summary)
    save_trace(out / "explore.npz", exploration, traces)
    if settings.save_mesh is not None:
        summary["mesh"] = surface.write(Path(settings.save_mesh), out, exploration, traces[OBSERVER])
    write_json(out / "explore.json", summary)
    with atomic(out / "recording.npz") as place:
        remembered = (*DEFAULTS, *learnt.JITTER)
        told = {name: getattr(settings, name) for name in remembered} | (replay.SIMULATED if session.simulated else {})
        recordings.write(place, kept.as_recording(exploration, told, session.followed))
    console.print(table(summary))
    senses.tell(console, summary)
    if settings.save_mesh is not None:
        surface.tell(console, summary["mesh"], settings.save_mesh, out)
    senses.save(settings, summary, f"{settings.env}, seed {settings.seed}")
    files = "explore.json, explore.npz, recording.npz"
    console.print(f"Picture, figures, trace and recording: {out / 'explore.png'}, {files}", highlight=False)
    learnt.tell(console, settings, exploration, traces[OBSERVER])
    if stopped:
        console.print("Stopped early: this is what was explored until then.", highlight=False)
    return 130 if stopped else 0
