"""Score a simulator's forces against the kit's truth. Needs numpy alone.

    python score.py FORCES_DIR [--html PAGE.html] [--at-least SHARE]

FORCES_DIR holds NAME.csv for every paths/NAME.csv of the kit: columns t,fx,fy,fz (s; N on the tip, in the
kit's frame), at any rate. A sample counts where the true force is not zero, or where there is force in air
beyond the bound. It is within where the error's length is at most the bound. The last line is the score: the
share of samples within the bound, mean over the cases, 0 to 1. With --at-least the exit code is 1 where it is
below, or a tip's file is missing.
"""

import argparse
import hashlib
import html
import json
import sys
from pathlib import Path

import numpy as np

KIT = Path(__file__).resolve().parent


class Refused(Exception):
    """What came, what is allowed, what to do."""


def table(path, columns):
    """(n, columns) numbers of a CSV whose header begins with these; further columns are passed over."""
    try:
        lines = path.read_text(encoding="utf-8-sig").split("\n")
    except (OSError, UnicodeDecodeError) as error:
        raise Refused(f"'{path}' cannot be read ({error})") from error
    head = [word.strip() for word in lines[0].strip().split(",")]
    width = len(columns.split(","))
    if head[:width] != columns.split(","):
        raise Refused(f"'{path}' begins with '{lines[0].strip()[:60]}': its first line must be {columns}")
    rows = []
    for number, line in enumerate(lines[1:], 2):
        if line.strip():
            try:
                row = [float(word) for word in line.split(",")]
            except ValueError:
                row = []
            if len(row) != len(head):
                raise Refused(f"'{path}', line {number}: it must be {len(head)} numbers, {columns}")
            rows.append(row[:width])
    if not rows:
        raise Refused(f"'{path}' has no rows: it must hold {columns}")
    return np.array(rows)


def compared(name, forces):
    """A tip's truth beside the forces (None: all zero), by sample."""
    truth = table(KIT / "truth" / f"{name}.csv", "t,fx,fy,fz,bound")
    t, true, bound = truth[:, 0], truth[:, 1:4], truth[:, 4]
    given = np.zeros_like(true)
    if forces is not None:
        path = forces / f"{name}.csv"
        rows = table(path, "t,fx,fy,fz")
        if not np.isfinite(rows[:, 0]).all() or (np.diff(rows[:, 0]) <= 0).any():
            raise Refused(f"'{path}': its times must be finite and increase from row to row")
        step = t[1] - t[0]
        if rows[0, 0] > t[0] + step or rows[-1, 0] < t[-1] - step:
            raise Refused(
                f"'{path}' runs from {rows[0, 0]:g} to {rows[-1, 0]:g} s: "
                f"its path runs from {t[0]:g} to {t[-1]:g} s"
            )
        given = np.column_stack([np.interp(t, rows[:, 0], f) for f in rows[:, 1:].T])
    lost = ~np.isfinite(given).all(axis=1)
    given[lost] = 0.0
    error = np.linalg.norm(given - true, axis=1)
    felt = true.any(axis=1)
    within = (error <= bound) & ~lost
    return {
        "name": name, "t": t, "true": true, "given": given, "bound": bound, "error": error,
        "counted": felt | ~within, "within": within, "no_number": int(lost.sum()),
    }  # fmt: skip


def scored(folder):
    """Rows, one a case: name, share within, rms error and bound in N, greatest error, notes, tips."""
    kit = json.loads((KIT / "kit.json").read_text())
    for name, digest in kit["sha256"].items():
        if hashlib.sha256((KIT / name).read_bytes()).hexdigest() != digest:
            raise Refused(f"'{KIT / name}' is not the kit's own any more: make the kit anew")
    known = {tip for case in kit["cases"] for tip in case["tips"]}
    if not folder.is_dir():
        raise Refused(f"'{folder}' is no folder: give the one that holds {', '.join(sorted(known))} (.csv)")
    there = {path.stem for path in folder.glob("*.csv")}
    if not there & known:
        raise Refused(
            f"'{folder}' holds none of {', '.join(sorted(known))} (.csv): name them as the paths are"
        )
    rows = []
    for case in kit["cases"]:
        missing = [tip for tip in case["tips"] if tip not in there]
        tips = [compared(tip, None if tip in missing else folder) for tip in case["tips"]]
        notes = [f"no {tip}.csv: it counts as no force" for tip in missing]
        notes += [
            f"{tip['no_number']} samples of {tip['name']} are no numbers" for tip in tips if tip["no_number"]
        ]
        counted = [tip["counted"] for tip in tips]

        def all_of(key, tips=tips, counted=counted):
            return np.concatenate([tip[key][c] for tip, c in zip(tips, counted, strict=True)])

        true = np.linalg.norm(all_of("true"), axis=1)
        rows.append({
            "name": case["name"], "within": float(all_of("within").mean()) if not missing else 0.0,
            "off_n": float(np.sqrt((all_of("error") ** 2).mean())),
            "bound_n": float(np.sqrt((all_of("bound") ** 2).mean())),
            "most_n": float(all_of("error").max()), "force_n": float(np.sqrt((true**2).mean())),
            "notes": notes, "tips": tips, "missing": missing,
        })  # fmt: skip
    return kit, rows


