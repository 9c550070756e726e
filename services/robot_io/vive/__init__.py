"""A Vive tracker as the person's bat: SteamVR, calibration, dock."""
