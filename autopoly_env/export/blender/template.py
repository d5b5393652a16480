"""Rebuilds a mesh in Blender the way it was built in AutoPoly: step by step, with Blender's own operators.

In Blender (3.4 or newer): open this file in the Scripting workspace and press Run Script (Alt+P). From a command
line, where everything after the bare -- may be left out:

  blender --python FILE
  blender -b --factory-startup --python FILE -- --blend a.blend --obj a.obj --report a.json --render a.png
  blender -b --factory-startup --python FILE -- --keyframes --depth 0.1 --blend a.blend

The mesh lies in the unit square of the XY plane, x right and y up, and looks up: numpad 7 shows it. Vertices and faces
go by the numbers of the construction sequence, which stay with them as the attributes vertex_id and face_id.
"""

import argparse
import base64
import json
import os
import sys
import traceback

import bpy  # first: where Blender is a module of Python (pip install bpy), it brings bmesh along

# isort: split
import bmesh

# --- the construction ---

NAME = "a house"
DEPTH = 0.0  # thickness, in units of the unit square; 0 is flat
KEYFRAMES = False  # an object for every step, shown one after the other
HALF: float | None = None  # x at which the mesh is cut, for a Mirror modifier; None: whole
PICTURE = ""  # what is built, a PNG in base64, laid under the mesh


def build() -> None:
    """Every step: an operator, where the vertices went, and how many vertices, edges and faces there are then."""
    start(
        {0: (0.25, 0.75), 1: (0.75, 0.75), 2: (0.75, 0.25), 3: (0.25, 0.25)},
        {0: (0, 3, 2, 1)},
        next_vertex=4,
        next_face=1,
    )
    expect(4, 4, 1)

    # Step 1
    edge_subdivide(0, 1)
    move({4: (0.5, 0.875)})
    expect(5, 5, 1)


# --- what a step is in Blender ---

bm = bmesh.new()
VERTEX_ID = bm.verts.layers.int.new("vertex_id")
FACE_ID = bm.faces.layers.int.new("face_id")
next_ids = {"vertex": 0, "face": 0}


def vertex(name: int) -> bmesh.types.BMVert:
    """The vertex with this number. Looked up anew each time: an operator leaves old handles behind."""
    (found,) = (v for v in bm.verts if v[VERTEX_ID] == name)
    return found


def face(name: int) -> bmesh.types.BMFace:
    """The face with this number."""
    (found,) = (f for f in bm.faces if f[FACE_ID] == name)
    return found


def edge(a: int, b: int) -> bmesh.types.BMEdge:
    """The edge between two vertices."""
    return bm.edges.get((vertex(a), vertex(b)))


def name_new(kind: str, element: bmesh.types.BMVert | bmesh.types.BMFace) -> None:
    """Give a new vertex or face the next number; what Blender copied from its source is not its own."""
    element[VERTEX_ID if kind == "vertex" else FACE_ID] = next_ids[kind]
    next_ids[kind] += 1


def start(
    vertices: dict[int, tuple[float, float]], faces: dict[int, tuple[int, ...]], *, next_vertex: int, next_face: int
) -> None:
    """The mesh to begin with, and the numbers that the first new vertex and face will get."""
    for name, (x, y) in vertices.items():
        bm.verts.new((x, y, 0.0))[VERTEX_ID] = name
    for name, corners in faces.items():
        bm.faces.new([vertex(v) for v in corners])[FACE_ID] = name
    next_ids.update(vertex=next_vertex, face=next_face)


def edge_subdivide(a: int, b: int) -> None:
    """A new vertex in the middle of edge a-b."""
    made = bmesh.ops.subdivide_edges(bm, edges=[edge(a, b)], cuts=1)
    (middle,) = (e for e in made["geom_inner"] if isinstance(e, bmesh.types.BMVert))
    name_new("vertex", middle)


