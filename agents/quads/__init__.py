"""The `quads` agent: outlines cut into convex quads and few triangles, told from the main body outwards."""
