"""What is said of people as one HTML file that needs no other, and no network, and as tables on the terminal.

All that came out of a table is escaped, and the page forbids scripts: a stranger's text is shown, and never run.
"""

from __future__ import annotations

import base64
import math
from collections.abc import Mapping, Sequence
from html import escape
from string import Template

import pandas as pd
from rich import box
from rich.console import Console
from rich.table import Table

from haptic_env import validate
from haptic_lab.people.analysis import Analysis
from haptic_lab.people.summaries import PEOPLE, over_all_times

MOST_LINES = 60  # of a table in the report; the CSV has them all
MOST_SUBJECTS = 12  # on the terminal
TELLING = 10.0  # an efficiency above it is not told more exactly
SCREEN = 120  # pixels that an inch of print takes
HEADINGS = {
    "accuracy": "Accuracy",
    "confusion": "Confusions",
    "sensitivity": "d′ and criterion",
    "efficiency": "Efficiency",
    "psychometric": "Psychometric functions",
    "levels": "Answers at each level",
    "agreement": "Agreement trial by trial",
    "times": "Times",
}
PAGE = Template("""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; img-src data:; style-src 'unsafe-inline'">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>$title</title>
<style>
body { font: 15px/1.45 system-ui, sans-serif; max-width: 62rem; margin: 2rem auto; padding: 0 1rem; color: #111; }
h1 { font-size: 1.5rem; } h2 { font-size: 1.15rem; margin-top: 2.2rem; }
img { max-width: 100%; height: auto; } figure { margin: 0; }
figcaption, footer, .more { color: #444; font-size: 0.9rem; }
table { border-collapse: collapse; font-size: 0.85rem; margin-top: 0.8rem; }
th, td { padding: 0.15rem 0.6rem; text-align: right; border-bottom: 1px solid #ddd; white-space: nowrap; }
td:first-child, .facts td { white-space: normal; overflow-wrap: anywhere; min-width: 6rem; }
th:first-child, td:first-child, .facts td { text-align: left; }
.notes { background: #fff6e0; border-left: 4px solid #e69f00; padding: 0.5rem 1rem 0.5rem 2rem; }
details { margin-top: 0.6rem; overflow-x: auto; }
@media print { details { display: none; } h2, figure { break-inside: avoid; } }
</style>
</head>
<body>
<h1>$title</h1>
$facts
$notes
$sections
<footer>
<h2>How to cite</h2>
<ul>
$references
</ul>
<p>$version</p>
</footer>
</body>
</html>
""")
PAPER = (
    "Behbahani F. M. P., Singla-Buxarrais G. & Faisal A. A. (2016). Haptic SLAM: an ideal observer model for Bayesian "
    "inference of object shape and hand pose from contact dynamics. EuroHaptics 2016. (The observer; other work that "
    "bears the name haptic SLAM, arXiv 2603.10352, is about another problem.)"
)
REFERENCES = {  # by the tables that need them
    "accuracy": "Wilson E. B. (1927). Probable inference, the law of succession, and statistical inference. J. Am. "
    "Stat. Assoc. 22, 209–212. (Intervals of shares.)",
    "sensitivity": "Hacker M. J. & Ratcliff R. (1979). A revised table of d′ for M-alternative forced choice. "
    "Perception & Psychophysics 26, 168–170; Hautus M. J. (1995). Corrections for extreme proportions and their "
    "biasing effects on estimated values of d′. Behav. Res. Methods 27, 46–51; Rubin D. B. (1981). The Bayesian "
    "bootstrap. Ann. Stat. 9, 130–134.",
    "psychometric": "Schütt H. H., Harmeling S., Macke J. H. & Wichmann F. A. (2016). Painfree and accurate Bayesian "
    "estimation of psychometric functions for (potentially) overdispersed data. Vision Research 122, 105–123. "
    "(psignifit.)",
    "agreement": "Cohen J. (1960). A coefficient of agreement for nominal scales. Educ. Psychol. Meas. 20, 37–46.",
}


