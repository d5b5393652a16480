"""A studio that runs: who is answered, what goes in, and what Ctrl-C keeps."""

import contextlib
import io
import json
import re
import shlex
import socket
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from PIL import Image

from agents.retarget import main as retarget
from agents.solve import main as solve
from agents.studio.painting import PLAIN, SIDE
from autopoly_env.sequence import ConstructionSequence
from tests.helpers.constructions import house
from tests.helpers.drawings import HOUSE, painted
from tests.helpers.paths import EXAMPLES, ROOT
from tests.helpers.studio import Running, serving

pytestmark = pytest.mark.slow  # a server and its workers are started

PATIENCE = 60.0  # seconds


@pytest.fixture(scope="module")
def studio(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    with serving(out=tmp_path_factory.mktemp("studio") / "out") as running:
        yield running


@pytest.fixture(scope="module")
def web(studio: Running) -> Iterator[httpx.Client]:
    with httpx.Client(base_url=studio.address, timeout=PATIENCE) as client:
        yield client


def png(mode: str = "L", size: tuple[int, int] = (64, 64)) -> bytes:
    mask = painted(HOUSE).mask
    stream = io.BytesIO()
    Image.fromarray(np.where(mask, np.uint8(0), np.uint8(255))).resize(size).convert(mode).save(stream, "PNG")
    return stream.getvalue()


def add(web: httpx.Client, data: bytes, name: str = "house.png", waits: int = 0) -> int:
    answer = web.post("pictures", params={"name": name, "waits": waits}, content=data)
    assert answer.status_code == 200, answer.text
    return int(answer.json()["id"])


def news(web: httpx.Client, number: int, kind: str, wanted: Any = lambda _: True) -> Any:
    """The first news of a kind, about an item, that are as wanted."""
    event = ""
    with web.stream("GET", "events", params={"id": number}) as answer:
        for line in answer.iter_lines():
            if line.startswith("event: "):
                event = line.removeprefix("event: ")
            elif line.startswith("data: ") and event == kind:
                told = json.loads(line.removeprefix("data: "))
                if wanted(told):
                    return told
    raise AssertionError("the server has ended")


def done(web: httpx.Client, number: int) -> Any:
    return news(web, number, "item", lambda item: item["status"] in ("done", "failed"))


# --- who is answered ---


def test_page__is_answered_with_headers_that_let_nothing_in_from_elsewhere(web: httpx.Client) -> None:
    answer = web.get("")
    policy = answer.headers["content-security-policy"]
    assert answer.status_code == 200 and "default-src 'none'" in policy and "script-src 'self'" in policy
    assert "unsafe" not in policy and "http:" not in policy
    assert answer.headers["x-content-type-options"] == "nosniff" and answer.headers["referrer-policy"] == "no-referrer"
    assert "server" not in answer.headers


@pytest.mark.parametrize(
    "headers",
    [
        {"host": "evil.example"},
        {"host": "127.0.0.1"},
        {"host": "evil.example:80"},
        {"origin": "https://evil.example"},
        {"origin": "null"},
        {"sec-fetch-site": "cross-site"},
        {"sec-fetch-site": "same-site"},
    ],
)
def test_other_hosts_and_origins__are_refused(web: httpx.Client, headers: dict[str, str]) -> None:
    assert web.get("", headers=headers).status_code == 403
    assert web.post("pictures", content=png(), headers=headers).status_code == 403


def test_the_page_itself__may_ask(studio: Running, web: httpx.Client) -> None:
    own = {"origin": studio.root.rstrip("/"), "sec-fetch-site": "same-origin"}
    assert web.get("examples", headers=own).status_code == 200
    by_name = studio.address.replace("127.0.0.1", "localhost")
    assert web.get(by_name).status_code == 200


@pytest.mark.parametrize("path", ["", "events", "pictures/1/take/obj", "TOKE/", "files/studio.js"])
def test_requests_without_the_token__are_refused(studio: Running, web: httpx.Client, path: str) -> None:
    for root in (studio.root, studio.root + studio.token[:-1] + "/", studio.root + studio.token + "x/"):
        answer = web.get(root + path)
        assert answer.status_code == 403 and studio.token not in answer.text


def test_server__listens_on_this_machine_alone(studio: Running) -> None:
    port = int(studio.root.rsplit(":", 1)[1].rstrip("/"))
    own = [one[4][0] for one in socket.getaddrinfo(socket.gethostname(), None, socket.AF_INET)]
    for address in {*map(str, own), "127.0.0.2"} - {"127.0.0.1"}:
        with pytest.raises(OSError):
            socket.create_connection((address, port), timeout=1.0)


@pytest.mark.parametrize(
    "path",
    [
        "files/..%2f..%2fpyproject.toml",
        "files/%2e%2e/app.py",
        "files/studio.html",
        "examples/..%2fREADME.md",
        "examples/..%2f..%2fetc%2fpasswd.png",
        "pictures/1/..%2f..%2fapp.py",
        "pictures/%2fetc%2fpasswd/small.png",
        "pictures/99999999999999999999/small.png",
    ],
)
def test_paths__lead_to_nothing_that_is_no_page(web: httpx.Client, path: str) -> None:
    answer = web.get(path)
    assert answer.status_code in (404, 422) or path == "files/studio.html"
    assert "root:" not in answer.text and "import " not in answer.text


def test_names_of_modules__are_imported_by_nobody(web: httpx.Client) -> None:
    number = add(web, house().to_json().encode(), "house.json")
    answer = web.get(f"pictures/{number}/take/os:system")
    assert answer.status_code == 422 and "expected one of" in answer.text


# --- what goes in ---


@pytest.mark.parametrize(
    ("name", "data", "said"),
    [
        ("text.png", b"hello", "not an image"),
        ("empty.png", b"", "not an image"),
        ("cut.png", png()[:60], "cannot be decoded|not an image"),
        ("broken.svg", b"<svg xmlns='http://www.w3.org/2000/svg'><path d=", "no valid SVG"),
        ("outside.svg", b"<svg xmlns='http://www.w3.org/2000/svg'><image href='/etc/passwd'/></svg>", "not followed"),
        ("entity.svg", b"<!DOCTYPE a [<!ENTITY b 'c'>]><svg>&b;</svg>", "entities"),
        ("other.json", b'{"format": "something"}', "format"),
        ("half.json", b'{"format": ', "not JSON"),
        ("pickle.json", b"\x80\x04\x95.", "not an image"),
        ("shared.json", b'{"format": "autopoly-studio", "version": 2}', "version"),
        ("shared.json", b'{"format": "autopoly-studio", "version": 1, "name": "x", "locked": ["a"]}', "locked"),
        ("shared.json", b'{"format": "autopoly-studio", "version": 1, "name": "x", "picture": "%"}', "base64"),
        ("shared.json", b'{"format": "autopoly-studio", "version": 1, "name": "x"}', "neither"),
    ],
)
def test_files_that_are_no_pictures__are_refused_in_one_line(
    web: httpx.Client, name: str, data: bytes, said: str
) -> None:
    answer = web.post("pictures", params={"name": name}, content=data)
    assert answer.status_code == 422 and answer.text.count("\n") == 1 and re.search(said, answer.text), answer.text


def test_text_with_a_million_values__is_refused_before_it_is_read(web: httpx.Client) -> None:
    answer = web.post("pictures", params={"name": "a.json"}, content=b'{"a":[' + b"[]," * 1_000_001 + b"[]]}")
    assert answer.status_code == 422 and "more than 1,000,000 values" in answer.text


def test_500_megabytes__are_refused_before_they_are_sent(studio: Running) -> None:
    host, port = studio.root.removeprefix("http://").rstrip("/").split(":")
    with socket.create_connection((host, int(port)), timeout=10.0) as line:
        head = f"POST /{studio.token}/pictures HTTP/1.1\r\nHost: {host}:{port}\r\nContent-Length: 500000000\r\n\r\n"
        line.sendall(head.encode())
        assert b" 413 " in line.recv(4096)


def test_500_megabytes_that_say_nothing_of_their_length__are_not_kept(web: httpx.Client) -> None:
    def parts() -> Iterator[bytes]:
        for _ in range(500):
            yield bytes(1_000_000)

    with contextlib.suppress(httpx.HTTPError):  # the connection may be closed on us
        assert web.post("pictures", content=parts()).status_code == 413
    assert web.get("examples").status_code == 200


def test_20_000_pixels_a_side__are_refused_before_they_are_decoded(web: httpx.Client) -> None:
    stream = io.BytesIO()
    Image.new("1", (20_000, 20_000)).save(stream, "PNG")
    answer = web.post("pictures", params={"name": "large.png"}, content=stream.getvalue())
    assert answer.status_code == 422 and "too many pixels" in answer.text


def test_picture_without_an_object__stays_and_other_options_find_it(web: httpx.Client) -> None:
    stream = io.BytesIO()
    Image.new("L", (64, 64), 255).save(stream, "PNG")
    number = add(web, stream.getvalue(), "white.png")
    item = done(web, number)
    assert item["status"] == "failed" and item["problem"] and item["target"] is None
    assert web.get(f"pictures/{number}/take/obj").status_code == 422
    assert web.post(f"pictures/{number}/search", json={"do": "anew"}).status_code == 422


def test_name_with_markup__comes_back_as_text(web: httpx.Client) -> None:
    name = "<img src=x onerror=alert(1)>&\"'`.png"
    number = add(web, png(), name)
    item = done(web, number)
    assert item["name"] == name.removesuffix(".png")
    for kind in ("html", "obj", "share"):
        taken = web.get(f"pictures/{number}/take/{kind}")
        assert taken.status_code == 200 and "attachment" in taken.headers["content-disposition"]
        assert "<" not in taken.headers["content-disposition"]
    player = web.get(f"pictures/{number}/player.html")
    assert "<img src=x" not in player.text and "sandbox" in player.headers["content-security-policy"]


@pytest.mark.parametrize("name", ["../../etc/passwd.png", "..\\..\\boot.png", "a\0b.png", "", ".png", "x" * 3000])
def test_odd_names__become_plain_ones(web: httpx.Client, name: str) -> None:
    item = done(web, add(web, png(), name))
    assert 0 < len(item["name"]) <= 90 and not set(item["name"]) & set("/\\\0")


@pytest.mark.parametrize(
    ("what", "body"),
    [
        ("object", {"object": "no colour"}),
        ("object", {"threshold": "high"}),
        ("object", {"path": "/etc/passwd"}),
        ("object", []),
        ("choices", {"style": "modeller", "agent": "os:system"}),
        ("choices", {"w_sc": -1}),
        ("search", {"do": "rm"}),
        ("locks", {"ids": [999]}),
        ("locks", {"ids": ["0"]}),
        ("edit", {"do": "pull", "vertex": 0, "to": [5, 5]}),
        ("edit", {"do": "pull", "vertex": "0", "to": [0.5, 0.5]}),
        ("edit", {"do": "pull", "vertex": 0, "to": [10**400, 0.5]}),
        ("edit", {"do": "pull", "vertex": 10**4000, "to": [0.5, 0.5]}),
        ("edit", {"do": "face_delete", "element": {"face": 12345}}),
        ("edit", {"do": "__import__"}),
        ("edit", {"do": "face_delete", "element": [1], "more": 1}),
        ("retell", {"from": 12345}),
        ("nothing", {}),
    ],
)
def test_odd_requests__are_refused_in_one_line(web: httpx.Client, what: str, body: dict[str, Any]) -> None:
    number = add(web, house().to_json().encode(), "odd.json")
    answer = web.post(f"pictures/{number}/{what}", json=body)
    assert answer.status_code in (404, 422) and answer.text.count("\n") == 1, answer.text


@pytest.mark.parametrize("body", [b"", b"[]", b"{", b"\xff", b'{"a":' * 2000, b"1" * 200_000])
def test_bodies_that_are_no_objects__are_refused(web: httpx.Client, body: bytes) -> None:
    number = add(web, house().to_json().encode(), "odd.json")
    assert web.post(f"pictures/{number}/choices", content=body).status_code in (413, 422)


def test_list_that_is_too_long__is_told_what_it_may_have(web: httpx.Client) -> None:
    number = add(web, house().to_json().encode(), "odd.json")
    answer = web.post(f"pictures/{number}/locks", json={"ids": [0] * 50_000})
    assert answer.status_code == 413 and "100,000 bytes" in answer.text


def test_edits_sent_at_once__are_all_kept(web: httpx.Client) -> None:
    number = add(web, house(2).to_json().encode(), "odd.json")
    mesh = ConstructionSequence.from_json(web.get(f"pictures/{number}/take/sequence").text).final()
    u, v = mesh.vertex_ids[:2]
    places = {name: mesh.vertices[mesh.vertex_index(name)] + 0.01 for name in (u, v)}
    with ThreadPoolExecutor(2) as both:
        bodies = [{"do": "pull", "vertex": name, "to": place.tolist()} for name, place in places.items()]
        answers = list(both.map(lambda body: web.post(f"pictures/{number}/edit", json=body), bodies))
    assert [answer.status_code for answer in answers] == [204, 204], [answer.text for answer in answers]
    after = ConstructionSequence.from_json(web.get(f"pictures/{number}/take/sequence").text).final()
    for name, place in places.items():
        assert np.allclose(after.vertices[after.vertex_index(name)], place)


def test_paint_of_another_size__is_refused(web: httpx.Client) -> None:
    number = add(web, png())
    assert web.post(f"pictures/{number}/importance", content=bytes(100)).status_code == 422
    assert web.post(f"pictures/{number}/importance", content=bytes(SIDE * SIDE + 1)).status_code == 413


# --- what comes of it ---


def test_tab_that_never_reads__and_two_tabs_on_one_picture(studio: Running, web: httpx.Client) -> None:
    host, port = studio.root.removeprefix("http://").rstrip("/").split(":")
    number = add(web, (EXAMPLES / "bicycle.png").read_bytes(), "bicycle.png")
    with socket.create_connection((host, int(port))) as line:
        line.sendall(f"GET /{studio.token}/events?id={number} HTTP/1.1\r\nHost: {host}:{port}\r\n\r\n".encode())
        first = news(web, number, "live")
        second = news(web, number, "live", lambda live: live["refits"] > first["refits"])
        assert second["best"] >= first["best"]
        assert done(web, number) == done(web, number)


def test_everything__can_be_taken_along(web: httpx.Client) -> None:
    number = add(web, png())
    done(web, number)
    for kind in web.get("kinds").json():
        taken = web.get(f"pictures/{number}/take/{kind['name']}", params={"depth": 0.1, "size": 80})
        assert taken.status_code == 200 and taken.content, (kind["name"], taken.text[:200])
    assert web.get(f"pictures/{number}/take/stl", params={"depth": "thick"}).status_code == 422
    assert web.get(f"pictures/{number}/take/stl", params={"depth": 7}).status_code == 422
    assert web.get("results.zip").content[:2] == b"PK"


def test_shared_file__brings_everything_back(web: httpx.Client) -> None:
    number = add(web, png(), "mine.png")
    done(web, number)
    levels = bytes([255]) * SIDE * (SIDE // 2) + bytes([PLAIN]) * SIDE * (SIDE // 2)
    assert web.post(f"pictures/{number}/importance", content=levels).status_code == 204
    news(web, number, "item", lambda item: item["is_painted"] and item["status"] == "done")
    web.post(f"pictures/{number}/locks", json={"ids": [1]})
    shared = web.get(f"pictures/{number}/take/share").content
    other = add(web, shared, "sent.studio.json")
    there, here = (web.get(f"pictures/{one}/take/sequence").content for one in (other, number))
    assert there == here and ConstructionSequence.from_json(there.decode()).final().counts[2] > 0
    item = news(web, other, "item")
    assert item["locked"] == [1] and item["is_painted"] and item["name"].startswith("mine")
    assert web.get(f"pictures/{other}/importance").content == levels
    assert web.get(f"pictures/{other}/picture.png").content == web.get(f"pictures/{number}/picture.png").content


@pytest.mark.parametrize("name", ["../../etc/passwd", "a\r\nb", "\ud800", "a\u202eb\0", "..."])
def test_shared_file_with_an_odd_name__gets_a_plain_one(web: httpx.Client, name: str) -> None:
    shared = {"format": "autopoly-studio", "version": 1, "name": name, "sequence": json.loads(house().to_json())}
    number = add(web, json.dumps(shared).encode(), "odd.studio.json")
    kept = done(web, number)["name"]
    assert kept.isprintable() and not set(kept) & set("/\\") and kept.strip(" .")
    for kind in ("share", "svg"):
        assert web.get(f"pictures/{number}/take/{kind}").status_code == 200


def test_sequence_alone__is_opened_over_its_own_mesh(web: httpx.Client) -> None:
    item = done(web, add(web, house().to_json().encode(), "house.sequence.json"))
    assert item["name"].startswith("house") and item["status"] == "done" and not item["has_picture"]
    assert item["version"]["mesh"]["counts"] == list(house().final().counts)


# --- the same by a command ---


def as_command(web: httpx.Client, number: int, picture: bytes, folder: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """Run the command that the page shows for a picture, with the files that it names; the sequence that it writes."""
    version = news(web, number, "item", lambda item: item["status"] == "done")["version"]
    words = shlex.split(version["command"])
    for name in version["files"]:
        (folder / name).write_bytes(web.get(f"pictures/{number}/file/{name}").content)
    (folder / next(word for word in words if word.endswith(".png"))).write_bytes(picture)
    monkeypatch.chdir(folder)
    command = {"agents.solve": solve, "agents.retarget": retarget}[words[2]]
    assert words[:2] == ["python", "-m"] and command([*words[3:], "--quiet"]) == 0
    (written,) = folder.glob("out/*/sequence.json")
    return written.read_text(encoding="utf-8")


def same_mesh(one: str, other: str) -> bool:
    meshes = [ConstructionSequence.from_json(text).final() for text in (one, other)]
    return meshes[0] == meshes[1] and meshes[0].vertices.tobytes() == meshes[1].vertices.tobytes()


@pytest.mark.parametrize(
    "choices",
    [
        {},
        {"w_sc": 1.0, "seed": 3},
        {"style": "paper"},
        {"symmetry": "0.45", "keep": "holes"},
        {"align": False, "symmetry": "off"},
    ],
    ids=str,
)
def test_result__is_that_of_its_command_bit_for_bit(
    web: httpx.Client, choices: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    picture = (EXAMPLES / "padlock.png").read_bytes()
    number = add(web, picture, "padlock.png")
    web.post(f"pictures/{number}/choices", json={"refits": 80, **choices})
    told = as_command(web, number, picture, tmp_path, monkeypatch)
    assert same_mesh(told, web.get(f"pictures/{number}/take/sequence").text)


def test_result_with_paint_edits_and_locks__is_that_of_its_command(
    web: httpx.Client, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    picture = (EXAMPLES / "mug.png").read_bytes()
    number = add(web, picture, "mug.png")
    web.post(f"pictures/{number}/choices", json={"refits": 60})
    levels = np.full((SIDE, SIDE), PLAIN, np.uint8)
    levels[:, SIDE // 2 :] = 255
    web.post(f"pictures/{number}/importance", content=levels.tobytes())
    painted = as_command(web, number, picture, tmp_path, monkeypatch)
    assert same_mesh(painted, web.get(f"pictures/{number}/take/sequence").text)
    mesh = ConstructionSequence.from_json(painted).final()
    x, y = mesh.vertices[0]
    pull = {"do": "pull", "vertex": mesh.vertex_ids[0], "to": [x - 0.01, y]}
    assert web.post(f"pictures/{number}/edit", json=pull).status_code == 204
    assert web.post(f"pictures/{number}/search", json={"do": "on"}).status_code == 204
    (tmp_path / "again").mkdir()
    gone_on = as_command(web, number, picture, tmp_path / "again", monkeypatch)
    ours = web.get(f"pictures/{number}/take/sequence").text
    assert same_mesh(gone_on, ours)
    after = ConstructionSequence.from_json(ours).final()
    assert after.vertices[after.vertex_index(mesh.vertex_ids[0])].tolist() == [x - 0.01, y]


def test_steps_told_again_for_another_picture__are_those_of_the_command(
    web: httpx.Client, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    first, second = ((EXAMPLES / f"{name}.png").read_bytes() for name in ("bottle", "table"))
    source = add(web, first, "bottle.png")
    done(web, source)
    number = add(web, second, "table.png")
    assert web.post(f"pictures/{number}/retell", json={"from": source}).status_code == 204
    told = as_command(web, number, second, tmp_path, monkeypatch)
    assert same_mesh(told, web.get(f"pictures/{number}/take/sequence").text)


# --- the command ---


def test_ctrl_c_in_mid_search__keeps_what_is_finished_and_the_best_so_far(tmp_path: Path) -> None:
    out = tmp_path / "kept"
    with serving(EXAMPLES / "mug.png", out=out) as running, httpx.Client(base_url=running.address, timeout=60) as web:
        done(web, 1)
        number = add(web, (EXAMPLES / "bicycle.png").read_bytes(), "bicycle.png")
        web.post(f"pictures/{number}/choices", json={"seconds": 600})
        news(web, number, "live")
        code, said, complained = running.stop()
    assert code == 130 and "Traceback" not in complained
    assert {line for line in said.splitlines() if line.startswith(str(out))} == {f"{out}/mug", f"{out}/bicycle"}
    for name in ("mug", "bicycle"):
        assert ConstructionSequence.load(out / name / "sequence.json").final().counts[2] > 0


def test_sequence_and_folder__are_opened_at_the_start_and_what_is_no_picture_is_told(tmp_path: Path) -> None:
    (tmp_path / "house.json").write_text(house().to_json())
    drawings = tmp_path / "drawings"
    drawings.mkdir()
    for name in ("a", "b"):
        (drawings / f"{name}.png").write_bytes(png())
    (drawings / "c.png").write_text("hello")
    given = (tmp_path / "house.json", drawings)
    with serving(*given, out=tmp_path / "out") as running, httpx.Client(base_url=running.address, timeout=60) as web:
        listed = news(web, 0, "list", lambda items: [item["status"] for item in items] == ["done"] * 3)
        code, _, complained = running.stop()
    assert [item["name"] for item in listed] == ["house", "a", "b"]
    assert code == 130 and "error: 'c' is not an image" in complained and "Traceback" not in complained


def run(*arguments: object) -> "subprocess.CompletedProcess[str]":
    words = [sys.executable, "-m", "agents.studio", "--no-browser", *map(str, arguments)]
    return subprocess.run(words, cwd=ROOT, capture_output=True, text=True, timeout=PATIENCE)


def test_port_in_use__is_told_in_one_line(tmp_path: Path) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        said = run("--port", port)
    assert said.returncode == 2 and said.stderr.count("\n") == 1 and f"port {port}" in said.stderr, said.stderr


@pytest.mark.parametrize("arguments", [["--port", "70000"], ["missing.png"], ["--port", "x"]])
def test_wrong_usage__is_told_in_one_line(arguments: list[str]) -> None:
    said = run(*arguments)
    assert said.returncode in (1, 2) and said.stderr.count("\n") == 1 and said.stderr.startswith("error: ")
