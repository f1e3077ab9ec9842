"""The configuration of the mock vehicle: typed sections, and reading their YAML."""
