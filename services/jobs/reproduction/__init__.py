"""The reproduction report: what of the paper a run of both phases matches."""
