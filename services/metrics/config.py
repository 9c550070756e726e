"""Settings of the metrics endpoint, section ``[metrics]`` of a site file."""

import msgspec

from shared.config.ranges import check_ranges


class MetricsConfig(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Where Prometheus finds the metrics, and for how long a service that left is shown."""

    host: str = "127.0.0.1"
    """Interface it is served on; there is no password, so only this machine."""
    port: int = 9464
    """Of ``/metrics`` and ``/healthz``; 0 takes any that is free."""
    forget_after: float = 60.0
    """A service that says nothing for so long disappears (s); each says something every second."""
    max_services: int = 12_000
    """More than so many are not shown, and counted as refused."""

    def __post_init__(self) -> None:
        """Check the ranges.

        Raises:
            ValueError: a value is out of its range; says which, and what is allowed.
        """
        if not self.host:
            raise ValueError("host is empty: name an interface, such as 127.0.0.1")
        check_ranges(
            self, ("port", 0, 65535), ("forget_after", 5.0, 3600.0), ("max_services", 1, 65536)
        )
