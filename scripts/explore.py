"""Let a blind hand explore a hidden object, watch what the observer believes, and name the object.

Writes explore.png (the map over the true shape, pose error and posterior through time), explore.json (the figures),
explore.npz (belief and trace) and recording.npz (what was done and felt, for --recording) to --out.
"""

from __future__ import annotations

import argparse
import math
import signal
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # while modules are loaded Ctrl-C ends it without a word

import gymnasium as gym
import numpy as np
import recorded
from claim import claimed
from conditions import check_policy
from drawing import SIDES, draw_map, draw_pose_error, draw_posterior, map_legend
from files import atomic, write_json
from getting_ready import get_ready
from matplotlib.figure import Figure
from rich.bar import Bar
from rich.console import Console, Group
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text
from style import OBSERVER_COLOURS, as_drawn, colours_of, titles_of
from terminal import Parser as Parser  # other commands take these two from here
from terminal import as_path, make_console, tell_error
from terminal import program as program
from trial import Account, Exploration, Trial, candidates_of, guided, make_observers

import agents
import haptic_env
from haptic_env import recordings, shapes, validate
from haptic_env.hand import Hand
from haptic_env.recordings import Recording
from observer import ShapePosterior, metrics
from observer.variants import Observer

EXAMPLE = """examples: python scripts/explore.py --shape pyramid --sigma 5 --seed 3 --out out/pyramid
          python scripts/explore.py --recording inspect.npz --mesh cube.stl
          python scripts/explore.py --recording glove.txt --hand adroit --shape sphere"""
OBSERVER, RAW = "haptic_slam", "floor"
HANDS_OR_IDS = f"{', '.join(haptic_env.ENVIRONMENTS.values())}, or the id of an environment"
TRUST = "run what a model.zip has in it, as you would run a program of whoever made it (docs/learning.md)"
SECONDS = 10.0
DEFAULTS: dict[str, Any] = {
    "env": "HapticSLAM/TwoFinger-v0",
    "shape": None,
    "scale": 1.0,
    "sigma": 3.0,
    "particles": 200,
    "seed": 0,
}
WITHIN = ((1, "1 voxel"), (2, "2 voxels"))


@dataclass(frozen=True)
class Settings:
    """What the command line asks for; `shape` None is a hidden one."""

    env: str
    shape: str | None
    scale: float
    sigma: float
    seconds: float | None  # None: 10, or as long as the recording
    particles: int
    policy: str
    seed: int
    out: str
    trust: bool = False

    def __post_init__(self) -> None:
        validate.choice("--env", self.env, haptic_env.ENVIRONMENTS)
        if self.shape is not None:
            shapes.default_size(shapes.check("--shape", self.shape), self.scale)
        validate.number("--scale", self.scale, above=0.0, unit="m")
        validate.number("--sigma", self.sigma, 0.0, 90.0, unit="degrees")
        if self.seconds is not None:
            validate.number("--seconds", self.seconds, 0.0, 3600.0, above=0.0, unit="s")
        validate.integer("--particles", self.particles, 1, 100_000)
        check_policy(self.policy, self.trust)
        validate.integer("--seed", self.seed, 0, 2**32 - 1)


def environment(name: str) -> str:
    """The id of the environment `name`, which may be said by its hand alone; raises `ValueError` for neither."""
    of_hand = {hand: env_id for env_id, hand in haptic_env.ENVIRONMENTS.items()}
    return of_hand.get(validate.choice("--hand or --env", name, (*of_hand, *haptic_env.ENVIRONMENTS)), name)


