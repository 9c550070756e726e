"""Site files: one TOML for all processes of a site, one section for each of its parts."""
