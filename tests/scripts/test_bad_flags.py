"""Whatever stands on a command line or in its file: it is taken, or refused in one line with code 2, and nothing is
left behind."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from pathlib import Path

import pytest

from haptic_lab.commands import explore, figures
from haptic_lab.sweeps import options

Command = Callable[[list[str]], object]
COMMANDS: dict[str, Command] = {
    "evaluate": lambda arguments: options.check(None, arguments),
    "figures": figures.parse,
    "explore": explore.parse,
}
NOT_NUMBERS = ("", " ", "x", "nan", "inf", "-inf", "1e999", "1,5", "0x10", "[red]", "ü", "\udcff", "1\n2", "3 4", "½")
POSITIVE, FROM_NOTHING, COUNTS = ("0", "-1"), ("-1",), ("0", "-1", "1.5", "9" * 30)
SEEDS = ("-1", "1.5", "9" * 30, "9" * 5000)
WRONG: dict[str, list[tuple[str, tuple[str, ...]]]] = {  # flags, and what they cannot be besides no number at all
    "evaluate": [
        ("--sigmas --seconds --scale --drift-seconds --believed-sigma", POSITIVE),
        ("--bias-deg --drift-deg --believed-bias-deg --believed-sigma-deg", (*FROM_NOTHING, "91")),
        ("--proportional --motor-noise --contact-miss --contact-false-alarm", (*FROM_NOTHING, "2")),
        ("--contact-confusion --believed-contact-miss --believed-contact-confusion", (*FROM_NOTHING, "2")),
        ("--size-jitter --position-jitter --yaw-jitter", (*FROM_NOTHING, "181", "1e308")),
        ("--trials --particles --exemplars --jobs", COUNTS),
        ("--first-seed", SEEDS),
    ],
    "figures": [
        ("--sigmas --seconds --show-seconds", (*POSITIVE, "-1e-3", "1e30")),
        ("--scale --offset-sigmas", POSITIVE),
        ("--offsets --bias-deg --believed-bias-deg", (*FROM_NOTHING, "91")),
        ("--trials --particles --exemplars --jobs", COUNTS),
        ("--first-seed --seed", SEEDS),
    ],
    "explore": [
        ("--seconds --scale", POSITIVE),
        ("--sigma --bias-deg --drift-deg --believed-drift-deg --believed-start-std-deg", (*FROM_NOTHING, "91")),
        ("--drift-seconds --believed-drift-seconds", POSITIVE),
        ("--proportional --motor-noise --contact-miss --believed-proportional", (*FROM_NOTHING, "2")),
        ("--contact-confusion --believed-contact-false-alarm", (*FROM_NOTHING, "2")),
        ("--particles", COUNTS),
        ("--seed", SEEDS),
    ],
}
NAMED = {
    "evaluate": ["--shapes", "--policy", "--observers", "--classifiers", "--env"],
    "figures": ["--shapes", "--policy", "--observers", "--env", "--trials-of"],
    "explore": ["--shape", "--policy", "--env", "--recording", "--glove-calibration", "--save-offsets", "--believed"],
}
NOT_NAMES = (
    *("", " ", "cubee", "Cube", "none.stl", "none.zip", "/", "/dev/null", ".", "..", "[cube]", "ü.stl", "\udcff.stl"),
    *("a\nb.stl", "\x1b[31m.stl", "l" * 300 + ".stl", "l" * 300 + ".zip", "~/none.stl", "~nobody-is-called-so/a.stl"),
    *("none.npz", "none.txt", "nan", "-1"),
)
FEW = ("x", "nan", "1\n2")  # of what is no number, where a flag like it is tried with all
NUMBERS = [
    pytest.param(
        command,
        flag,
        value,
        marks=[pytest.mark.statistical] if nth > 0 and value in NOT_NUMBERS and value not in FEW else [],
    )
    for command, several in WRONG.items()
    for flags, values in several
    for nth, flag in enumerate(flags.split())
    for value in (*NOT_NUMBERS, *values)
]
NAMES = [
    (command, flag, value) for command, flags in NAMED.items() for flag, value in itertools.product(flags, NOT_NAMES)
]
NOT_FOLDERS = ("", " ", "\t", "a\nb", "\udcff", "~nobody-is-called-so/out")
FILES: dict[str, bytes] = {
    "no TOML": b"sigmas = ",
    "another encoding": "policy = ['é.zip']".encode("latin-1"),
    "two bytes a letter": "trials = 3".encode("utf-16"),
    "a zero byte": b"out = 'a\0b'",
    "an escaped zero byte": b'out = "a\\u0000b"',
    "lists in lists": b"sigmas = " + b"[" * 5000 + b"]" * 5000,
    "tables in tables": b"[" + b"a." * 5000 + b"b]",
    "too large": b"#" * 2**21,
    "a number too large": b"sigmas = 1" + b"0" * 400,
    "a number too long": b"trials = 1" + b"0" * 5000,
    "not a number": b"sigmas = nan",
    "a date": b"seconds = 1979-05-27",
    "a table": b"seconds = {a = 1}",
    "a list of lists": b"seconds = [[1]]",
    "two types": b"seconds = [1, 'a']",
    "true for a number": b"seconds = true",
    "an empty name": b"shapes = ['']",
    "an empty folder": b"out = ''",
    "nobody's home": b"out = '~nobody-is-called-so/out'",
    "an empty list": b"policy = []",
    "more than can be": b"".join(
        f"{name} = [{', '.join(f'{0.001 * k:.3f}' for k in range(200))}]\n".encode()
        for name in ("bias_deg", "drift_deg", "proportional", "motor_noise", "contact_miss", "contact_false_alarm")
    ),
    "a key that is not one": b"help = true",
    "an empty key": b'"" = 1',
}


@pytest.fixture(autouse=True)
def _home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("home", "here"):
        (tmp_path / name).mkdir()
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    monkeypatch.chdir(tmp_path / "here")


def refused(command: str, arguments: list[str], capsys: pytest.CaptureFixture, tmp_path: Path) -> str:
    with pytest.raises(SystemExit) as ended:
        COMMANDS[command](arguments)
    told = capsys.readouterr()
    assert ended.value.code == 2
    assert told.out == ""
    assert told.err.count("\n") == 1
    assert ": error: " in told.err
    assert not list((tmp_path / "here").iterdir()), "nothing is left behind"
    assert not list((tmp_path / "home").iterdir())
    return told.err


@pytest.mark.parametrize(("command", "flag", "value"), NUMBERS)
def test_wrong_numbers(command: str, flag: str, value: str, capsys: pytest.CaptureFixture, tmp_path: Path) -> None:
    told = refused(command, [f"{flag}={value}"], capsys, tmp_path)
    assert flag.lstrip("-").replace("-", "_") in told.replace("-", "_")


@pytest.mark.parametrize(("command", "flag", "value"), NAMES)
def test_wrong_names(command: str, flag: str, value: str, capsys: pytest.CaptureFixture, tmp_path: Path) -> None:
    refused(command, [f"{flag}={value}"], capsys, tmp_path)


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("value", NOT_FOLDERS)
def test_wrong_folders(command: str, value: str, capsys: pytest.CaptureFixture, tmp_path: Path) -> None:
    assert "--out" in refused(command, [f"--out={value}"], capsys, tmp_path)


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize(
    "arguments", [["--colour", "red"], ["--seconds"], ["a\nb"], ["--", "-x"], ["--out"], ["--a\nb"]]
)
def test_wrong_words(command: str, arguments: list[str], capsys: pytest.CaptureFixture, tmp_path: Path) -> None:
    refused(command, arguments, capsys, tmp_path)


@pytest.mark.parametrize("name", FILES)
def test_wrong_files(name: str, capsys: pytest.CaptureFixture, tmp_path: Path) -> None:
    file = tmp_path / "sweep.toml"
    file.write_bytes(FILES[name])
    assert str(file) in refused("evaluate", ["--config", str(file)], capsys, tmp_path)


@pytest.mark.parametrize("name", ["/dev/zero", "/", "none.toml", "", "l" * 300, "~/none.toml", "a\0b"])
def test_what_is_no_file(name: str, capsys: pytest.CaptureFixture, tmp_path: Path) -> None:
    refused("evaluate", ["--config", name], capsys, tmp_path)


def test_a_file_may_begin_with_a_byte_order_mark(tmp_path: Path) -> None:
    (tmp_path / "sweep.toml").write_bytes("\ufefftrials = 3".encode())
    assert options.check(None, ["--config", str(tmp_path / "sweep.toml")]).trials == 3