def parse(arguments: list[str] | None) -> tuple[Settings, Recording | None]:
    """Read and check the command line, and the recording that it names; ends the program with code 2 where either
    makes no sense."""
    parser = Parser(description=__doc__, epilog=EXAMPLE, formatter_class=argparse.RawDescriptionHelpFormatter)
    add = parser.add_argument
    add("--env", "--hand", help=f"{HANDS_OR_IDS} (default two_finger, or the one that the recording is of)")
    add(
        "--shape",
        "--mesh",
        type=as_path,
        help=f"{', '.join(shapes.SHAPES)}, or a mesh file (default: drawn at random, hidden until the end)",
    )
    add("--scale", type=float, help="metres that the unit of a mesh file is long (default 1)")
    add("--sigma", type=float, help="noise of the felt joint angles, SD in degrees (default 3)")
    add("--seconds", type=float, help="how long to explore (default 10, or as long as the recording)")
    add("--particles", type=int, help="hypotheses of the observer (default 200)")
    add(
        "--policy",
        type=as_path,
        default="random_torque",
        help=f"{', '.join(agents.POLICIES)}, or a trained model.npz; a .zip needs --trust (default random_torque)",
    )
    add("--trust", action="store_true", help=TRUST)
    add("--seed", type=int, help="the same seed is the same exploration (default 0)")
    add(
        "--recording",
        type=as_path,
        metavar="FILE",
        help="let the hand repeat this recording: .npz, or the .txt of a CyberGlove",
    )
    add("--part", metavar="NAME", help="which recording, of a file that holds several")
    add(
        "--calibration",
        type=as_path,
        metavar="FILE",
        help="TOML: what the sensors of a glove mean (default: as for GraspDB14)",
    )
    add("--out", type=as_path, default="out/explore", help="folder for the results (default out/explore)")
    given = vars(parser.parse_args(arguments))
    source = given.pop("recording"), given.pop("part"), given.pop("calibration")
    recording: Recording | None = None
    usual = dict(DEFAULTS)
    try:
        if given["env"] is not None:
            given["env"] = environment(given["env"])
        if source[0] is not None:
            recording = recorded.load(*source, haptic_env.ENVIRONMENTS.get(given["env"]))
            usual |= {name: value for name, value in recording.settings.items() if name in usual}
            if given["env"] is None and "env" not in recording.settings:
                usual["env"] = recorded.environment_of(recording)
        elif any(source):
            raise ValueError("--part and --calibration say how to read a --recording, which is not given")
        told: dict[str, Any] = {name: usual.get(name) if value is None else value for name, value in given.items()}
        settings = Settings(**told)
    except ValueError as error:
        parser.error(str(error))
    except OSError as error:
        parser.error(f"--recording cannot be read: {error}")
    return settings, recording


class Screen:
    """What is seen while the hand explores: a live panel on a terminal, else a line a second."""

    def __init__(self, console: Console, trial: Trial) -> None:
        self.console, self.trial = console, trial
        self.watcher = trial.watchers[OBSERVER]
        self.titles = titles_of(self.watcher.posterior)
        self.live = Live(console=console, refresh_per_second=8, transient=True) if console.is_terminal else None
        self._shown = time.monotonic()

    def __enter__(self) -> Screen:
        if self.live is not None:
            self.live.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self.live is not None:
            self.live.stop()

    def show(self, step: int) -> None:
        """Tell where the exploration stands after `step` steps."""
        seconds, each = step * self.trial.step_seconds, round(1.0 / self.trial.step_seconds)
        if self.live is not None and time.monotonic() - self._shown > 0.1:
            self._shown = time.monotonic()
            self.live.update(self._panel(seconds, step))
        elif self.live is None and step % each == 0:
            names = "  ".join(f"{self.titles[name]} {p:4.0%}" for name, p in self.watcher.posterior.items())
            self.console.print(f"{seconds:5.1f} s  Neff {self.watcher.belief.n_eff:6.1f}  {names}", highlight=False)

    def _panel(self, seconds: float, step: int) -> Group:
        count = len(self.watcher.belief.weights)
        head = Table.grid(padding=(0, 2))
        head.add_row(
            ProgressBar(self.trial.steps, step, width=30),
            f"{seconds:4.1f} s of {self.trial.steps * self.trial.step_seconds:g} s",
            f"Neff {self.watcher.belief.n_eff:.0f} of {count}",
        )
        bars = Table.grid(padding=(0, 2))
        colours = colours_of(self.watcher.posterior)
        for name, p in self.watcher.posterior.items():
            bars.add_row(self.titles[name], Bar(1.0, 0.0, p, width=30, color=colours[name]), f"{p:4.0%}")
        return Group(head, bars)