def edge_extrude(a: int, b: int) -> None:
    """A new quad on the boundary edge a-b; the copies of a and b get the next numbers, in this order."""
    made = bmesh.ops.extrude_edge_only(bm, edges=[edge(a, b)])["geom"]
    copies = {e for e in made if isinstance(e, bmesh.types.BMVert)}
    for copy in copies:
        copy[VERTEX_ID] = -1
    for source in (vertex(a), vertex(b)):
        (copy,) = copies.intersection(e.other_vert(source) for e in source.link_edges)
        name_new("vertex", copy)
    (quad,) = (e for e in made if isinstance(e, bmesh.types.BMFace))
    name_new("face", quad)


def edge_cap(a: int, b: int) -> None:
    """A new triangle on the boundary edge a-b: the edge extruded, its copy merged to a point in its middle."""
    made = bmesh.ops.extrude_edge_only(bm, edges=[edge(a, b)])["geom"]
    copies = [e for e in made if isinstance(e, bmesh.types.BMVert)]
    (quad,) = (e for e in made if isinstance(e, bmesh.types.BMFace))
    quad[FACE_ID] = -1
    for copy in copies:
        copy[VERTEX_ID] = -1
    bmesh.ops.pointmerge(bm, verts=copies, merge_co=(vertex(a).co + vertex(b).co) / 2)
    name_new("vertex", vertex(-1))
    name_new("face", face(-1))


def edge_fill(a: int, b: int, c: int, d: int) -> None:
    """A new face between the boundary edges a-b and c-d."""
    made = bmesh.ops.contextual_create(bm, geom=[edge(a, b), edge(c, d)])["faces"]
    if not made:  # as it makes none where all corners are corners of one face, in a notch of it
        made = [bm.faces.new([vertex(name) for name in dict.fromkeys((c, d, a, b))])]
    name_new("face", made[0])


def vertex_merge(name: int, other: int) -> None:
    """A vertex merged into another one, which stays where it is."""
    bmesh.ops.weld_verts(bm, targetmap={vertex(name): vertex(other)})


def loop_cut(rungs: tuple[tuple[int, int], ...], slide: float, quads: tuple[tuple[int, int], ...]) -> None:
    """An edge loop through quads, across the edges `rungs`, at `slide` from the first end of each to the other.

    Of every quad, by its number, the part with the given corner keeps the number.
    """
    made = bmesh.ops.subdivide_edges(bm, edges=[edge(a, b) for a, b in rungs], cuts=1, use_grid_fill=True)
    for new in (e for e in made["geom_inner"] if isinstance(e, bmesh.types.BMVert)):
        new[VERTEX_ID] = -1
    for a, b in rungs:
        beside = [{e.other_vert(vertex(end)) for e in vertex(end).link_edges} for end in (a, b)]
        (middle,) = (v for v in beside[0] & beside[1] if v[VERTEX_ID] == -1)
        middle.co = vertex(a).co.lerp(vertex(b).co, slide)
        name_new("vertex", middle)
    for name, corner in quads:
        (part,) = (f for f in bm.faces if f[FACE_ID] == name and vertex(corner) not in f.verts)
        name_new("face", part)


def face_inset(name: int, corners: tuple[int, ...]) -> None:
    """A ring of quads inside a face; its middle keeps its number. The new vertices lie on the corners until moved."""
    made = bmesh.ops.inset_individual(bm, faces=[face(name)], thickness=0.0)["faces"]
    for quad in made:
        quad[FACE_ID] = -1
    inner = set(face(name).verts)
    for new in inner:
        new[VERTEX_ID] = -1
    for corner in corners:
        (new,) = inner.intersection(e.other_vert(vertex(corner)) for e in vertex(corner).link_edges)
        name_new("vertex", new)
    for a, b in zip(corners, (*corners[1:], corners[0]), strict=True):
        (quad,) = (f for f in edge(a, b).link_faces if f in made)
        name_new("face", quad)


def face_split(name: int, a: int, b: int) -> None:
    """A face cut from corner a to corner b; the part that runs counter-clockwise from a to b is the new one."""
    new, _, _ = cut(face(name), vertex(a), vertex(b))
    name_new("face", new)


def face_delete(name: int) -> None:
    """A face removed, with the edges and vertices that no other face has."""
    bmesh.ops.delete(bm, geom=[face(name)], context="FACES")