HEAD = ("case", "within the bound", "off, rms [mN]", "of the force", "bound, rms [mN]", "greatest error [mN]")


def cells(row):
    """What is told of a row, as HEAD names it."""
    share = row["off_n"] / row["force_n"] if row["force_n"] else float("inf")
    numbers = (f"{1e3 * row[key]:.2f}" for key in ("off_n", "bound_n", "most_n"))
    off, bound, most = numbers
    return row["name"], f"{100 * row['within']:.1f} %", off, f"{100 * share:.1f} %", bound, most


COLOURS = ("#c1121f", "#1d6fa5", "#2a9d3a")


def drawing(tip):
    """An SVG: the truth's band a component, and what was given as a line."""
    t, width, height = tip["t"], 640, 200
    low = min(0.0, tip["true"].min(), tip["given"].min())
    high = max(tip["true"].max(), tip["given"].max(), 1e-9)

    def at(x, y):
        across, up = 10 + (width - 20) * x / t[-1], 10 + (height - 20) * (high - y) / (high - low)
        return " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(across, up, strict=True))

    parts = []
    for k, colour in enumerate(COLOURS):
        true, bound = tip["true"][:, k], tip["bound"]
        around = at(np.append(t, t[::-1]), np.append(true + bound, (true - bound)[::-1]))
        parts.append(f'<polygon points="{around}" fill="{colour}" fill-opacity="0.25"/>')
        line = at(t, tip["given"][:, k])
        parts.append(f'<polyline points="{line}" fill="none" stroke="{colour}" stroke-width="1.2"/>')
    return f'<svg viewBox="0 0 {width} {height}" width="{width}" role="img">{"".join(parts)}</svg>'


def page(kit, rows, score, title):
    """One HTML page without anything from outside."""
    body = [
        "<tr>" + "".join(f"<td>{html.escape(cell)}</td>" for cell in cells(row)) + "</tr>" for row in rows
    ]
    notes = "".join(f"<p>{html.escape(note)}</p>" for row in rows for note in row["notes"])
    pictures = "".join(
        f"<h2>{html.escape(tip['name'])}</h2>{drawing(tip)}" for row in rows for tip in row["tips"]
    )
    head = "".join(f"<th>{word}</th>" for word in HEAD)
    return (
        '<!doctype html><html lang="en"><meta charset="utf-8"><title>Conformance</title>'
        "<style>body{font:15px sans-serif;max-width:60em;margin:2em auto;padding:0 1em}"
        "td,th{padding:.2em .8em;text-align:right}td:first-child,th:first-child{text-align:left}"
        "svg{border:1px solid #ccc;max-width:100%}</style>"
        f"<h1>{html.escape(title)}: {score:.4f}</h1>"
        "<p>Share of samples within the bound, mean over the cases. "
        f"Kit {kit['version']}.</p><table><tr>{head}</tr>{''.join(body)}</table>{notes}"
        "<p>Below: force on the tip over time. Band: truth with its bound; line: what was given; "
        "red x, blue y, green z.</p>"
        f"{pictures}</html>\n"
    )


def main(words=None):
    """The exit code: 0, 1 where --at-least is not met, or 2 with one line on standard error."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("forces", metavar="FORCES_DIR", type=Path, help="folder of NAME.csv (t,fx,fy,fz)")
    parser.add_argument("--html", metavar="PAGE", type=Path, help="write the page, with a curve a tip")
    parser.add_argument(
        "--at-least", metavar="SHARE", type=float, help="score below which the exit code is 1"
    )
    arguments = parser.parse_args(words)
    least = arguments.at_least
    if least is not None and not 0 <= least <= 1:
        parser.error(f"--at-least is {least:g}; it must be a share, 0 to 1")
    try:
        kit, rows = scored(arguments.forces)
        score = float(np.mean([row["within"] for row in rows]))
        if arguments.html is not None:
            try:
                arguments.html.write_text(page(kit, rows, score, arguments.forces.name), encoding="utf-8")
            except OSError as error:
                raise Refused(f"'{arguments.html}' cannot be written ({error})") from error
    except Refused as refused:
        print(f"score.py: {refused}", file=sys.stderr)
        return 2
    print(f"kit {kit['version']}, forces of '{arguments.forces}'")
    lines = [HEAD, *(cells(row) for row in rows)]
    wide = [max(len(line[k]) for line in lines) for k in range(len(HEAD))]
    for line in lines:
        print(
            "  ".join(
                cell.rjust(w) if k else cell.ljust(w)
                for k, (cell, w) in enumerate(zip(line, wide, strict=True))
            )
        )
    for row in rows:
        for note in row["notes"]:
            print(f"{row['name']}: {note}")
    print("share of samples within the bound, mean over the cases:")
    missing = least is not None and any(row["missing"] for row in rows)
    below = least is not None and score < least
    if below or missing:
        why = f"{score:.4f} is below {least:g}" if below else "files are missing"
        print(f"score.py: --at-least is not met: {why}", file=sys.stderr)
    print(f"{score:.4f}")
    return int(below or missing)


if __name__ == "__main__":
    sys.exit(main())