def begin(settings: Settings, recording: Recording | None) -> recorded.Session:
    """The environment, and who acts and names in it; raises `ValueError` where the recording does not fit."""
    if recording is not None:
        return recorded.session(settings, recording)
    env = gym.make(
        settings.env,
        shape=settings.shape,
        scale=settings.scale,
        sigma_deg=settings.sigma,
        episode_seconds=SECONDS if settings.seconds is None else settings.seconds,
        reveal_truth=True,  # for the observer's judge alone
    )
    hand: Hand = env.unwrapped.hand  # type: ignore[attr-defined]
    candidates = candidates_of(hand, shapes.SHAPES, like=settings.shape, scale=settings.scale)
    return recorded.Session(env, settings.policy, candidates, ShapePosterior(hand, candidates))


def explore(
    settings: Settings, session: recorded.Session, console: Console
) -> tuple[Exploration, dict[str, Account], float, bool]:
    """Run it: what happened, what the observers believed, how many seconds it took, and whether it was cut short."""
    stop = False

    def interrupt(*_: object) -> None:
        nonlocal stop
        stop = True
        signal.signal(signal.SIGINT, signal.default_int_handler)  # a second one ends it at once

    names = {RAW: session.told, OBSERVER: {**session.told, **session.informed}}
    observers: dict[str, Observer] = {}
    rate: float = session.env.unwrapped.control_hz  # type: ignore[attr-defined]
    for name, told in names.items():
        told = {"control_hz": rate, **told}
        observers |= make_observers((name,), session.hand, settings.sigma, settings.particles, **told)
    env = session.env
    if isinstance(session.policy, str):
        env = guided(env, session.policy, settings.sigma, session.namer)
    trial = Trial(
        env, session.policy, observers, session.namer, settings.seed, naming=(OBSERVER,), trust=settings.trust
    )
    usual = signal.signal(signal.SIGINT, interrupt)
    try:
        with Screen(console, trial) as screen:
            start = time.perf_counter()
            for step in trial:  # between two steps everything is whole
                screen.show(step)
                if stop:
                    break
        exploration, accounts = trial.finish()
        return exploration, accounts, time.perf_counter() - start, stop
    finally:
        signal.signal(signal.SIGINT, usual)
        session.env.close()


def summarise(
    settings: Settings,
    exploration: Exploration,
    accounts: dict[str, Account],
    truth: str,
    took: float,
    simulated: bool = False,
) -> dict[str, Any]:
    """The figures of one exploration, for people (`table`) and machines (explore.json) alike; `simulated` on an object
    that is not the recording's own, so that its name is nobody's truth."""
    slam, solid, roots = accounts[OBSERVER], exploration.solid, exploration.roots
    belief = slam.belief
    touched = metrics.touched_places(
        exploration.hand, exploration.true_angles, exploration.contacts, solid, roots=roots
    )
    touching = exploration.contacts.any(axis=1)

    def surface(name: str, voxels: float) -> dict[str, float]:
        score = metrics.surface_score(accounts[name].belief.occupancy, belief.grid, solid, touched, voxels)
        return score._asdict()

    def pose(angles: np.ndarray) -> dict[str, float]:
        error = metrics.pose_rmse_deg(angles, exploration.true_angles)
        return {"degrees": error, "sigmas": error / settings.sigma if settings.sigma > 0 else math.nan}

    cells = metrics.reachable(exploration.hand, exploration.true_angles, belief.grid, roots)
    calibration = metrics.reliability(belief.occupancy, solid.occupancy(belief.grid), cells)
    return {
        "settings": asdict(settings),
        "explored_seconds": float(exploration.seconds[-1]),
        "computing_seconds": took,
        "named": slam.name,
        "truth": None if simulated else truth,
        "correct": None if simulated else slam.name == truth,
        **({**recorded.SIMULATED, "simulated_object": truth} if simulated else {}),
        "posterior": dict(zip(slam.labels, map(float, slam.posterior[-1]), strict=True)),
        "time_to_decision": metrics.time_to_decision(exploration.seconds, slam.posterior),
        "touching_share": float(touching.mean()),
        "pose_error": {
            "raw angles": pose(exploration.felt_angles),
            "haptic SLAM, online": pose(slam.joint_angles),
            "haptic SLAM, lagged": pose(slam.lagged_joint_angles),
        },
        "coverage_90": metrics.credible_coverage(slam.joint_angles, slam.joint_std, exploration.true_angles),
        "surface": {label: {"raw angles": surface(RAW, n), "haptic SLAM": surface(OBSERVER, n)} for n, label in WITHIN},
        "surface_coverage": metrics.surface_coverage(belief.occupancy, belief.grid, solid),
        "occupancy_ece": calibration.ece,
        "occupancy_brier": calibration.brier,
    }


