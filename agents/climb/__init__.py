"""Hill climbing on outlines: what neighbours an outline has, and how to go from one top to the next."""