def face_hole(name: int, corners: list[tuple[float, float]], a: int, i: int, b: int, j: int) -> None:
    """A hole with these corners (clockwise), cut with the knife: bridges lead from vertex a to corner i, b to j.

    The part of the face that runs counter-clockwise from a to b is the new one.
    """
    points = [(x, y, 0.0) for x, y in corners]
    if len(round_hole(points, j, i)) > 2:
        new, kept, inner, hole = knife(face(name), points, (vertex(a), i), (vertex(b), j))
    else:  # Blender does not cut along an edge that is there, so the longer way round comes first
        kept, new, inner, hole = knife(face(name), points, (vertex(b), j), (vertex(a), i))
    kept[FACE_ID] = name
    for k in range(len(points)):
        name_new("vertex", hole[k])
    name_new("face", new)
    bmesh.ops.delete(bm, geom=[inner], context="FACES")


def vertex_dissolve(name: int) -> None:
    """A boundary vertex removed; its two edges become one."""
    bmesh.ops.dissolve_verts(bm, verts=[vertex(name)])


def edge_dissolve(a: int, b: int, keep: int) -> None:
    """The edge a-b between two faces removed; they become one, which is called `keep`."""
    names = {f[FACE_ID] for f in edge(a, b).link_faces}
    bmesh.ops.dissolve_edges(bm, edges=[edge(a, b)], use_verts=False)
    (joined,) = (f for f in bm.faces if f[FACE_ID] in names)
    joined[FACE_ID] = keep


def cut(
    whole: bmesh.types.BMFace, a: bmesh.types.BMVert, b: bmesh.types.BMVert, way: tuple[tuple[float, ...], ...] = ()
) -> tuple[bmesh.types.BMFace, bmesh.types.BMFace, list[bmesh.types.BMVert]]:
    """A face cut from a to b by way of some points.

    Gives the part counter-clockwise from a to b, the other part, and the new vertices on the way from a to b.
    """
    old = set(bm.verts)
    part, _ = bmesh.utils.face_split(whole, a, b, coords=way)
    ways: dict[bmesh.types.BMFace, list[bmesh.types.BMVert]] = {}
    for candidate in (whole, part):
        (loop,) = (loop for loop in candidate.loops if loop.vert == b)
        ways[candidate] = []
        while (loop := loop.link_loop_next).vert not in old:
            ways[candidate].append(loop.vert)
        if len(ways[candidate]) == len(way) and loop.vert == a:
            first = candidate
    return first, part if first == whole else whole, ways[first][::-1]


def knife(
    whole: bmesh.types.BMFace,
    points: list[tuple[float, float, float]],
    from_a: tuple[bmesh.types.BMVert, int],
    from_b: tuple[bmesh.types.BMVert, int],
) -> tuple[bmesh.types.BMFace, bmesh.types.BMFace, bmesh.types.BMFace, dict[int, bmesh.types.BMVert]]:
    """A face cut from a over the hole to b, then along the hole's other side.

    Gives the part counter-clockwise from a to b, the other part, the one in the hole, and the hole's corners.
    """
    (a, i), (b, j) = from_a, from_b
    near, far = round_hole(points, j, i)[::-1], round_hole(points, i, j)[1:-1]
    part, rest, corners = cut(whole, a, b, tuple(points[k] for k in near))
    hole = dict(zip(near, corners, strict=True))
    inner, other, corners = cut(rest, hole[i], hole[j], tuple(points[k] for k in far))
    return part, other, inner, hole | dict(zip(far, corners, strict=True))


def round_hole(points: list[tuple[float, float, float]], i: int, j: int) -> list[int]:
    """The corners of the hole from i clockwise to j."""
    return [(i + k) % len(points) for k in range((j - i) % len(points) + 1)]


# --- what ends a step ---

before_move: dict[int, tuple[float, float]] = {}  # where the last operator left the vertices
records: list[dict[str, object]] = []  # of the start and of every step
objects: list[bpy.types.Object] = []


def move(positions: dict[int, tuple[float, float]]) -> None:
    """Vertices put elsewhere."""
    before_move.update({v[VERTEX_ID]: (v.co.x, v.co.y) for v in bm.verts})
    for name, (x, y) in positions.items():
        vertex(name).co = (x, y, 0.0)