def table(summary: dict[str, Any]) -> Table:
    """The figures as a person reads them."""
    named, sure = summary["named"], summary["posterior"][summary["named"]]
    result = Table(
        show_header=False, title=f"After {summary['explored_seconds']:g} s of blind touch", title_justify="left"
    )
    result.add_column(style="dim")
    result.add_column()
    truth, simulated = _object(summary)
    titles = titles_of(summary["posterior"])
    mark = ("right", "green") if named == truth else ("wrong", "red")
    result.add_row("the object is a", Text(titles[named], style=f"bold {colours_of(summary['posterior'])[named]}"))
    result.add_row("how sure", f"{sure:.1%}")
    there = "contacts are simulated with a" if simulated else "in truth it is a"
    result.add_row(there, Text.assemble(titles[truth], " (", mark, ")"))
    when = summary["time_to_decision"]
    result.add_row("decided after", "not decided (95 %)" if math.isnan(when) else f"{when:.2f} s (95 % and stays)")
    result.add_section()
    for name, error in summary["pose_error"].items():
        sigmas = "" if math.isnan(error["sigmas"]) else f" = {error['sigmas']:.2f} σ"
        result.add_row(f"pose error, {name}", f"{error['degrees']:.2f}°{sigmas}")
    result.add_row("90 % interval holds the truth", f"{summary['coverage_90']:.0%} of the time")
    result.add_section()
    for name in ("raw angles", "haptic SLAM"):
        scores = {n: each[name]["f_score"] for n, each in summary["surface"].items()}
        told = ", ".join(f"{score:.2f} ({n})" for n, score in scores.items() if not math.isnan(score))
        result.add_row(f"surface F-score, {name}", told or "it touched nothing")
    result.add_row("of the whole surface mapped", f"{summary['surface_coverage']:.0%}")
    result.add_row("fingers touched it", f"{summary['touching_share']:.0%} of the time")
    result.add_row("computing took", f"{summary['computing_seconds']:.1f} s")
    return result


def _object(summary: dict[str, Any]) -> tuple[str, bool]:
    """The object of an exploration, and whether it is there in the simulation alone."""
    simulated = summary["truth"] is None
    return summary["simulated_object" if simulated else "truth"], simulated


def picture(path: Path, exploration: Exploration, accounts: dict[str, Account], summary: dict[str, Any]) -> None:
    """explore.png: the map from three sides, pose error and posterior through time."""
    slam, settings = accounts[OBSERVER], summary["settings"]
    belief = slam.belief
    figure = Figure(figsize=(11, 7.2), layout="constrained")
    parts: Any = figure.subfigures(2, 1, height_ratios=(1.45, 1))
    above, below = parts
    sides = above.subplots(1, 3)
    figure.draw_without_rendering()  # the hand's lines need the size of the panels
    for axes, side in zip(sides, SIDES, strict=True):
        hand, root = exploration.hand, None if exploration.roots is None else exploration.roots[-1]
        angles = slam.joint_angles[-1]
        image = draw_map(axes, belief.occupancy, belief.grid, exploration.solid, side, hand, angles, root)
    above.colorbar(image, ax=sides, label="probability that it is solid", shrink=0.75, aspect=25)
    above.legend(handles=map_legend(), loc="outside lower center", ncols=4, fontsize=9)
    left, right = below.subplots(1, 2)
    errors = {
        "raw angles": (metrics.pose_error_deg(exploration.felt_angles, exploration.true_angles), OBSERVER_COLOURS[RAW]),
        "haptic SLAM": (
            metrics.pose_error_deg(slam.lagged_joint_angles, exploration.true_angles),
            OBSERVER_COLOURS[OBSERVER],
        ),
    }
    draw_pose_error(left, exploration.seconds, errors, exploration.contacts.any(axis=1), settings["sigma"])
    truth, simulated = _object(summary)
    draw_posterior(right, exploration.seconds, slam.posterior, slam.labels, truth)
    sure = summary["posterior"][slam.name]
    titles = titles_of(slam.labels)
    verdict = "right" if slam.name == truth else f"wrong: a {as_drawn(titles[truth])}"
    if simulated:
        verdict = f"contacts simulated with a {as_drawn(titles[truth])}"
    figure.suptitle(
        f"{exploration.seconds[-1]:g} s of blind touch, joint noise σ = {settings['sigma']:g}°: "
        f"“a {as_drawn(titles[slam.name])}”, {sure:.0%} sure ({verdict})",
        fontsize=13,
        fontweight="bold",
    )
    with atomic(path) as place:
        figure.savefig(place)


