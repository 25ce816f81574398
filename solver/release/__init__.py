"""What is released: shapes, their exact cell averages, and the initial state of a run."""
