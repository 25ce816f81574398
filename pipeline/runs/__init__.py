"""The runs of a scenario: their scenes, shared points, domains, store templates and summaries."""
