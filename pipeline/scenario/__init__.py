"""From YAML files to checked scenarios, their designs and the solver's objects."""
