"""Hashes of descriptions, so that an artifact can say what it was made for."""

import hashlib
import json


def schema_hash(description: object) -> str:
    """Return 16 hex digits of the SHA-256 over a JSON description with sorted keys."""
    text = json.dumps(description, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()[:16]
