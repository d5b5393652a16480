"""Draws the floors of the three packages into docs/pictures: `python docs/draw_architecture.py [FOLDER]`.

A room imports from rooms below it only; `tests/house/test_architecture.py` holds this table to the imports.
"""

import sys
from html import escape
from pathlib import Path

from autopoly_env.files import write_atomically

PICTURES = Path(__file__).parent / "pictures"

Floor = dict[str, str]  # a room's name, what is in it

# The highest floor first, a line each. Folders are rooms, and so are files that lie in no folder.
TABLES = {
    "training": """
        evaluate | compare | improve | make_dataset | make_expert | train_nfap | train_warpnet | rl_clone | train_rl
        describe_networks | measure_nfap | evaluation: agents on suites | policies: training of policies, by playing
        improvement: a search teaches a network, round by round
        report: the page that compares runs | datasets: targets on disk | networks: training of networks
        records: what was measured | run_log: of a training | telling: signs of life, tables
        parallel: processes, Ray | options: settings
    """,
    "agents": """
        solve | vary | retarget | export | studio: a page in the browser, its server, its workers
        commands: what commands share: progress, results, Ctrl-C, wishes
        registry: agents by name; from outside by my.module:Agent
        choice: ChoiceNet, a prior in NumPy that search has taught
        guided: nFAP-Net and WarpNet in the search | rl: policies: observation, network, environments
        search: Monte Carlo tree search; mcts, the default | warm: kernels of agents
        quads: convex quads, told as they are modelled
        climb: hill climbing on outlines | retell: a construction told again | conformance: checks agents
        trace: best polygons of contours | baselines: random, beam, greedy, ...
        entry: options | contract: is it kept | knowing: what the weights of a network know, and who heeds it
        base: what every agent is: act and solve
        finish: states become a solution: pared, polished, told without detours
        budget: refits, seconds, simulations
        solution: what comes out | options: YAML, key=value | weights_file: of networks, in torch
        weights_meta: what stands beside weights | names | extras
    """,
    "autopoly_env": """
        vector_env: many at once | wrappers: other observations | warm: compiles all kernels
        env: the Gymnasium environment | conformance: checks parts of your own
        simulator: the rules: State, transition(state, action)
        guidance: a user's wishes | targets: what is to be built | export: a mesh becomes a file
        sequence: a construction: JSON that replays bit for bit
        placement: where new vertices begin | refit: a mesh meets the target | score: r_all | observation: what is seen
        details: parts, holes, hairlines: what is lost
        operators: an action becomes a mesh | raster: exact coverage, exact derivatives | viewer: pictures of meshes
        mesh: PolyMesh: vertices, faces, their topology
        silhouette: an image becomes a mask
        workers: processes that are asked
        compute: kernels, threads | files | outside
        arguments: values that people type
        errors
        shown: text in one tame line | arrays
    """,
}
THE_WAY = {"silhouette", "operators", "export"}  # of an image, an action, a mesh
SUBTITLES = {"training": "the workshop", "agents": "the players", "autopoly_env": "the world"}
COLOURS = {"training": "#fbf4e6", "agents": "#eef7ee", "autopoly_env": "#eaf2fb"}

WIDTH, HEIGHT, GAP, MARGIN, HEAD = 1000, 38, 6, 14, 26  # of the page, of a room, and between them, in pixels


def floors_of(table: str) -> list[Floor]:
    """The floors of a table, the highest first."""
    rooms = [[room.partition(":") for room in line.split("|")] for line in table.strip().splitlines()]
    return [{name.strip(): what.strip() for name, _, what in floor} for floor in rooms]


FLOORS = {package: floors_of(table) for package, table in TABLES.items()}

STYLE = """
    .room { fill: #fff; stroke: #8397ab }
    .way { stroke: #2f7d4f; stroke-width: 2.5 }
    .name { font-weight: bold; font-size: 12.5px; fill: #1b2733 }
    .what { font-size: 10.5px; fill: #44566a }
    .package { font-weight: bold; font-size: 15px; fill: #1b2733 }
"""


def drawing() -> str:
    """All packages, the highest on top, as an SVG."""
    lines, y = [], MARGIN
    for package, floors in FLOORS.items():
        height = HEAD + len(floors) * (HEIGHT + GAP) + GAP
        lines += [
            f'<rect x="{MARGIN}" y="{y}" width="{WIDTH - 2 * MARGIN}" height="{height}" '
            f'rx="8" fill="{COLOURS[package]}"/>',
            f'<text class="package" x="{2 * MARGIN}" y="{y + 20}">{package} — {SUBTITLES[package]}</text>',
        ]
        for k, floor in enumerate(floors):
            lines += _floor(floor, y + HEAD + k * (HEIGHT + GAP), package == "autopoly_env")
        y += height + MARGIN
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {y}" '
        'font-family="DejaVu Sans, Helvetica, Arial, sans-serif">'
    )
    title = "<title>The floors: a room imports from rooms below it only</title>"
    body = "\n".join(lines)
    return (
        f'{head}\n{title}\n<style>{STYLE}</style>\n<rect width="{WIDTH}" height="{y}" fill="#fff"/>\n{body}\n</svg>\n'
    )


def _floor(floor: Floor, y: int, is_world: bool) -> list[str]:
    """The rooms of a floor, side by side; commands and small ones have no words and less width."""
    shares = [max(len(name), round(0.82 * len(what))) + 3 for name, what in floor.items()]
    room_left = WIDTH - 4 * MARGIN - GAP * (len(floor) - 1)
    lines, x = [], float(2 * MARGIN)
    for (name, what), share in zip(floor.items(), shares, strict=True):
        width = room_left * share / sum(shares)
        kind = "room way" if is_world and name in THE_WAY else "room"
        lines.append(f'<rect class="{kind}" x="{x:.0f}" y="{y}" width="{width:.0f}" height="{HEIGHT}" rx="5"/>')
        lines.append(f'<text class="name" x="{x + 8:.0f}" y="{y + (16 if what else 23)}">{name}</text>')
        if what:
            lines.append(f'<text class="what" x="{x + 8:.0f}" y="{y + 30}">{escape(what)}</text>')
        x += width + GAP
    return lines


def main(folder: Path = PICTURES) -> None:
    write_atomically(folder / "floors.svg", drawing())


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:]))