def expect(n_vertices: int, n_edges: int, n_faces: int) -> None:
    """Check the counts, which ends a step."""
    found, expected = (len(bm.verts), len(bm.edges), len(bm.faces)), (n_vertices, n_edges, n_faces)
    if found != expected:
        raise RuntimeError(f"step {len(records)}: Blender has (V, E, F) = {found}, expected {expected}")
    records.append(
        {
            "counts": found,
            "vertices": {v[VERTEX_ID]: (v.co.x, v.co.y) for v in bm.verts},
            "faces": {f[FACE_ID]: [v[VERTEX_ID] for v in f.verts] for f in bm.faces},
        }
    )
    if KEYFRAMES:
        add_object(f"{NAME} {len(records) - 1}")
    before_move.clear()


# --- objects, thickness, time ---

FRAMES_PER_STEP = 24
FRAMES_PER_MOVE = 16  # of these
COLOUR, LINE_COLOUR = (0.32, 0.47, 0.76), (0.013, 0.018, 0.03)  # linear RGB
MERGE_DISTANCE = 1e-5  # units; what is nearer to the axis of a half lies on it
LINE_WIDTH, DOT_RADIUS = 0.0056, 0.009  # in rendered pictures, units of the unit square


def add_object(name: str) -> None:
    """An object with the mesh as it is now; the shape key "unmoved" is how the operator left it."""
    copy = bm.copy()
    if DEPTH:
        give_depth(copy)
    if HALF is not None:
        cut_at_axis(copy, HALF)
    copy.normal_update()
    mesh = bpy.data.meshes.new(name)
    copy.to_mesh(mesh)
    objects.append(bpy.data.objects.new(name, mesh))
    mesh.materials.append(bpy.data.materials.get("AutoPoly") or material("AutoPoly", COLOUR))
    if KEYFRAMES and before_move:
        objects[-1].shape_key_add(name="Basis", from_mix=False)
        unmoved = objects[-1].shape_key_add(name="unmoved", from_mix=False)
        names = copy.verts.layers.int["vertex_id"]
        for point, v in zip(unmoved.data, copy.verts, strict=True):
            point.co = (*before_move[v[names]], v.co.z)
    copy.free()
    if HALF is not None:
        objects[-1].location.x = HALF
        mirror = objects[-1].modifiers.new("Mirror", "MIRROR")
        mirror.use_clip, mirror.merge_threshold = True, MERGE_DISTANCE


def cut_at_axis(whole: bmesh.types.BMesh, axis: float) -> None:
    """Leave what lies to the right of x = axis, and put the origin there, about which the modifier mirrors."""
    everything = [*whole.verts, *whole.edges, *whole.faces]
    place, across = (axis, 0.0, 0.0), (1.0, 0.0, 0.0)
    bmesh.ops.bisect_plane(
        whole, geom=everything, dist=MERGE_DISTANCE, plane_co=place, plane_no=across, clear_inner=True
    )
    for v in whole.verts:
        v.co.x = 0.0 if abs(v.co.x - axis) <= MERGE_DISTANCE else v.co.x - axis


def give_depth(flat: bmesh.types.BMesh) -> None:
    """Make it a closed solid from z = -DEPTH to z = 0. Faces that meet in a point only get a vertex each there."""
    for v in list(flat.verts):
        if sum(e.is_boundary for e in v.link_edges) > 2:
            bmesh.utils.vert_separate(v, [])
    back = list(flat.verts)
    bmesh.ops.extrude_face_region(flat, geom=list(flat.faces), use_keep_orig=True)
    for v in back:
        v.co.z = -DEPTH


def material(name: str, colour: tuple[float, float, float], *, glows: bool = False) -> bpy.types.Material:
    """A plain surface, or one that has its colour without any light."""
    made = bpy.data.materials.new(name)
    made.diffuse_color = (*colour, 1.0)  # of the solid view
    if bpy.app.version < (5, 0, 0):
        made.use_nodes = True
    nodes = made.node_tree.nodes
    if not glows:
        nodes["Principled BSDF"].inputs["Base Color"].default_value = (*colour, 1.0)
        return made
    nodes.clear()
    emission, output = nodes.new("ShaderNodeEmission"), nodes.new("ShaderNodeOutputMaterial")
    emission.inputs["Color"].default_value = (*colour, 1.0)
    made.node_tree.links.new(emission.outputs["Emission"], output.inputs["Surface"])
    return made


