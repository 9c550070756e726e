"""The parts of the report, each from the tables of a study: findings, tables and pictures."""
