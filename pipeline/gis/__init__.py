"""How maps look, and the files of maps that geographic information systems open."""
