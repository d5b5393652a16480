"""Runs inside a Blender that has a window: keys and clicks as events, as if a hand moved the pointer and typed.

Each act is a generator: what it has sent is worked off before it goes on. `driver.py` calls it with `--events`, in a
Blender started with `--enable-event-simulate`. The view is zoomed so that what is pointed at stands apart.
"""

from collections.abc import Callable, Iterator

import bpy
from bpy_extras.view3d_utils import location_3d_to_region_2d
from mathutils import Vector, geometry

DIGIT_KEYS = ("ZERO", "ONE", "TWO", "THREE", "FOUR", "FIVE", "SIX", "SEVEN", "EIGHT", "NINE")
SIGN_KEYS = {"-": "MINUS", ".": "PERIOD"}
NAMED_KEYS = {"Enter": "RET", "Tab": "TAB", "1": "ONE", "2": "TWO", "3": "THREE"}
WARM_UP = 8  # pointer moves until a new window takes what comes
LEAST_SHOWN = 0.05  # units; the view shows no less
ROOM = 3.0  # times what is pointed at, that the view shows

Place = tuple[float, float]
View = tuple[bpy.types.Window, bpy.types.Area, bpy.types.Region]


class Fingers:
    """A hand on keyboard and mouse; `view` gives the 3D view, `state` what is selected."""

    def __init__(self, view: Callable[[], View], state: Callable[[], dict]) -> None:
        self.view, self.state = view, state
        self.at = (0, 0)  # the pointer, in pixels of the window

    def prepare(self) -> Iterator[None]:
        """A view with nothing in the way of the pointer, which is in it."""
        _, area, _ = self.view()
        space = area.spaces[0]
        space.show_gizmo = space.show_region_ui = space.show_region_toolbar = False
        space.show_region_tool_header = space.show_region_header = False
        space.region_3d.view_perspective = "ORTHO"
        space.overlay.show_floor = space.overlay.show_axis_x = space.overlay.show_axis_y = False
        space.shading.light = "FLAT"
        bpy.context.preferences.system.viewport_aa = "OFF"  # nobody looks
        bpy.context.preferences.view.smooth_view = 0
        bpy.context.preferences.inputs.use_numeric_input_advanced = False
        for _ in range(WARM_UP):
            yield from self.hover((0.5, 0.5))

    def mode(self, act: dict) -> Iterator[None]:
        yield from self.key(act["keys"][0])

    def nothing(self, _act: dict) -> Iterator[None]:
        yield from self.key("A", alt=True)

    def click(self, act: dict) -> Iterator[None]:
        yield from self.zoom(act["at"])
        yield from self.point(_inside(act["at"]), shift=act["shift"])

    def drag(self, act: dict) -> Iterator[None]:
        yield from self.key(act["keys"][-1], shift="Shift" in act["keys"])
        x, y = (f"{value:.4f}" for value in act["by"])
        self.write(x)
        self.tap("Tab")
        self.write(y)
        yield from self.key("Enter")

    def press(self, act: dict) -> Iterator[None]:
        yield from self.key(act["keys"][0])
        if act["typed"]:
            self.write(act["typed"])
            yield from self.key("Enter")

    def loop(self, act: dict) -> Iterator[None]:
        yield from self.zoom(act["at"])
        middle = _middle(act["at"])
        yield from self.hover(middle)
        yield from self.key("R", ctrl=True)
        yield from self.hover(middle)
        yield from self.point(middle)
        if act["factor"]:
            self.write(f"{act['factor']:.4f}")
            yield
            places = [p for ends in self.state()["selected"] for p in ends]
            if min(abs(x - act["to"][0]) + abs(y - act["to"][1]) for x, y in places) > 0.004:
                self.write("-")
            yield from self.key("Enter")
        else:
            yield from self.key("RIGHTMOUSE")

    def cut(self, act: dict) -> Iterator[None]:
        yield from self.zoom([p for path in act["paths"] for p in path], 1.2)
        yield from self.hover(act["paths"][0][0])
        yield from self.key("K")
        for k, path in enumerate(act["paths"]):
            if k:
                yield from self.key("RIGHTMOUSE")
            for place in path:
                yield from self.point(place)
        yield from self.key("Enter")

    # --- pointer and keyboard

    def zoom(self, places: list[Place], room: float = ROOM) -> Iterator[None]:
        """Show some places and room around them."""
        xs, ys = zip(*places, strict=True)
        extent = max(max(xs) - min(xs), max(ys) - min(ys))
        _, area, _ = self.view()
        seen = area.spaces[0].region_3d
        seen.view_location = ((min(xs) + max(xs)) / 2, (min(ys) + max(ys)) / 2, 0.0)
        seen.view_distance = max(room * extent, LEAST_SHOWN) * area.spaces[0].lens / 36.0 * 0.75
        seen.update()
        yield

    def pixel(self, place: Place) -> tuple[int, int]:
        _, area, region = self.view()
        x, y = location_3d_to_region_2d(region, area.spaces[0].region_3d, Vector((*place, 0.0)))
        return round(x) + region.x, round(y) + region.y

    def send(self, kind: str, value: str, **more: object) -> None:
        window, _, _ = self.view()
        window.event_simulate(type=kind, value=value, x=self.at[0], y=self.at[1], **more)

    def hover(self, place: Place) -> Iterator[None]:
        x, y = self.pixel(place)
        for dx in (3, 0):  # a pointer that does not move is no event
            self.at = x + dx, y
            self.send("MOUSEMOVE", "NOTHING")
        yield

    def point(self, place: Place, **more: bool) -> Iterator[None]:
        yield from self.hover(place)
        self.send("LEFTMOUSE", "PRESS", **more)
        self.send("LEFTMOUSE", "RELEASE", **more)
        yield

    def key(self, name: str, **more: bool) -> Iterator[None]:
        self.tap(name, **more)
        yield

    def tap(self, name: str, **more: bool) -> None:
        kind = NAMED_KEYS.get(name, name)
        shown = {"unicode": name.lower()} if len(name) == 1 and not more else {}
        self.send(kind, "PRESS", **more, **shown)
        self.send(kind, "RELEASE", **more)

    def write(self, number: str) -> None:
        for sign in number:
            kind = SIGN_KEYS.get(sign) or DIGIT_KEYS[int(sign)]
            self.send(kind, "PRESS", unicode=sign)
            self.send(kind, "RELEASE")


def _middle(places: list[Place]) -> Place:
    xs, ys = zip(*places, strict=True)
    return sum(xs) / len(xs), sum(ys) / len(ys)


def _inside(places: list[Place]) -> Place:
    """A vertex, the middle of an edge, the middle of the largest triangle of a face."""
    if len(places) < 3:
        return _middle(places)
    triangles = geometry.tessellate_polygon([[Vector((*p, 0.0)) for p in places]])
    return _middle(max(([places[k] for k in t] for t in triangles), key=lambda t: geometry.area_tri(*map(Vector, t))))