def add_keyframes(scene: bpy.types.Scene) -> None:
    """Show the objects one after the other, each going from where its operator left it to where it belongs."""
    for k, shown in enumerate(objects):
        begin, end = 1 + k * FRAMES_PER_STEP, 1 + (k + 1) * FRAMES_PER_STEP
        times = {1: k > 0, begin: False} | ({end: True} if k < len(objects) - 1 else {})
        for frame, is_hidden in times.items():
            for what in ("hide_viewport", "hide_render"):
                setattr(shown, what, is_hidden)
                shown.keyframe_insert(what, frame=frame)
        if shown.data.shape_keys:
            unmoved = shown.data.shape_keys.key_blocks["unmoved"]
            for frame, value in ((begin, 1.0), (begin + FRAMES_PER_MOVE, 0.0)):
                unmoved.value = value
                unmoved.keyframe_insert("value", frame=frame)
    scene.frame_start, scene.frame_end = 1, FRAMES_PER_STEP * len(objects)


def add_to_scene() -> bpy.types.Collection:
    """Put the objects into a collection of the scene, the last one selected."""
    scene = bpy.context.scene
    if bpy.app.background and not bpy.data.filepath:  # nobody made the cube, lamp and camera of a new file
        for unasked in list(scene.objects):
            bpy.data.objects.remove(unasked)
    collection = bpy.data.collections.new(NAME)
    scene.collection.children.link(collection)
    for made in objects:
        collection.objects.link(made)
    bpy.context.view_layer.update()
    for other in bpy.context.view_layer.objects:
        other.select_set(other == objects[-1])
    bpy.context.view_layer.objects.active = objects[-1]
    if KEYFRAMES:
        add_keyframes(scene)
    if PICTURE:
        collection.objects.link(reference(base64.b64decode(PICTURE)))
    return collection


def reference(png: bytes) -> bpy.types.Object:
    """The picture in the unit square, under the mesh, as Add > Image > Reference makes one."""
    image = bpy.data.images.new(NAME, 1, 1)
    image.pack(data=png, data_len=len(png))
    image.source = "FILE"
    made = bpy.data.objects.new(f"{NAME} picture", None)
    made.empty_display_type, made.data = "IMAGE", image
    made.empty_display_size, made.location = 1.0, (0.5, 0.5, -0.01)
    made.color, made.use_empty_image_alpha, made.hide_select = (1.0, 1.0, 1.0, 0.5), True, True
    return made


# --- files, when asked for on the command line ---


def save(collection: bpy.types.Collection, asked: argparse.Namespace) -> None:
    """Write what the options ask for; OBJ and picture are of the last step."""
    scene = bpy.context.scene
    if asked.report:
        with open(asked.report, "w", encoding="utf-8") as stream:
            json.dump({"name": NAME, "blender": bpy.app.version_string, "steps": records}, stream)
    if asked.blend:
        bpy.ops.wm.save_as_mainfile(filepath=asked.blend, check_existing=False)
    if KEYFRAMES:
        scene.frame_set(scene.frame_end)
    if asked.obj:
        # the XY plane stays the XY plane only with these axes
        bpy.ops.wm.obj_export(
            filepath=asked.obj,
            export_selected_objects=True,
            export_materials=False,
            export_normals=False,
            export_uv=False,
            forward_axis="Y",
            up_axis="Z",
        )
    if asked.render:
        render(collection, scene.frame_current, asked)


