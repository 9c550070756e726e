from pathlib import Path

import shared.identification as package


def test_nothing_that_finds_knows_of_the_truth():
    root = Path(package.__file__).parent
    finding = [path for path in root.rglob("*.py") if "hidden" not in path.relative_to(root).parts]
    assert len(finding) > 30
    for path in finding:
        text = path.read_text(encoding="utf-8")
        assert "truth.toml" not in text, path
        assert "identification.hidden" not in text, path
        assert "sim.hidden" not in text, path
