"""The double of SteamVR, as the tests of the tracker have it."""

from tests.integration.vive.conftest import library, vive

__all__ = ["library", "vive"]