def html(analysis: Analysis, pictures: Mapping[str, bytes], title: str, version: str) -> str:
    """Make the report.

    Args:
        analysis: of a table.
        pictures: PNG files, by the names of its figures.
        title: of the report, any text.
        version: of what made it, any text.

    Returns:
        The page, with its pictures in it.
    """
    facts = "".join(
        f"<tr><td>{escape(name)}</td><td>{escape(value)}</td></tr>" for name, value in analysis.facts.items()
    )
    notes = "".join(f"<li>{escape(each)}</li>" for each in analysis.notes)
    references = [PAPER, *(text for name, text in REFERENCES.items() if name in analysis.tables)]
    return PAGE.substitute(
        title=escape(title),
        facts=f'<table class="facts">{facts}</table>',
        notes=f'<ul class="notes">{notes}</ul>' if notes else "",
        sections="\n".join(
            _section(analysis, pictures, name) for name in HEADINGS if name in {*analysis.tables, *analysis.figures}
        ),
        references="\n".join(f"<li>{escape(each)}</li>" for each in references),
        version=escape(version),
    )


def print_tables(analysis: Analysis, console: Console) -> None:
    """Print what matters most: of all people, each observer, and the first subjects.

    Args:
        analysis: of a table.
        console: to print to.
    """
    tables = analysis.tables
    for name, lines in (("accuracy", ("share",)), ("sensitivity", ("d_prime", "criterion"))):
        if name in tables:
            console.print(_printed(HEADINGS[name], _few(tables[name]), lines, percent=name == "accuracy"))
    if "efficiency" in tables:
        mine = tables["efficiency"]
        console.print(_printed("Efficiency", mine[mine["who"] == PEOPLE], ("efficiency",), percent=True))
    if "psychometric" in tables:
        columns = ("threshold", "slope", "lapse")
        console.print(_printed(HEADINGS["psychometric"], _few(tables["psychometric"]), columns, percent=False))
    if "agreement" in tables:
        mine = tables["agreement"]
        console.print(_agreement(mine[mine["who"] == PEOPLE]))


def _section(analysis: Analysis, pictures: Mapping[str, bytes], name: str) -> str:
    parts = [f"<h2>{escape(HEADINGS[name])}</h2>"]
    if name in pictures:
        picture = base64.b64encode(pictures[name]).decode("ascii")
        caption = escape(analysis.captions[name])
        wide = round(SCREEN * analysis.figures[name].get_figwidth())
        image = f'<img alt="{caption}" width="{wide}" src="data:image/png;base64,{picture}">'
        parts.append(f"<figure>{image}<figcaption>{caption}</figcaption></figure>")
    if name in analysis.tables:
        table = analysis.tables[name]
        left = len(table) - MOST_LINES
        more = f'<p class="more">{left} more lines in {escape(name)}.csv</p>' if left > 0 else ""
        parts.append(f"<details><summary>Table</summary>{_html_table(table.iloc[:MOST_LINES])}{more}</details>")
    return "\n".join(parts)


def _html_table(table: pd.DataFrame) -> str:
    head = "".join(f"<th>{escape(str(name).replace('_', ' '))}</th>" for name in table)
    rows = "".join(
        f"<tr>{''.join(f'<td>{escape(_told(cell))}</td>' for cell in row)}</tr>"
        for row in table.itertuples(index=False)
    )
    return f"<table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>"


def _told(cell: object) -> str:
    if isinstance(cell, float):
        return "" if math.isnan(cell) else "∞" if math.isinf(cell) else f"{cell:.4g}"
    return {True: "yes", False: "no"}.get(cell, str(cell)) if isinstance(cell, bool) else str(cell)


