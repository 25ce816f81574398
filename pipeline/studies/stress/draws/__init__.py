"""What a random scene is made of, drawn part by part as sections of a scenario file."""
