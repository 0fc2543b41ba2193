"""What came of the inputs of an area, read from what its processes have written."""

from __future__ import annotations

import json
import re
import signal
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
SHOWN = 400  # characters of an input that are shown


@dataclass
class Account:
    """What came of the inputs of an area: how many there were of each kind, and an example of each fault."""

    area: str
    kinds: Counter[str] = field(default_factory=Counter)
    examples: dict[str, str] = field(default_factory=dict)
    entries: dict[str, set[str]] = field(default_factory=dict)
    seconds: float = 0.0

    @property
    def faults(self) -> dict[str, int]:
        """How often each fault happened."""
        return {kind: count for kind, count in self.kinds.most_common() if kind not in ("accepted", "refused")}

    def add(self, where: Mapping[str, Any], kind: str, told: str) -> None:
        """One more input, of the entry and the number that `where` says."""
        if kind in ("accepted", "refused"):
            self.kinds[kind] += 1
            return
        self.kinds[kind] += 1
        self.entries.setdefault(kind, set()).add(where["entry"])
        again = f"--again '{where['entry']}' {where['seed']}.{where['turn']}.{where['index']}"
        self.examples.setdefault(kind, f"{again}\n      {where['input']}\n      {told}")

    def read(self, log: Path, done: dict[str, int]) -> tuple[bool, dict[str, Any]]:
        """Add what `log` says, and to `done` how many batches of each entry began; whether it ended as it should, and
        the input under way."""
        where: dict[str, Any] = {}
        current: dict[str, Any] = {}
        for line in log.read_text().splitlines() if log.exists() else ():
            try:
                said = json.loads(line)
            except ValueError:  # the last one, cut off
                continue
            if "ended" in said:
                return True, {}
            if "entry" in said:
                where = said
                done[said["entry"]] = said["turn"] + 1
            elif "index" in said:
                current = {**where, **said}
            else:
                self.add(current, said["kind"], said["told"])
                current = {}
        return False, current


def death(code: int, crash: str) -> str:
    """Of which kind an end by an input was."""
    if code == -signal.SIGABRT and "Fatal Python error: Aborted" in crash and "Current thread" in crash:
        kind = "hangs or aborts"
    else:
        kind = f"signal {signal.Signals(-code).name}" if code < 0 else f"exit {code}"
    frames = re.findall(r'File "([^"]+)", line \d+ in (\w+)', crash)
    ours = [each for each in frames if each[0].startswith(str(ROOT))] or frames
    return f"{kind} at {'/'.join(Path(ours[0][0]).parts[-2:])}:{ours[0][1]}" if ours else kind


def shown(arguments: Any) -> str:
    """`arguments` in one line."""
    try:
        with np.printoptions(threshold=6, edgeitems=1, precision=3):
            text = " ".join(repr(arguments).split())
    except Exception as error:  # of an int of thousands of digits
        text = f"<{error}>"
    return text if len(text) <= SHOWN else f"{text[:SHOWN]}…"


def table(accounts: list[Account]) -> str:
    """What is printed in the end."""
    lines = [f"{'area':12} {'inputs':>8} {'accepted':>9} {'refused':>8} {'faults':>7} {'minutes':>8}"]
    for each in accounts:
        wrong = sum(each.faults.values())
        right, no = each.kinds["accepted"], each.kinds["refused"]
        lines.append(f"{each.area:12} {right + no + wrong:8} {right:9} {no:8} {wrong:7} {each.seconds / 60:8.1f}")
    total = [sum(sum(each.kinds.values()) for each in accounts), sum(sum(each.faults.values()) for each in accounts)]
    lines.append(f"{'all':12} {total[0]:8} {'':9} {'':8} {total[1]:7}")
    for each in accounts:
        for kind, count in each.faults.items():
            number = len(each.entries.get(kind, ()))
            of = f" ({number} entry points)" if number > 1 else ""
            lines.append(f"\n{count:6} × {each.area}: {kind}{of}\n      {each.examples[kind]}")
    return "\n".join(lines)