def _few(table: pd.DataFrame) -> pd.DataFrame:
    """All people, the observers, and of the first subjects all times together."""
    subjects = table["kind"] == "subject"
    first = list(dict.fromkeys(table["who"][subjects]))[:MOST_SUBJECTS]
    if len(first) == 1:  # is all people
        return table[~subjects]
    overall = table.index.isin(over_all_times(table).index) if "seconds" in table else True
    return table[~subjects | (table["who"].isin(first) & overall)]


def _printed(title: str, table: pd.DataFrame, columns: Sequence[str], *, percent: bool) -> Table:
    """A line for each, with its interval; of an accuracy or efficiency in per cent."""
    result = Table(title=title, title_justify="left", title_style="bold", box=box.SIMPLE_HEAD)
    known = [name for name in ("who", "observer", "condition", "seconds") if name in table]
    known = [name for name in known if name in ("who", "observer") or table[name].nunique(dropna=False) > 1]
    for name in (*known, *columns, *(["trials"] if "trials" in table else [])):
        result.add_column(
            name.replace("d_prime", "d′"), justify="left" if name in ("who", "observer", "condition") else "right"
        )
    for line in table.to_dict("records"):
        told = [_where(name, line[name]) for name in known]
        told += [_with_interval(line, name, percent) for name in columns]
        result.add_row(
            *told,
            *([str(line["trials"])] if "trials" in table else []),
            style="bold" if line["who"] == PEOPLE else None,
        )
    return result


def _where(name: str, value: object) -> str:
    if name == "seconds":
        return "all" if isinstance(value, float) and math.isnan(value) else f"{value:g} s"
    return validate.plain(value) if value != "" else ""


def _with_interval(line: dict, name: str, percent: bool) -> str:
    low, high = (float(line.get(f"{name}_{end}", line.get(end, math.nan))) for end in ("low", "high"))
    value, factor, unit = line[name], 100.0 if percent else 1.0, " %" if percent else ""
    digits = 0 if percent else 2
    if line.get("perfect") and name == "d_prime":
        return f"above {low:.{digits}f} (no mistake)"
    if name == "efficiency":
        return _efficiency(value, low, high)
    if math.isnan(value):
        return "–"
    told = [_rounded(factor * each, digits) for each in (value, low, high)]
    return f"{told[0]}{unit}" + ("" if math.isnan(low) else f" [{told[1]}, {told[2]}]")


def _efficiency(value: float, low: float, high: float) -> str:
    if math.isnan(value) and math.isinf(high):
        return f"above {_percent(low)} %" if low > 0.0 else "–"
    if math.isnan(value):
        return f"below {_percent(high)} %"
    return f"{_percent(value)} %" + ("" if math.isnan(low) else f" [{_percent(low)}, {_percent(high)}]")


def _percent(share: float) -> str:
    """Per cent; that of an observer which is hardly better than chance has no number worth its digits."""
    return f"{100 * share:.0f}" if share <= TELLING else f"> {100 * TELLING:.0f}"


def _rounded(value: float, digits: int) -> str:
    return "∞" if math.isinf(value) else f"{value:.{digits}f}".replace("-0.00", "0.00")


def _agreement(table: pd.DataFrame) -> Table:
    result = Table(title=HEADINGS["agreement"], title_justify="left", title_style="bold", box=box.SIMPLE_HEAD)
    for name in ("observer", "trials", "nats a trial", "of chance", "κ", "bits", "of chance", "ρ of times"):
        result.add_column(name, justify="left" if name == "observer" else "right")
    for line in table.sort_values("nats", ascending=False).to_dict("records"):
        nats = _with_interval(
            {"nats": line["nats"], "nats_low": line["nats_low"], "nats_high": line["nats_high"]}, "nats", False
        )
        rest = [
            "–" if math.isnan(line[name]) else f"{line[name]:.2f}"
            for name in ("nats_of_chance", "kappa", "bits", "bits_of_chance")
        ]
        rho = _with_interval(line, "time_rho", False)
        result.add_row(validate.plain(line["observer"]), str(line["trials"]), nats, *rest, rho)
    return result
