"""What a picture has that a mesh of it has lost, and what a mesh has that is not in the picture."""

from autopoly_env.details.hairlines import hairline_arguments, hairlines
from autopoly_env.details.lost import Details, Losses

__all__ = ["Details", "Losses", "hairline_arguments", "hairlines"]
