"""A SteamVR that is none: a client library under the real ``openvr`` wheel, poses from a test."""