def save_trace(path: Path, exploration: Exploration, accounts: dict[str, Account]) -> None:
    """explore.npz: map, belief through time, and everything that was commanded and felt."""
    slam = accounts[OBSERVER]
    belief = slam.belief
    with atomic(path) as place:
        np.savez_compressed(
            place,
            occupancy=belief.occupancy,
            grid_origin=belief.grid.origin,
            grid_resolution=belief.grid.resolution,
            weights=belief.weights,
            particles=belief.particles,
            seconds=exploration.seconds,
            torques=exploration.torques,
            felt_angles=exploration.felt_angles,
            true_angles=exploration.true_angles,
            contacts=exploration.contacts,
            joint_angles=slam.joint_angles,
            joint_std=slam.joint_std,
            lagged_joint_angles=slam.lagged_joint_angles,
            lagged_joint_std=slam.lagged_joint_std,
            n_eff=slam.n_eff,
            posterior=slam.posterior,
            labels=np.array(slam.labels),
        )


def main(arguments: list[str] | None = None) -> int:
    """Run the command; returns its exit code."""
    settings, recording = parse(arguments)
    with claimed(Path(settings.out)):
        return run(settings, recording)


def run(settings: Settings, recording: Recording | None) -> int:
    """Explore, and write what came of it to the folder that is claimed; returns the exit code."""
    console = make_console()
    try:
        session = begin(settings, recording)
    except (ValueError, ImportError) as error:  # what does not fit the recording, a hand that is not installed
        tell_error(str(error))
        return 2
    get_ready(console, session.env.unwrapped.hand)  # type: ignore[attr-defined]
    what = "a hidden object"
    if settings.shape:
        what = f"a {titles_of((*session.candidates, settings.shape))[settings.shape]}"
    seconds = session.env.unwrapped.episode_steps / session.env.unwrapped.control_hz  # type: ignore[attr-defined]
    how = f", as in {recording.source}" if recording else ""
    console.print(f"Exploring {what} by blind touch for {seconds:g} s{how} …", highlight=False)
    if session.simulated:
        console.print(f"No object was recorded: contacts are simulated with {what}, as you named it.", highlight=False)
    try:
        exploration, accounts, took, stopped = explore(settings, session, console)
    except ValueError as error:  # an object that this hand cannot hold
        tell_error(str(error))
        return 2
    truth = recorded.truth_among(exploration.solid, session.candidates)
    summary = summarise(settings, exploration, accounts, truth, took, session.simulated)
    out = Path(settings.out)
    picture(out / "explore.png", exploration, accounts, summary)
    save_trace(out / "explore.npz", exploration, accounts)
    write_json(out / "explore.json", summary)
    with atomic(out / "recording.npz") as place:
        kept = {name: getattr(settings, name) for name in DEFAULTS} | (recorded.SIMULATED if session.simulated else {})
        recordings.write(place, recorded.as_recording(exploration, kept, session.followed))
    console.print(table(summary))
    files = "explore.json, explore.npz, recording.npz"
    console.print(f"Picture, figures, trace and recording: {out / 'explore.png'}, {files}", highlight=False)
    if stopped:
        console.print("Stopped early: this is what was explored until then.", highlight=False)
    return 130 if stopped else 0


if __name__ == "__main__":
    program(main)