def render(collection: bpy.types.Collection, frame: int, asked: argparse.Namespace) -> None:
    """Write a picture of the unit square from above, transparent where the mesh is not."""
    shot = bpy.data.scenes.new("AutoPoly picture")  # of its own: lights, cameras and settings of others stay
    shot.collection.children.link(collection)
    objects[-1].data.materials[0] = material("AutoPoly fill", COLOUR, glows=True)
    if asked.edges:
        lines = bpy.data.objects.new("edges", drawn_edges(objects[-1].data))
        lines.location = objects[-1].location
        shot.collection.objects.link(lines)
    shot.camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    shot.collection.objects.link(shot.camera)
    shot.camera.location = (0.5, 0.5, 10.0)
    shot.camera.data.type, shot.camera.data.ortho_scale = "ORTHO", 1.0 + 2.0 * asked.margin
    shot.render.engine, shot.cycles.device, shot.cycles.samples = "CYCLES", "CPU", 16  # the one that needs no display
    shot.cycles.use_denoising, shot.cycles.filter_width = False, 1.0
    shot.render.film_transparent, shot.view_settings.view_transform = True, "Standard"
    shot.render.resolution_x = shot.render.resolution_y = asked.size
    shot.render.filepath, shot.render.image_settings.file_format = asked.render, "PNG"
    shot.render.image_settings.color_mode = "RGBA"
    shot.frame_set(frame)
    bpy.ops.render.render(write_still=True, scene=shot.name)


def drawn_edges(mesh: bpy.types.Mesh) -> bpy.types.Mesh:
    """A strip along every edge and a dot on every vertex, just above the mesh."""
    lines, drawn = bmesh.new(), bpy.data.meshes.new("edges")
    for a, b in ([mesh.vertices[v].co for v in e.vertices] for e in mesh.edges):
        across = b - a
        across.x, across.y, across.z = -across.y, across.x, 0.0
        if across.length > 0.0:  # else it is seen from its end
            across.length = LINE_WIDTH / 2
            lines.faces.new([lines.verts.new(corner) for corner in (a - across, b - across, b + across, a + across)])
    for v in mesh.vertices:
        dot = bmesh.ops.create_circle(lines, cap_ends=True, radius=DOT_RADIUS, segments=16)
        bmesh.ops.translate(lines, verts=dot["verts"], vec=v.co)
    bmesh.ops.translate(lines, verts=lines.verts, vec=(0.0, 0.0, LINE_WIDTH))
    lines.to_mesh(drawn)
    lines.free()
    drawn.materials.append(material("AutoPoly edges", LINE_COLOUR, glows=True))
    return drawn


def options() -> argparse.Namespace:
    """What stands after the bare -- on the command line."""
    given = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else []
    parser = argparse.ArgumentParser(prog="blender -b --factory-startup --python FILE --")
    parser.add_argument("--blend", type=os.path.abspath, help="save all as a .blend file")
    parser.add_argument("--obj", type=os.path.abspath, help="save the mesh as OBJ, n-gons kept")
    parser.add_argument("--report", type=os.path.abspath, help="save what came of every step as JSON")
    parser.add_argument("--render", type=os.path.abspath, help="save a picture (PNG) of the unit square")
    parser.add_argument("--size", type=int, default=512, help="of the picture, in pixels (512)")
    parser.add_argument("--margin", type=float, default=0.0, help="around the unit square (0)")
    parser.add_argument("--edges", action="store_true", help="draw the edges into the picture, too")
    parser.add_argument("--depth", type=float, default=DEPTH, help=f"thickness ({DEPTH})")
    parser.add_argument("--keyframes", action="store_true", default=KEYFRAMES, help="animate the steps")
    asked = parser.parse_args(given) if bpy.app.background else parser.parse_known_args(given)[0]
    if not 0.0 <= asked.depth < float("inf"):
        parser.error(f"--depth {asked.depth}: expected 0 (flat) or more, in units of the unit square")
    if HALF is not None and (asked.depth or asked.keyframes):
        parser.error("--depth and --keyframes: this is half a mesh; write the script without --half for them")
    return asked


def main() -> None:
    """Build the mesh, show it, save it."""
    global DEPTH, KEYFRAMES
    asked = options()
    DEPTH, KEYFRAMES = asked.depth, asked.keyframes
    build()
    if not KEYFRAMES:
        add_object(NAME)
    save(add_to_scene(), asked)


if __name__ == "__main__":
    try:
        main()
    except Exception as error:
        if not bpy.app.background:
            raise
        traceback.print_exc()
        sys.exit(f"error: {type(error).__name__}: {error}")
