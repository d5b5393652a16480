"""What runs inside Blender, and how it is packed: the coach, an extension."""
