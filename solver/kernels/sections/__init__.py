"""What comes in through sections, and what passes them."""
